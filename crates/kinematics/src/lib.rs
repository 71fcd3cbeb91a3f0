//! A calibrated arm in another program: its `model.json` as a function.
//!
//! Joint readings in, pose of the tip out, with every effect that the model has; nominal joints or a pose in, the set-point out
//! that `armcal compensate` writes, to the last digit, because it is the same code. No recording, no table, no thread, no clock
//! and no file: text in, numbers out.
//!
//! | module | what |
//! |---|---|
//! | [`arm`] | [`CalibratedArm`]: the model, read and made; the same for everybody, shared by any number of threads |
//! | [`motion`] | [`Motion`]: one arm on its way, which remembers where each joint came from; one thread at a time |
//! | [`c_abi`] | both for C, and through it for Python: `include/armcal_kinematics.h`, `python/armcal_kinematics` |
//!
//! ```text
//! tip:        f(q, where q came from, load, temperature)
//! set-point:  q with f(q, where q came from, ..) = f_nominal(q_nominal)
//! ```

#![cfg_attr(test, allow(clippy::unwrap_used))]

pub mod arm;
pub mod c_abi;
mod error;
pub mod motion;

#[cfg(test)]
mod tests;

pub use arm::{CalibratedArm, Conditions};
pub use error::KinematicsError;
pub use motion::{Driven, Motion, Point};
