//! The stages of the story that join two crates.

pub mod associated;
pub mod doubts;
pub mod effort;
pub mod frames;
pub mod links;
pub mod measures;
pub mod observe;
pub mod past;
pub mod perceive;
pub mod points;
pub mod readings;
pub mod rigid;
