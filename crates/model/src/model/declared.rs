//! What a user declares of the parameters of effects, read and asked for.

use super::Model;
use crate::ModelError;
use crate::effects::{Declared, EffectKind, EffectSpec, NominalPose, Override, Session};
use crate::error::similar_name_hint;
use std::collections::BTreeSet;

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
        let zero = self.nominal_arm().zero_pose();
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
            let Ok((_, own)) = self.place(session, &spec, zero, 0) else { continue };
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
