//! Results of a run, for every reader: `run.mcap` for Foxglove and for programs, `summary.json` for scripts and
//! CI, `parameters.toml` and the calibrated model for the robot, Parquet tables for Python, and a summary
//! for the terminal.
//!
//! `Run -> write_all -> files`. All outputs are views of the one [`Run`]; the same run gives the same bytes,
//! and each file appears whole or not at all.
//!
//! Many recordings, each with a run of its own, make a [`Campaign`]; calibrated together from what those runs observed, they are
//! a [`Run`] too, with [`pool_json`] beside its files.
//!
//! Wherever an error is called *nominal*, it is the error with nominal robot parameters after fitting only
//! the frames that nobody could know beforehand (base, tool, a board whose pose is estimated).

#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod adequate;
mod by_marker;
mod called;
mod campaign;
mod channels;
mod comparison;
mod conclusions;
mod diagnosis_summary;
mod diagnosis_text;
mod error;
mod explanations;
mod findings;
mod layouts;
mod look_at;
mod mcap_file;
mod model_file;
mod page;
mod pairing;
mod parameters;
mod past_diagnosis;
mod past_model;
mod past_observations;
mod past_run;
mod pen;
mod points;
mod pool_json;
mod pool_story;
mod proto;
mod recorded_time;
mod recording_names;
mod run;
mod same_dwells;
mod sizes;
mod story;
mod summary;
mod tables;
mod terminal;
mod text;
mod told_warning;
mod two_arms;
mod verification;
mod viewer_text;
mod write;

pub use armcal_core::DwellMark;
pub use armcal_model_file::{PastArms, PastModel};
pub use campaign::{
    Campaign, FailedRecording, Repeat, campaign_files, campaign_json, campaign_row, campaign_text,
    write_campaign,
};
pub use comparison::{Comparison, Difference, DwellChange, Moved};
pub use conclusions::{Conclusions, Grounds};
pub use diagnosis_text::{channel_told, diagnosis_text, driver_told};
pub use error::ReportError;
pub use explanations::nested_sentence;
pub use look_at::look_at;
pub use model_file::marked_xml;
pub use page::{Basis, PageKind, comparison_html, refit_json, report_html};
pub use pairing::{Side, Unpaired};
pub use past_diagnosis::past_diagnosis;
pub use past_model::open_model;
pub use past_observations::{
    BoardFacts, OBSERVATIONS_FILE, ObservedFile, ObservedRecording, PastObservations, StartFrame,
    observations_json, sha256,
};
pub use past_run::{PastDwell, PastRecording, PastResidual, PastRun, PastRunError};
pub use pen::{RULED, TerminalStyle, number, plain_table, table_text};
pub use pool_json::{POOL_SCHEMA, pool_json};
pub use recording_names::RecordingNames;
pub use run::{Answer, EarlierResult, RecordingRun, Refit, Run, Status, Undiagnosed, VERSION};
pub use same_dwells::also_in;
pub use sizes::size as amplitude_text;
pub use summary::{SCHEMA, summary_json};
pub use terminal::{Detail, terminal};
pub use text::{conclusion, printable};
pub use two_arms::Closing;
pub use verification::{
    IsoReport, PathSample, Told, Verification, VerifiedRecording, verification_files, verification_json,
    verification_paths, verification_text,
};
pub use write::{pool_files, run_files, write_all, write_brief};
