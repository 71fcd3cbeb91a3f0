//! From samples to dwells: the clocks are aligned, the pauses found, each pause summarised.
//!
//! ```text
//! joints, tip --align_clocks--> ClockAlignment --detect_dwells--> [Dwell] (mean, spread, standard error,
//!                                                                          arrival direction, tip, n_eff)
//! joints, tip, dwells --track------> [TrackSample] (the moving tip, with the joints at that moment)
//! table, base --mean_pose-----> MeanPose (with a warning when the body moved)
//! ```
//!
//! Nothing here knows a file, a board or a robot model; the caller passes the nominal model as a trait object.

mod align;
mod arrival;
mod clock;
mod config;
mod creep;
mod detect;
mod error;
mod history;
mod memory;
mod motion_history;
mod pauses;
mod series;
mod static_pose;
mod stats;
mod stillness;
mod summary;
#[cfg(test)]
mod testkit;
mod track;

pub use align::{NominalArm, PlacedArm, align_clocks};
pub use clock::ClockAlignment;
pub use config::{ClockConfig, DwellConfig, KnownClock};
pub use detect::detect_dwells;
pub use error::DwellError;
pub use static_pose::{MeanPose, mean_pose};
pub use track::{TrackSample, track};
