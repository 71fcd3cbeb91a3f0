//! What is hidden, as a scorer needs to know it.

use serde::{Deserialize, Serialize};

/// One hidden thing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Hidden {
    /// Family of the scenario.
    pub family: String,
    /// Kind of the mechanism in `[[mechanisms]]`.
    pub mechanism: String,
    /// Joint, from 1.
    pub joint: Option<usize>,
    /// Recording of an event, from 0.
    pub recording: Option<usize>,
    /// For an event within a recording: the first dwell after it.
    pub dwell: Option<usize>,
    /// How large, signed where it has a sign.
    pub size: f64,
    /// Its unit.
    pub unit: String,
    /// What the catalogue would call it, target and moment included, such as `backlash:2`; none outside of it.
    pub effect: Option<String>,
    /// Effects that are the same to any data of this kind, `effect` aside.
    pub same: Vec<String>,
    /// Effects that are nearly the same to data of this design.
    pub alike: Vec<String>,
    /// How it enters: a joint, a length, a frame.
    pub channel: String,
    /// What it depends on.
    pub driver: String,
}

impl Hidden {
    /// Whether it is a smooth displacement over the whole pose: no name and no place is right for it.
    pub fn is_discrepancy(&self) -> bool {
        self.mechanism == "waves"
    }
}
