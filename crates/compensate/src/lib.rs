//! Set-points that bring the tip to where it should be: the calibrated model with all its effects, inverted.
//!
//! One equation: find the encoder readings `q` with `f(q, what came before q) = x`, where `f` is the model's tip and
//! `x` the target.
//!
//! | module | what |
//! |---|---|
//! | [`target`] | what is asked for: a tip pose in the world, or a point on a board; when, under which load |
//! | [`spline`] | waypoints with times become a dense Cartesian path |
//! | [`drive`] | what is asked for of a finished run: its model, as in which recording, in which frame |
//! | [`past`] | what the commanded path leaves behind in the gears: turning points and directions of arrival |
//! | [`inverse`] | damped Newton steps on the model's own joint Jacobian |
//! | [`direction`] | the inverse where `f` depends on the direction of arrival: that of the model is that of the move |
//! | [`set_points`] | the story: one target after the other, nominal and corrected |
//! | `crossing` | on a path, a joint that turns back is given time to cross its gap |
//! | `advice` | what to look at, and what to do where there is no set-point |
//!
//! A set-point is an encoder reading that the controller reaches: the steady error of the servo is taken to be zero.
//! Between set-points every joint is taken to move one way, as in a joint-interpolated move, without overshoot.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::print_stdout))]

mod advice;
mod arm;
mod crossing;
pub mod direction;
pub mod drive;
mod error;
pub mod inverse;
pub mod set_point;
mod set_points;
pub mod spline;
pub mod stored;
pub mod target;

#[cfg(test)]
mod tests;

pub use arm::Arm;
pub use drive::{Drive, TargetFrame, held_joints};
pub use error::CompensateError;
pub use inverse::Limits;
pub use set_point::{Kind, Reached, SetPoint};
pub use set_points::{Compensator, Underway};
pub use spline::resample;
pub use stored::Past;
pub use target::{Conditions, ORIENTING_JOINTS, Target};
