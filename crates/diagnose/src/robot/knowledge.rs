//! What the user knows of an arm: effects that cannot act there, the only ones that can, and those that do.

use crate::{DiagnoseError, DiagnosisConfig};
use armcal_core::{Code, Severity, Stage, Warning, list_names};
use armcal_model::EffectSpec;
use std::collections::BTreeMap;

/// Effects with the reason why.
type Reasons = Vec<(EffectSpec, String)>;

/// `exclude`, `only` and `known` of a pipeline, understood.
#[derive(Debug, Clone, Default)]
pub struct Knowledge {
    exclude: Reasons,
    only: Reasons,
    known: Reasons,
}

impl Knowledge {
    /// Reads what a configuration says of an arm with these joints.
    ///
    /// # Errors
    /// A name that the catalogue or the arm does not have.
    pub fn of(config: &DiagnosisConfig, joint_names: &[String]) -> Result<Knowledge, DiagnoseError> {
        let read = |key, all: &BTreeMap<String, String>| -> Result<Reasons, DiagnoseError> {
            let spec = |text: &String| {
                let bad = |source| DiagnoseError::BadEffect { key, effect: text.clone(), source };
                EffectSpec::parse(text, joint_names).map_err(bad)
            };
            all.iter().map(|(text, reason)| Ok((spec(text)?, reason.clone()))).collect()
        };
        Ok(Knowledge {
            exclude: read("exclude", &config.exclude)?,
            only: read("only", &config.only)?,
            known: read("known", &config.known)?,
        })
    }

    /// Whether an effect may be an explanation.
    pub(crate) fn tries(&self, spec: &EffectSpec) -> bool {
        covering_reason(&self.exclude, spec).is_none()
            && (self.only.is_empty()
                || covering_reason(&self.only, spec).or_else(|| self.acts(spec)).is_some())
    }

    /// Why an effect is known to act.
    pub(crate) fn acts(&self, spec: &EffectSpec) -> Option<&str> {
        covering_reason(&self.known, spec)
    }

    /// What was not tried and why, and which parameters of effects are held, for the user to remember.
    pub(crate) fn warning(&self, held: &[String]) -> Option<Warning> {
        let with_reason = |all: &Reasons| -> Vec<String> {
            all.iter().map(|(spec, reason)| format!("{spec} (\"{reason}\")")).collect()
        };
        let mut said = Vec::new();
        if !self.exclude.is_empty() {
            said.push(format!("{} not tried", list_names(&with_reason(&self.exclude))));
        }
        if !self.only.is_empty() {
            said.push(format!("of the catalogue only {} tried", list_names(&with_reason(&self.only))));
        }
        if !held.is_empty() {
            said.push(format!("{} held", list_names(held)));
        }
        let message = format!("as the pipeline says: {}", said.join("; "));
        let notice = Warning::new(Severity::Notice, Stage::Diagnose, Code::NotTried, "diagnosis", message);
        (!said.is_empty()).then_some(notice)
    }
}

fn covering_reason<'r>(all: &'r Reasons, spec: &EffectSpec) -> Option<&'r str> {
    all.iter().find(|(wide, _)| wide.covers(spec)).map(|(_, reason)| reason.as_str())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(all: &[(&str, &str)]) -> BTreeMap<String, String> {
        all.iter().map(|(a, b)| (a.to_string(), b.to_string())).collect()
    }

    fn joints() -> Vec<String> {
        ["base", "elbow"].map(str::to_owned).to_vec()
    }

    #[test]
    fn a_name_without_a_joint_or_a_time_is_about_all_of_them() {
        let config = DiagnosisConfig {
            exclude: map(&[("belt_backlash", "no belts"), ("zero_slip:elbow", "an absolute encoder")]),
            ..Default::default()
        };
        let k = Knowledge::of(&config, &joints()).expect("understood");
        let tried = |text: &str| k.tries(&EffectSpec::parse(text, &joints()).expect("a spec"));
        assert!(!tried("belt_backlash:1") && !tried("belt_backlash:2"));
        assert!(!tried("zero_slip:2@1") && !tried("zero_slip:2@0.4") && tried("zero_slip:1@1"));
        assert!(tried("backlash:1"));
        let said = k.warning(&[]).expect("said").message;
        assert_eq!(
            said,
            "as the pipeline says: belt_backlash (\"no belts\"), zero_slip:2 (\"an absolute encoder\") not tried"
        );
    }

    #[test]
    fn only_leaves_out_all_others_but_what_acts() {
        let config = DiagnosisConfig {
            only: map(&[("backlash", "the gears are old")]),
            known: map(&[("compliance:2", "seen with a dial gauge")]),
            exclude: map(&[("backlash:1", "a direct drive")]),
            ..Default::default()
        };
        let k = Knowledge::of(&config, &joints()).expect("understood");
        let of = |text: &str| EffectSpec::parse(text, &joints()).expect("a spec");
        assert!(k.tries(&of("backlash:2")) && !k.tries(&of("backlash:1")) && !k.tries(&of("compliance:1")));
        assert!(k.tries(&of("compliance:2")));
        assert_eq!(
            (k.acts(&of("compliance:2")), k.acts(&of("compliance:1"))),
            (Some("seen with a dial gauge"), None)
        );
        assert!(Knowledge::default().warning(&[]).is_none() && Knowledge::default().tries(&of("backlash:1")));
    }

    #[test]
    fn a_misspelt_effect_is_named() {
        let config = DiagnosisConfig { exclude: map(&[("backlsh:1", "")]), ..Default::default() };
        let error = Knowledge::of(&config, &joints()).expect_err("misspelt").to_string();
        assert!(error.contains("diagnosis.exclude") && error.contains("\"backlash\""), "{error}");
    }
}
