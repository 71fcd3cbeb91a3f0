//! The vocabulary of armcal. No I/O and no algorithms live here, only the nouns every other crate
//! speaks, in the order in which data flows through them:
//!
//! `Samples -> Dwell -> Observation -> Parameter, ErrorStats`, with [`Warning`]s collected on the way.
//!
//! Inside armcal everything is SI (metres, radians, seconds, newton metres) and time is `i64`
//! nanoseconds; every name carries its unit as a suffix. Display units exist only at the edges,
//! through [`Unit`].

pub mod code;
pub mod dwell;
pub mod error_stats;
pub mod feature;
pub mod frames;
pub mod gaps;
pub mod mark;
pub mod mend;
pub mod observation;
pub mod parameter;
pub mod printable;
pub mod reference;
pub mod robust;
pub mod samples;
pub mod setup;
pub mod units;
pub mod visited;
pub mod warning;

pub use code::Code;
pub use dwell::{Arrival, Dwell, DwellId, GaugeReading, TipMeasurement};
pub use error_stats::ErrorStats;
pub use feature::FeatureId;
pub use frames::{Pose, RollPitchYaw};
pub use mark::{DwellMark, hash_of};
pub use mend::{Mend, axis_turns, in_axes};
pub use observation::{Load, Measured, Observation, Rejection};
pub use parameter::{Parameter, ParameterKind, Role};
pub use printable::printable_name;
pub use reference::{Against, Reference};
pub use samples::{FEW_PER_S, JointSamples, PoseSamples, Samples, ScalarSamples};
pub use setup::{Certainty, SetupFinding, SetupReport, Unseen};
pub use units::Unit;
pub use visited::Visited;
pub use warning::{Severity, Stage, Warning, list_names};
