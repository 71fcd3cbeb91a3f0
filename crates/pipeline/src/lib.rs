//! A pipeline from its file to its results in memory: nothing is printed, nothing is written.
//!
//! [`run`] is all of it: [`settle`] reads, fits and looks for mistakes of the setup, the diagnosis looks for what the model
//! is missing, the refits show what it would become.

#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod diagnosed;
mod refits;
mod run;
mod settled;

pub use diagnosed::{chosen_again, diagnose_again};
pub use refits::add_refits;
pub use run::{recalibrate, run};
pub use settled::{Settled, run_of, settle, settle_again};
