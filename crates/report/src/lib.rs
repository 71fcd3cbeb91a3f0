//! Results of a run, for every reader: `run.mcap` for Foxglove and for programs, `summary.json` for scripts and
//! CI, `parameters.toml` and the calibrated model for the robot, Parquet tables for Python, and a summary
//! for the terminal.
//!
//! `Run -> write_all -> files`. All outputs are views of the one [`armcal_result::Run`]; the same run gives the same bytes,
//! and each file appears whole or not at all.
//!
//! Many recordings, each with a run of its own, make a [`armcal_result::Campaign`]; calibrated together from what those runs
//! observed, they are a run too, with [`pool_json`] beside its files.

#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod campaign;
mod channels;
mod comparison;
mod diagnosis_text;
mod error;
mod findings;
mod layouts;
mod mcap_file;
mod page;
mod parameters;
mod pen;
mod pool_json;
mod stored_diagnosis;
mod summary;
mod tables;
mod terminal;
mod verification;
mod viewer_text;
mod write;

pub use campaign::{campaign_files, campaign_json, campaign_row, campaign_text, write_campaign};
pub use comparison::comparison_text;
pub use diagnosis_text::{concluded_text, diagnosis_text};
pub use error::ReportError;
pub use page::{comparison_html, live_page, refit_json, report_html};
pub use pen::{RULED, TerminalStyle, number_cell, plain_table, table_text};
pub use pool_json::{POOL_SCHEMA, pool_json};
pub use stored_diagnosis::stored_diagnosis;
pub use summary::summary_json;
pub use terminal::{Detail, run_text};
pub use verification::{verification_files, verification_json, verification_paths, verification_text};
pub use write::{pool_files, run_files, write_all, write_brief};
