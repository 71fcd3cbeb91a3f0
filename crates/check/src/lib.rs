//! `[check]`: whether a result keeps the limits of its pipeline file, for a job that runs on every change.
//!
//! [`CheckSection`](armcal_config::CheckSection) is what the user writes; [`Limits`] the same, ready to judge: its reference read, its effects understood.
//! [`judge`] makes one [`Check`] of every limit: [`numbers`] errors, dwells and warnings, [`verdict`] the diagnosis,
//! [`shifts`] parameters and [`frame_shifts`] base, tip and boards against the [`reference`](mod@reference). What a broken
//! limit says about its cause comes from [`reasons`]. The [`Judged`] whole is shown by [`text`], [`junit`] and [`markdown`].

#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod error;
mod frame_shifts;
mod judged;
pub mod junit;
mod limits;
pub mod markdown;
mod measured;
mod numbers;
mod reasons;
pub mod reference;
mod shifts;
pub mod text;
mod told;
mod verdict;

pub use error::CheckError;
pub use judged::{Judged, Judgement, SCHEMA, judge};
pub use limits::Limits;
pub use measured::{Check, Measured};
