//! Does what was learnt in all recordings but one help in that one? Effect by effect.

use crate::error::HeldOutError;
use armcal_calibrate::{Calibration, HeldOut, HoldoutConfig, calibrate, compare_heldout};
use armcal_config::Pipeline;
use armcal_core::Observation;
use armcal_model::{EffectSpec, Model};
use armcal_stages::{Steps, with_effects};
use serde::Serialize;

/// What an effect does to the errors of recordings that its fit did not see.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Transfer {
    /// The effect.
    pub effect: String,
    /// Mean errors without and with it [mm], all other effects in both; null of an event, which no other recording has.
    pub held_out: Option<HeldOut>,
}

impl Transfer {
    /// Whether it raises the error of recordings that it was not fitted to, by more than chance.
    pub fn harms(&self) -> bool {
        self.held_out.as_ref().is_some_and(HeldOut::harms)
    }

    /// In one sentence.
    pub fn sentence(&self) -> String {
        let Transfer { effect, held_out } = self;
        let Some(held_out) = held_out else {
            return format!("{effect} is an event: no other recording can tell whether it happened");
        };
        let (change, verdict) = (held_out.change_text(), held_out.verdict());
        format!("{effect} fitted without each recording in turn {change}: {verdict}")
    }
}

/// Each of the effects, fitted on all recordings but one and judged on that one, in turn; none of a single recording.
///
/// The effects of the first list stay in the model whatever comes of the second, which are judged.
///
/// # Errors
/// A fit without one of the recordings that cannot be made.
pub fn transfer_between_recordings(
    pipeline: &Pipeline,
    geometry: &Model,
    (base, new): (&[EffectSpec], &[EffectSpec]),
    observations: &[Observation],
    progress: &dyn Steps,
) -> Result<Vec<Transfer>, HeldOutError> {
    if pipeline.recordings.len() < 2 {
        return Ok(Vec::new());
    }
    progress.step("fitting without each recording in turn");
    let calibrated = |without: Option<&EffectSpec>| -> Result<Calibration, HeldOutError> {
        let effects: Vec<EffectSpec> =
            base.iter().chain(new.iter().filter(|e| Some(*e) != without)).cloned().collect();
        let model = with_effects(pipeline, geometry, &effects, observations)?;
        Ok(calibrate(&model, observations, &pipeline.fit, &HoldoutConfig::EachRecording)?)
    };
    let lasting = new.iter().any(|e| e.since.is_none());
    let all = lasting.then(|| calibrated(None)).transpose()?;
    let transfer = |effect: &EffectSpec| {
        let held_out = match &all {
            Some(all) if effect.since.is_none() => {
                compare_heldout(&calibrated(Some(effect))?, all, observations, pipeline.diagnosis.flips())
            }
            _ => None,
        };
        Ok(Transfer { effect: effect.to_string(), held_out })
    };
    new.iter().map(transfer).collect()
}
