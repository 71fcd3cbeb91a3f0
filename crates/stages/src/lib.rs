//! The stages of a run: from files to dwells, from dwells to observations, from observations to a fit.
//!
//! `preprocess` opens and reads recordings, aligns clocks, finds dwells; `frames` makes the nominal model of the pipeline;
//! `observe` says of each dwell where on the table it was, `measures` what else it was measured against; [`fit_places`] takes
//! them in turn with the calibration until every dwell stays in its place. What is wrong with a setup, or missing in a model, is
//! not asked here.

#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

pub mod associated;
mod declared;
pub mod doubts;
mod effort;
mod error;
mod fit;
pub mod frames;
pub mod joined_tips;
pub mod links;
pub mod measures;
pub mod observe;
mod placed;
pub mod points;
pub mod preprocess;
pub mod readings;
mod rigid;
mod seen;
pub mod still;
mod two_arms;
mod unaligned;

pub use declared::{Change, change_nominals, declare_parameters, override_parameters};
pub use error::RunError;
pub use fit::{Fitted, Inputs, Rounds, fit_places, with_effects};
pub use placed::{Placed, PlacedBase};
pub use seen::RecordingData;
pub use unaligned::CLOCK_RATES;

/// Hears which step begins.
pub trait Steps {
    /// What begins now.
    fn step(&self, what: &str);
}

/// Hears nothing.
pub struct Silent;

impl Steps for Silent {
    fn step(&self, _: &str) {}
}
