//! What a user knows of the parameters of effects, whether they are in the model or only tried: `backlash:2.width`.
//!
//! Grammar: the spec of an effect, a dot, and a quantity or a pattern of one (`sensor_scale.*`). A spec without a joint
//! means every joint, as everywhere.

use super::kind::EffectKind;
use super::table::Override;
use super::{EffectSpec, NominalPose, Session, find, placed};
use crate::error::similar_name_hint;
use crate::{Model, ModelError};
use armcal_core::Parameter;
use std::collections::BTreeSet;

/// A change to the parameters of every effect that a spec covers.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Declared {
    name: String,
    wide: EffectSpec,
    quantity: glob::Pattern,
    change: Override,
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

impl Model {
    /// Declares bound, prior or freedom of the parameters of effects, those that are tried by a diagnosis too. Later words
    /// go before earlier ones, and what a spec says of its own parameters before all of them.
    ///
    /// # Errors
    /// A name that no effect of this arm has, a bound or a prior that is not positive.
    pub fn declare(&mut self, name: &str, change: Override) -> Result<(), ModelError> {
        let bad = |problem: String| ModelError::BadEffect { effect: name.to_owned(), problem };
        let (spec, quantity) = name.rsplit_once('.').unwrap_or((name, "*"));
        let wide = self.effect(spec)?;
        let quantity = glob::Pattern::new(quantity)
            .map_err(|cause| ModelError::BadPattern { pattern: name.to_owned(), cause })?;
        for (what, value) in [("bound", change.bound), ("prior", change.prior)] {
            if value.is_some_and(|v| !(v > 0.0 && v.is_finite())) {
                return Err(bad(format!("its {what} must be a positive number; fix it with free = false")));
            }
        }
        let declared = Declared { name: name.to_owned(), wide, quantity, change };
        self.declared = self.declared.iter().cloned().chain([declared]).collect();
        Ok(())
    }

    /// Names of what is declared to be held, as the user wrote them.
    pub fn declared_held(&self) -> Vec<String> {
        self.declared.iter().filter(|d| d.change.free == Some(false)).map(|d| d.name.clone()).collect()
    }

    /// Whether everything declared has a parameter to act on, where its effect can be had from these observations.
    ///
    /// # Errors
    /// A quantity that the effect does not have, naming the nearest.
    pub fn check_declared(&self, session: &Session) -> Result<(), ModelError> {
        let zero = self.zero_pose();
        for declared in self.declared.iter() {
            let known = self.quantities(&declared.wide, session, &zero)?;
            if !known.is_empty() && !known.iter().any(|quantity| declared.quantity.matches(quantity)) {
                let hint = similar_name_hint(declared.quantity.as_str(), known.iter().map(String::as_str));
                let all = known.into_iter().collect::<Vec<_>>().join(", ");
                let problem = format!("it has no parameter \"{}\"{hint} It has: {all}", declared.quantity);
                return Err(ModelError::BadEffect { effect: declared.name.clone(), problem });
            }
        }
        Ok(())
    }

    /// Names of an effect's parameters, wherever it can be placed.
    fn quantities(
        &self,
        wide: &EffectSpec,
        session: &Session,
        zero: &NominalPose,
    ) -> Result<BTreeSet<String>, ModelError> {
        let kind = wide.kind()?;
        let mut known = BTreeSet::new();
        for spec in self.targets(kind, wide.clone()).filter(|spec| wide.covers(spec)) {
            let spec = with_every_shape(kind, spec);
            let Ok((_, own)) = placed::place_effect(self, session, &spec, zero, 0) else { continue };
            let prefix = format!("{spec}.");
            known.extend(own.iter().filter_map(|p| p.name.strip_prefix(&prefix).map(str::to_owned)));
        }
        Ok(known)
    }
}

/// The spec with the least value of every shape that has to be said.
fn with_every_shape(kind: &EffectKind, mut spec: EffectSpec) -> EffectSpec {
    for shape in kind.shapes.iter().filter(|shape| shape.default.is_none()) {
        if !spec.shape.iter().any(|(name, _)| name == shape.name) {
            spec = spec.with(shape.name, shape.lower);
        }
    }
    spec
}
