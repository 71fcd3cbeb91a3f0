//! From a diagnosis to the effects that it proposes to add.

use crate::diagnosis::{Diagnosis, ExpressionParameter, FoundEffect, UnknownReport, Verdict};
use crate::enters::DependsOn;
use armcal_model::{EffectSpec, Expression, ModelError, Override};

/// A formula must remove this share of what the free shape removes; otherwise a whole curve is offered.
const FORMULA_SHARE: f64 = 0.9;

impl Diagnosis {
    /// The effects found, the most probable name of each; where none has a name, all unlisted shapes, and beside error
    /// curves of joints the effects that show once these are in the model.
    ///
    /// # Errors
    /// A name that the catalogue does not know on an arm with these joints.
    pub fn suggested(&self, joint_names: &[String]) -> Result<Vec<EffectSpec>, ModelError> {
        let named = self.effects.iter().map(|e| EffectSpec::parse(&e.name, joint_names));
        let mut effects = named.collect::<Result<Vec<_>, ModelError>>()?;
        if self.verdict == Verdict::Unknown {
            effects.extend(self.unlisted.iter().filter_map(UnknownReport::effect));
            let beside = self.beside_curves().iter().map(|e| EffectSpec::parse(&e.name, joint_names));
            effects.extend(beside.collect::<Result<Vec<_>, ModelError>>()?);
        }
        Ok(effects)
    }

    /// Of each effect that is suggested by a name all names that are the same answer.
    pub fn sets(&self) -> Vec<Vec<String>> {
        self.effects.iter().chain(self.beside_curves()).map(|e| e.set.clone()).collect()
    }

    /// Effects that show once the error curves of joints are in the model; none where what is missing is anything else.
    pub fn beside_curves(&self) -> &[FoundEffect] {
        let curves = !self.unlisted.is_empty() && self.unlisted.iter().all(|u| u.own_angle().is_some());
        if self.verdict == Verdict::Unknown && curves { &self.tentative } else { &[] }
    }

    /// Of the suggested effects those to keep, and those that are no part of an arm: a formula of absolute time, or of the
    /// recording, that was fitted over several recordings says nothing of the next one.
    ///
    /// # Errors
    /// As [`Diagnosis::suggested`].
    pub fn lasting(
        &self,
        joint_names: &[String],
        recordings: usize,
    ) -> Result<(Vec<EffectSpec>, Vec<EffectSpec>), ModelError> {
        let of_it = |u: &&UnknownReport| matches!(u.driver, DependsOn::SessionTime | DependsOn::Recording);
        let of_time: Vec<EffectSpec> =
            self.unlisted.iter().filter(of_it).filter_map(UnknownReport::effect).collect();
        let all = self.suggested(joint_names)?;
        Ok(all.into_iter().partition(|e| recordings < 2 || !of_time.contains(e)))
    }
}

impl UnknownReport {
    /// Index of the joint whose error follows its own angle; none of anything else.
    pub fn own_angle(&self) -> Option<usize> {
        self.channel.own_angle(self.driver)
    }

    /// What to add for it: the expression that was fitted, or the error curve of a joint over its own angle where no
    /// formula follows it. `None` where neither reaches the shape.
    pub fn effect(&self) -> Option<EffectSpec> {
        let formula = self.expression.as_ref();
        if let (Some(joint), Some(series)) = (self.own_angle(), self.series)
            && formula.is_none_or(|e| e.share_of_shape < FORMULA_SHARE)
        {
            let curve = EffectSpec::new("error_curve").at(joint);
            let curve = curve.with("harmonics", f64::from(series.harmonics));
            return Some(curve.with("typical", series.typical_rad));
        }
        let formula = formula?;
        let mut spec = EffectSpec::new("expression");
        spec.expression = Some(Expression {
            name: as_identifier(&format!("{}_over_{}", self.channel, self.driver)),
            formula: formula.formula.clone(),
            acts_on: formula.acts_on.clone(),
        });
        let override_of = |p: &ExpressionParameter| Override {
            unit: Some(formula.unit.symbol().to_owned()),
            start: Some(0.0),
            bound: Some(p.bound),
            prior: Some(p.prior),
            free: None,
        };
        spec.overrides = formula.parameters.iter().map(|p| (p.name.clone(), override_of(p))).collect();
        Some(spec)
    }
}

/// Letters and digits of a name.
fn as_identifier(text: &str) -> String {
    text.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect()
}
