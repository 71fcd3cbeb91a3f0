//! A calibrated arm in what robots, planners and simulators read.
//!
//! | format | module |
//! |---|---|
//! | URDF with the calibrated origins, or made from a DH table | [`urdf`] |
//! | the same origins as a xacro file to include | [`xacro`] |
//! | kinematics of a Universal Robots arm, YAML | [`ur`] |
//! | offsets of the joints alone, YAML | [`zeros`] |
//! | MuJoCo MJCF | [`mjcf`] |
//! | SDFormat | [`sdf`] |
//! | rows of a DH table, CSV | [`dh`] |
//!
//! None of them has a place for physical effects. All hold the arm as [`armcal_model::Skeleton`] gives it, and say of an arm
//! that they cannot hold why not. Every number is the shortest that reads back as the same bits.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used))]

pub mod dh;
mod element;
mod error;
mod format;
pub mod mjcf;
mod names;
pub mod sdf;
pub mod ur;
pub mod urdf;
pub mod xacro;
pub mod zeros;

#[cfg(test)]
mod tests;

pub use error::FormatError;
pub use format::Format;
