//! Points of the arm.

use serde::{Deserialize, Serialize};

/// A point of the arm that is measured, by its place among the model's: the tip first (one of each arm), then the markers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct FeatureId(pub usize);

impl FeatureId {
    /// The tip, which every model has.
    pub const TIP: FeatureId = FeatureId(0);

    /// Whether it is the tip.
    pub fn is_tip(&self) -> bool {
        *self == FeatureId::TIP
    }
}
