//! The result of a calibration as a value: a [`Run`], what its errors look like, and what earlier ones left in their files.
//!
//! No output is made here, and but for warnings no sentence: `armcal-wording` tells it, `armcal-report` shows it.
//!
//! Wherever an error is called *nominal*, it is the error with nominal robot parameters after fitting only
//! the unknown frames (base, tool, a board whose pose is estimated).

#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod adequate;
pub mod analysis;
pub mod by_marker;
mod called;
mod campaign;
mod column;
mod comparison;
mod conclusions;
mod error;
mod files;
mod left_out;
mod model_file;
mod pairing;
mod points;
pub mod proto;
mod recorded_time;
mod recording_names;
mod run;
mod same_dwells;
pub mod sensitivity;
mod stored;
pub mod summary;
mod two_arms;
mod verification;
mod warnings;

pub use armcal_campaign::Status;
pub use armcal_core::DwellMark;
pub use armcal_model_file::{StoredArms, StoredModel};
pub use called::Called;
pub use campaign::{Campaign, FailedRecording, Repeat};
pub use column::Column;
pub use comparison::{Comparison, Difference, DwellChange, Moved};
pub use conclusions::{Conclusions, FILE as CONCLUSIONS_FILE, Grounds, InputFiles};
pub use error::ResultError;
pub use files::{ObservedFile, hash_of_parts, sha256};
pub use left_out::{INPUT_METADATA, OWN, PREFIX};
pub use model_file::{ModelFile, marked_xml, model_file_name, model_files};
pub use pairing::{Paired, Side, Unpaired, pair_dwells};
pub use points::{Point, extent, points};
pub use recorded_time::RecordedTime;
pub use recording_names::RecordingNames;
pub use run::{
    EarlierResult, RecordingErrors, RecordingRun, Refit, Run, Undiagnosed, VERSION, effect_part_names,
    role_word, status_word, without_repeats,
};
pub use same_dwells::also_in;
pub use stored::*;
pub use two_arms::{Closing, TwoArms, link_length_m};
pub use verification::{IsoReport, PathSample, Told, Verification, VerifiedRecording};
pub use warnings::status_of;
