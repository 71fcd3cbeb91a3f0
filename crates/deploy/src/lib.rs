//! What a finished result gives to those who drive the arm.
//!
//! [`write`] makes its model a file that robots and simulators read, and says how far off that leaves the arm; [`set_points`]
//! reads targets, places them, and shows the set-points that bring the arm there. The formats themselves are in
//! `armcal_formats`, how set-points are computed in `armcal_compensate`.

#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod error;
pub mod set_points;
pub mod write;

pub use error::DeployError;
