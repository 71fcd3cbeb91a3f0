//! `loads = [...]` of a recording: what hangs on the arm, and where.

use serde::Deserialize;

/// A load, as written.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoadEntry {
    /// The tip or marker that it hangs at.
    pub at: String,
    /// Its mass [kg].
    pub kg: f64,
}
