//! The pipeline file: one TOML a rig or purpose, its sections in the order of the story.
//!
//! [`Pipeline::load`] reads one and holds its sections against each other; paths inside are relative to the file. Sections that one
//! step alone acts on belong to the crate of that step; all others are here, a file each. A [`Manifest`] names
//! the recordings of an archive instead. Nothing here reads a recording or calculates.

#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod accuracy;
mod check;
mod closed_chain;
mod contradictions;
mod error;
mod frames;
mod load;
mod load_two_arms;
mod loads;
mod manifest;
mod markers;
mod measured;
mod measures;
mod model;
mod observations;
mod output;
mod pattern;
mod pipeline;
mod points;
mod pool;
mod recordings;
mod table;
mod text;
mod two_arms;
mod verify;

pub use accuracy::AccuracySection;
pub use check::{CheckSection, MaxWarnings, Surroundings};
pub use closed_chain::{ClosedChainSection, ClosureKind};
pub use error::ConfigError;
pub use frames::{FramePose, FrameSection, FramesSection, SensorSection, Vertical, pose_knowledge};
pub use loads::LoadEntry;
pub use manifest::{Manifest, recordings_below};
pub use markers::MarkerSection;
pub use measures::{Measure, MeasureKind, MeasureSection};
pub use model::{ModelSection, ParameterOverride};
pub use observations::ObservationsSection;
pub use output::{InputMessages, OutputConfig};
pub use pipeline::Pipeline;
pub use points::PointsFile;
pub use pool::PoolSection;
pub use recordings::{RecordingEntry, recording_name};
pub use table::{BoardPose, MarkersOn, TableSection};
pub use text::read_text;
pub use two_arms::{ArmSection, TwoArms};
pub use verify::{On, Published, TipMount, VerifyConfig};
