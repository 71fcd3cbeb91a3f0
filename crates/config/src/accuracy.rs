//! `[accuracy]`: how good the result has to be.

use serde::Deserialize;

/// How good the result has to be.
#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct AccuracySection {
    /// Mean error of the judged points that is wanted at most [mm]: above it the result is inadequate (exit 3), at it nothing about
    /// the size of the errors makes it so. Eq. 4 of the paper has it as `a`.
    pub wanted_mm: Option<f64>,
}
