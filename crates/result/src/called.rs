//! How a run calls things: what a diagnosis is told with, by the run and from its results.

use crate::recording_names::RecordingNames;
use serde::{Deserialize, Serialize};

/// Names, and what the sentences of a diagnosis ask of its run besides.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Called {
    /// Names of the recordings.
    pub recordings: RecordingNames,
    /// Names of the joints, where a headline numbers them through all branches.
    pub branched_joints: Vec<String>,
    /// Effects of the model that stand for one of several.
    pub ties: Vec<(String, Vec<String>)>,
    /// Whether it is of earlier results.
    pub is_pool: bool,
    /// Whether what was found could be fitted.
    pub is_refitted: bool,
}

impl Called {
    /// A sentence with recordings and moments by their names.
    pub fn in_words(&self, sentence: &str) -> String {
        self.recordings.in_words(sentence)
    }
}
