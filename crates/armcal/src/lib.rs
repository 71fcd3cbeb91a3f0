//! armcal calibrates a robot arm from MCAP recordings.
//!
//! The story is [`story::run`]; [`pipeline`] is what it is told, [`stages`] are its joints, [`commands`]
//! are what a user types. What is particular to two arms is in [`two_arms`].

#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

pub mod batch;
pub mod check;
pub mod cli;
pub mod commands;
pub mod compensate;
pub mod error;
pub mod init;
pub mod pipeline;
pub mod plan;
pub mod pool;
pub mod progress;
pub mod refits;
pub mod score;
pub mod setup;
pub mod stages;
pub mod stdout;
pub mod story;
pub mod threads;
pub mod transfer;
pub mod two_arms;
pub mod verify;
pub mod view;
pub mod write;

pub use error::Error;
pub use pipeline::Pipeline;
