//! `[output]`: what is written.

use armcal_recording::Recording;
use serde::{Deserialize, Serialize};

/// The `[output]` section of a pipeline.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct OutputConfig {
    /// What `run.mcap` holds of the input; default `"copy"`.
    pub input: InputMessages,
}

impl OutputConfig {
    /// The recordings whose messages are copied into `run.mcap`.
    pub fn copied<'r>(&self, recordings: &'r [Recording]) -> &'r [Recording] {
        match self.input {
            InputMessages::Copy => recordings,
            InputMessages::Reference => &[],
        }
    }
}

/// What `run.mcap` holds of the input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum InputMessages {
    /// Every sound message, attachment and metadata record, untouched.
    #[default]
    Copy,
    /// Only the files' names and hashes.
    Reference,
}
