//! A pipeline from its file to its results in memory: nothing is printed, nothing is written.
//!
//! [`run`] is all of it: [`settle`] reads, fits and looks for mistakes of the setup, the diagnosis looks for what the model
//! is missing, the refits show what it would become. [`calibrate_jointly`] is the same of the
//! results of many runs, without their recordings.

#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod converged;
mod diagnosed;
mod pool;
mod refits;
mod run;
mod same_inputs;

pub use converged::{Converged, settle, settle_again};
pub use diagnosed::chosen_again;
pub use pool::{PoolError, Pooled, calibrate_jointly};
pub use refits::add_refits;
pub use run::{recalibrate, run};
pub use same_inputs::are_same_inputs;
