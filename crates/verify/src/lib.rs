//! What a calibrated model is worth on recordings that its calibration never saw.
//!
//! ```text
//! [PointError] --points--> [PointsRow]   Table 4 of the source paper: error at points, by tilt and direction
//! [PathError]  --paths---> [PathRow]     Table 6, figures 6, 7 and 10: error along paths, in space and in planes
//! ```
//!
//! The caller predicts each tip twice, by the nominal and by the calibrated model; here the two are compared pair by
//! pair. Errors are vectors in the axes of the robot's base [m], so that the planes xy, yz and xz are the robot's own.
//!
//! * [`compared`]: mean errors with intervals, and the interval on their difference;
//! * [`clock`]: how late the sensor's stamps are, by the motion itself;
//! * [`points`]: grouped by recording, by axis, by direction of arrival;
//! * [`paths`]: grouped by recording, in space and in the planes; what the clock's uncertainty adds; how far a path
//!   lies from the planned one.

pub mod clock;
pub mod compared;
pub mod paths;
pub mod plane;
pub mod points;
pub mod polyline;

pub use clock::{Lateness, Passing, lateness};
pub use compared::{Compared, Error, Estimate};
pub use paths::{Against, ClockError, PathError, PathRow, Planned, compare_paths, stretch_name};
pub use plane::Plane;
pub use points::{By, PointError, PointsRow, compare_points};
pub use polyline::Polyline;
