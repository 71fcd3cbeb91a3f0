//! The limits of a pipeline, ready to judge.

use super::reference::Calibrated;
use crate::error::CheckError;
use armcal_calibrate::HoldoutConfig;
use armcal_config::ConfigError;
use armcal_config::{CheckSection, Surroundings};
use armcal_config::{Pipeline, RecordingEntry};
use armcal_model::EffectSpec;
use armcal_stages::frames;
use std::path::Path;

/// A change up to this many joint standard deviations is chance, unless the file says otherwise.
const SHIFT_SIGMAS: f64 = 4.0;

/// The section with everything it refers to.
#[derive(Debug, Clone)]
pub struct Limits {
    /// As written.
    pub section: CheckSection,
    /// Effects that may be missing.
    pub allowed: Vec<EffectSpec>,
    /// The accepted result, if there is one.
    pub reference: Option<Calibrated>,
    /// Joint standard deviations that explain a change.
    pub shift_sigmas: f64,
}

impl Limits {
    /// Reads what the section refers to, before a long run.
    ///
    /// # Errors
    /// No limit at all, one that cannot be meant, an effect or joint that does not exist, a reference that cannot be read.
    pub fn of(pipeline: &Pipeline, path: &Path) -> Result<Limits, CheckError> {
        let section = pipeline.check.clone();
        if !section.has_limits() {
            return Err(CheckError::NoLimits { path: path.to_owned() });
        }
        let refused =
            |key: String, problem: String| ConfigError::Contradiction { path: path.to_owned(), key, problem };
        let recordings: Vec<String> = pipeline.recordings.iter().map(RecordingEntry::name).collect();
        let holdout = pipeline.holdout != HoldoutConfig::None;
        let around = Surroundings { recordings: &recordings, holdout, diagnosis: pipeline.diagnosis.enabled };
        if let Some((key, problem)) = section.contradiction(&around) {
            return Err(refused(key, problem).into());
        }
        let (_, chain) = frames::nominal_chain(pipeline)?;
        let joints = chain.joint_names();
        if let Some((joint, _)) = section.teeth.iter().flatten().find(|(joint, _)| !joints.contains(joint)) {
            let problem = format!("names no joint; they are {}", joints.join(", "));
            return Err(refused(format!("check.teeth.{joint}"), problem).into());
        }
        let allowed = section.allowed_effects.iter().flatten().map(|text| EffectSpec::parse(text, joints));
        let allowed = allowed
            .collect::<Result<_, _>>()
            .map_err(|e| refused("check.allowed_effects".into(), format!("is not understood: {e}")))?;
        let reference = section.reference.as_ref().map(|r| Calibrated::open(&pipeline.resolve(r)));
        Ok(Limits {
            allowed,
            reference: reference.transpose()?,
            shift_sigmas: section.max_shift_sigmas.unwrap_or(SHIFT_SIGMAS),
            section,
        })
    }

    /// An angle of a joint, where its teeth are known: `, 0.99 of 128 teeth`.
    pub fn in_teeth(&self, joint: &str, angle_rad: f64) -> String {
        let teeth = self.section.teeth.as_ref().and_then(|t| t.get(joint));
        teeth.map_or(String::new(), |n| {
            format!(", {:.2} of {n} teeth", angle_rad.abs() / std::f64::consts::TAU * f64::from(*n))
        })
    }
}
