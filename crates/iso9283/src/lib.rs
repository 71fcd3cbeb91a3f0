//! ISO 9283:1998, *Manipulating industrial robots: performance criteria and related test methods*: every criterion
//! by the standard's name, symbol and clause, and by its formula where a recording can show it.
//!
//! Two rooms. The formulas are pure functions, one file a family: [`pose`] (7.2), [`distance`] (7.3), [`settling`]
//! (7.4, 7.5, 9), [`drift`] (7.6), [`path`] (8.2 to 8.4) on the planes of [`command`] and [`planes`], [`cornering`]
//! (8.5), [`velocity`] (8.6). [`assess`] takes the [`Evidence`] that a recording gives and returns an [`Assessment`]:
//! what it supports is computed, with a note where there are fewer cycles than the standard asks for; everything else in
//! the [`catalogue`] is listed with the reason, and so are exchangeability (7.7), static compliance (10) and weaving (11),
//! which need what no recording of one arm holds.
//!
//! `Evidence -> Assessment { criteria, not_measured }`
//!
//! Nothing here reads files or knows a robot's model. Lengths are metres, angles radians, times nanoseconds; all
//! poses share one frame, in which x, y and z of the standard are the robot's base axes.
//!
//! ```
//! use armcal_iso9283::{TipPose, pose::pose_accuracy};
//! use nalgebra::Vector3;
//! let commanded = TipPose::at(Vector3::new(0.5, 0.0, 0.3));
//! let attained = [TipPose::at(Vector3::new(0.503, 0.001, 0.3)), TipPose::at(Vector3::new(0.503, -0.001, 0.308))];
//! let ap = pose_accuracy(&commanded, &attained).unwrap();
//! assert!((ap.position_m - 0.005).abs() < 1e-12); // 3 mm along x, 4 mm along z
//! ```

// A test that cannot unwrap has failed, and says what it skipped.
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::print_stdout, clippy::print_stderr))]

mod assess;
pub mod catalogue;
pub mod command;
pub mod cornering;
mod criterion;
pub mod distance;
pub mod drift;
mod error;
mod evidence;
pub mod path;
pub mod planes;
pub mod pose;
pub mod settling;
mod stats;
#[cfg(test)]
mod tests;
mod tip_pose;
pub mod velocity;

pub use assess::assess;
pub use catalogue::Component;
pub use criterion::{Assessment, Criterion, NotMeasured};
pub use error::IsoError;
pub use evidence::{Evidence, PathTest, Settings, Visit};
pub use tip_pose::{TimedPose, TipPose, barycentre};
