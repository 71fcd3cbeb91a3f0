//! armcal calibrates a robot arm from MCAP recordings.
//!
//! [`Pipeline`] is what it is told, [`armcal_pipeline::run`] the main job, [`commands`] are what a user types.

#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

pub mod cli;
pub mod commands;
pub mod dispatch;
pub mod error;
pub mod extended;
pub mod progress;
pub mod stdout;
pub mod threads;
pub mod view;

pub use armcal_config::Pipeline;
pub use error::Error;
