//! What is seen in the errors that a calibration leaves.

pub(crate) mod compare;
pub(crate) mod error_places;
pub(crate) mod held_out;
pub(crate) mod implied;
pub(crate) mod paired;
pub(crate) mod repeatability;
pub(crate) mod sign_flips;
pub(crate) mod signs;
pub mod tails;
