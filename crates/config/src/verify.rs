//! `[verify]`: what stands beside a verification on these recordings.

use serde::{Deserialize, Serialize};

/// The `[verify]` section of a pipeline.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct VerifyConfig {
    /// Published numbers to print beside the own ones.
    pub published: Vec<Published>,
    /// Whether the calibrated point is where it was during the calibration.
    pub tip: TipMount,
}

/// Whether the calibrated point on the last link is where it was during the calibration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum TipMount {
    /// It is: both arms keep the tip that the calibration recordings gave them.
    #[default]
    Kept,
    /// Another tool, or a target mounted anew: both arms take the tip of `[frames.tip]`, fitted to the judged dwells where
    /// it is to be estimated.
    Remounted,
}

/// One published row.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Published {
    /// What it is: source and subject.
    pub label: String,
    /// Which table it belongs to.
    pub on: On,
    /// Mean error before calibration [mm].
    pub before_mm: Option<f64>,
    /// Mean error after it [mm].
    pub after_mm: Option<f64>,
    /// By how much the error fell, where only that is published [%].
    pub improvement_percent: Option<f64>,
}

/// Which table a published row belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum On {
    /// Errors at points.
    Points,
    /// Errors along paths.
    Paths,
}
