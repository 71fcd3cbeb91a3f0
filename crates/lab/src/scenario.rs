//! A scenario as it is asked for, and what is hidden in it.

mod design;
mod hidden;

pub use design::{Design, Driving};
pub use hidden::Hidden;

use crate::LabError;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// What to hide, how large, and how the arm moves.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// A family of [`crate::planted`], or several joined by `+`.
    pub family: String,
    /// Joint, from 1, or for events the recording, from 0; drawn when absent. Of several families: of the first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<usize>,
    /// How large. Default `drawn`.
    #[serde(default)]
    pub size: Size,
    /// How the arm moves.
    pub design: Design,
    /// Who moves it. Default `motor`.
    #[serde(default)]
    pub driving: Driving,
    /// Seed of the rig, of the noise and of everything drawn.
    pub seed: u64,
}

/// How large the hidden thing is.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Size {
    /// A sixth into the realistic range, by ratio.
    Small,
    /// The middle of it.
    Medium,
    /// A sixth from its end.
    Large,
    /// Log-uniform over it.
    #[default]
    Drawn,
    /// In the family's own unit.
    Value(f64),
}

impl Scenario {
    /// A scenario with everything else drawn by the seed.
    pub fn new(family: &str, design: Design, seed: u64) -> Scenario {
        let (size, driving) = (Size::default(), Driving::default());
        Scenario { family: family.to_owned(), target: None, size, design, driving, seed }
    }
}

/// A design or a size by its word.
///
/// # Errors
/// A word that is none, with those that are.
pub fn parse_word<T: DeserializeOwned>(key: &str, text: &str) -> Result<T, LabError> {
    let parsed = serde_json::from_value(serde_json::Value::String(text.to_owned()));
    parsed.map_err(|e| LabError::Value { key: key.to_owned(), why: e.to_string() })
}
