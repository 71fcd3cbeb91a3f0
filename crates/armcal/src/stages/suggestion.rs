//! From a diagnosis to the effects that `armcal add suggested` adds.

use crate::error::Error;
use armcal_diagnose::{Diagnosis, UnknownReport, Verdict};
use armcal_model::{EffectSpec, Expression, ModelError, Override};

/// A formula must remove this share of what the free shape removes; otherwise a whole curve is offered.
const FORMULA_SHARE: f64 = 0.9;
/// Harmonics of an error curve that stands for an unlisted shape over a joint's own angle.
const HARMONICS: f64 = 30.0;

/// The effects found, the most probable name of each; where none has a name, all unlisted shapes.
pub fn of(diagnosis: &Diagnosis, joint_names: &[String]) -> Result<Vec<EffectSpec>, Error> {
    let named = diagnosis.effects.iter().map(|e| EffectSpec::parse(&e.name, joint_names));
    let mut effects = named.collect::<Result<Vec<_>, ModelError>>()?;
    if diagnosis.verdict == Verdict::Unknown {
        effects.extend(diagnosis.unlisted.iter().filter_map(unlisted));
    }
    Ok(effects)
}

/// The expression that was fitted, or the error curve of a joint over its own angle where no formula follows it.
pub fn unlisted(unknown: &UnknownReport) -> Option<EffectSpec> {
    let own_angle = unknown
        .channel
        .strip_prefix("joint")
        .filter(|joint| unknown.driver == format!("q{joint}"))
        .and_then(|joint| joint.parse::<usize>().ok()?.checked_sub(1));
    let formula = unknown.expression.as_ref();
    if let Some(joint) = own_angle
        && formula.is_none_or(|e| e.share_of_shape < FORMULA_SHARE)
    {
        return Some(EffectSpec::new("error_curve").at(joint).with("harmonics", HARMONICS));
    }
    let formula = formula?;
    let mut spec = EffectSpec::new("expression");
    spec.expression = Some(Expression {
        name: format!("{}_over_{}", word(&unknown.channel), word(&unknown.driver)),
        formula: formula.formula.clone(),
        acts_on: formula.acts_on.clone(),
    });
    let override_of = |p: &armcal_diagnose::ExpressionParameter| Override {
        unit: Some(formula.unit.symbol().to_owned()),
        start: Some(0.0),
        bound: Some(p.upper.abs().max(p.lower.abs())),
        prior: Some(p.start.abs().max(f64::MIN_POSITIVE)),
        free: None,
    };
    spec.overrides = formula.parameters.iter().map(|p| (p.name.clone(), override_of(p))).collect();
    Some(spec)
}

/// Letters and digits of a name.
fn word(text: &str) -> String {
    text.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect()
}
