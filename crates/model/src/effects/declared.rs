//! What a user knows of the parameters of effects, whether they are in the model or only tried: `backlash:2.width`.
//!
//! Grammar: the spec of an effect, a dot, and a quantity or a pattern of one (`sensor_scale.*`). A spec without a joint
//! means every joint, as everywhere.

use super::overrides::Override;
use super::{EffectSpec, find};
use armcal_core::Parameter;

/// A change to the parameters of every effect that a spec covers.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Declared {
    pub name: String,
    pub wide: EffectSpec,
    pub quantity: glob::Pattern,
    pub change: Override,
}

/// Whether a name is that of an effect's parameter: it begins with a kind of the catalogue.
pub fn is_of_effect(name: &str) -> bool {
    find(name.split([':', '@', ',', '.']).next().unwrap_or_default()).is_some()
}

impl Declared {
    /// Applies to a parameter of an effect, named by its quantity alone.
    pub fn apply(&self, spec: &EffectSpec, parameter: &mut Parameter) -> Result<(), String> {
        match self.wide.covers(spec) && self.quantity.matches(&parameter.name) {
            true => self.change.apply(parameter),
            false => Ok(()),
        }
    }
}
