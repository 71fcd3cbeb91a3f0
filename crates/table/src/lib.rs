//! The calibration board: where its cavities are, how the tilting mechanism moves it, and which cavity
//! the tip was in during each dwell.
//!
//! `Board + DwellTips -> Association`. The board comes from a geometry file ([`Board::from_toml`]), its
//! pose from a tracker, from a declared [`Tilt`], or from nothing at all ([`BoardStart::Unknown`]).
//! [`associate`] stays right when the nominal model is further off than cavities are apart, because it
//! explains all dwells of a recording at once by one smooth field of model errors, and it says so where
//! two explanations are equally good.

// A test that cannot unwrap has failed.
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod associate;
mod association;
mod board;
mod config;
mod error;
mod keys;
mod tilt;

pub use associate::{BoardStart, DwellTip, associate};
pub use association::{Assignment, Association, Place};
pub use board::{Board, Cavity};
pub use config::AssociationConfig;
pub use error::TableError;
pub use tilt::{Mechanism, Tilt};
