//! What one session taught, judged in another: the arm and its effects as calibrated there, among the frames of here.
//!
//! Each effect is judged by its absence: the first session is calibrated with all effects but this one, and what that
//! predicts in the second is compared, pose by pose, with what all of them predict. Nothing of the arm is fitted to the
//! second session; frames that nobody could know without it are, alike for every model.

use super::LeftOut;
use crate::error::HeldOutError;
use crate::stored::{is_lasting, place_arms};
use armcal_calibrate::{HeldOut, HoldoutConfig, calibrate, compare_errors, mean_by_dwell};
use armcal_config::Pipeline;
use armcal_core::{DwellId, Warning};
use armcal_model::EffectSpec;
use armcal_pipeline::Converged;
use armcal_result::StoredArms;
use armcal_stages::{Fitted, Steps, frames, preprocess, with_effects};
use rayon::prelude::*;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// Format of the JSON.
const SCHEMA: &str = "armcal.transfer/1";

/// What is asked.
#[derive(Debug, Clone)]
pub struct Asked<'a> {
    /// Pipeline file of the session that teaches.
    pub from: &'a Path,
    /// Pipeline file of the session that judges.
    pub to: &'a Path,
    /// Effects beside those of the first pipeline; where neither has any, those that its diagnosis suggests.
    pub effects: &'a [String],
}

/// What became of a calibration in another session.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SessionTransfer {
    schema: &'static str,
    /// Pipeline of the session that taught.
    pub from: String,
    /// Pipeline of the session that judges.
    pub to: String,
    /// Expected mean error there if the model were exact [mm]; null where nothing says.
    pub noise_floor_mm: Option<f64>,
    /// Mean errors there [mm]: of the nominal arm, and of the arm as calibrated without the effects.
    pub calibration: HeldOut,
    /// Mean errors there [mm]: calibrated without the effects, and with all of them; null where there are none.
    pub together: Option<HeldOut>,
    /// Each effect by its absence.
    pub effects: Vec<Carried>,
    /// Effects that no other session can share.
    pub left_behind: Vec<LeftOut>,
    /// What could not be known without the poses that judge, and the like.
    pub warnings: Vec<Warning>,
}

/// One effect in the other session.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Carried {
    /// As a pipeline spells it.
    pub effect: String,
    /// Mean errors there without and with it [mm], all others in both.
    pub held_out: HeldOut,
    /// What the interval says.
    pub verdict: &'static str,
}

impl SessionTransfer {
    /// Whether something that was learnt raises the error there, by more than chance.
    pub fn harms(&self) -> bool {
        self.calibration.harms() || self.effects.iter().any(|e| e.held_out.harms())
    }
}

/// Calibrates the first session with and without each effect and judges all of it in the second.
///
/// # Errors
/// Pipelines that cannot be run, setups that contradict their data, sessions that share readings, arms of two kinds.
pub fn transfer_between_sessions(
    asked: &Asked<'_>,
    progress: &dyn Steps,
) -> Result<SessionTransfer, HeldOutError> {
    let (from, mut to) = (Pipeline::load(asked.from)?, Pipeline::load(asked.to)?);
    // All of it judges: none of it is fitted but frames.
    to.holdout = HoldoutConfig::None;
    let (_, chain) = frames::nominal_chain(&from)?;
    let named = asked.effects.iter().map(|word| EffectSpec::parse(word, chain.joint_names()));
    let named: Vec<EffectSpec> = named.collect::<Result<_, _>>().map_err(HeldOutError::Usage)?;
    let taught = converge_session(&from, progress)?;
    let judge = converge_session(&to, progress)?;
    let seen = taught.inputs.seen.iter().chain(&judge.inputs.seen);
    let fingerprints: Vec<_> = seen.map(|s| (s.name.as_str(), s.fingerprint.as_ref())).collect();
    preprocess::refuse_repeated(&fingerprints)?;

    let (effects, left_behind) = effects_to_judge(named, &from, &taught, progress)?;
    progress.step(&format!("judging {} in {}", from.name, to.name));
    let carrier =
        Carrier { path: asked.from, from: &from, taught: &taught.fitted, to: &to, judge: &judge.fitted };
    let bare = carrier.carried(&[])?;
    let with = |effects: &[EffectSpec]| match effects.is_empty() {
        true => Ok(bare.clone()),
        false => carrier.carried(effects),
    };
    let all = with(&effects)?;
    let compare = |before: &Errors, after: &Errors| {
        let held_out = compare_errors(before, after, &judge.fitted.observations, to.diagnosis.flips());
        held_out.ok_or_else(|| HeldOutError::NothingToJudge { pipeline: to.name.clone() })
    };
    let carried = |effect: &EffectSpec| -> Result<Carried, HeldOutError> {
        let others: Vec<EffectSpec> = effects.iter().filter(|e| *e != effect).cloned().collect();
        let held_out = compare(&with(&others)?.errors_m, &all.errors_m)?;
        Ok(Carried { effect: effect.to_string(), held_out, verdict: held_out.verdict() })
    };
    let each: Vec<Result<Carried, HeldOutError>> = effects.par_iter().map(carried).collect();
    Ok(SessionTransfer {
        schema: SCHEMA,
        noise_floor_mm: Some(judge.fitted.calibration.noise_floor_m * 1e3).filter(|mm| mm.is_finite()),
        calibration: compare(&bare.nominal_errors_m, &bare.errors_m)?,
        together: (!effects.is_empty()).then(|| compare(&bare.errors_m, &all.errors_m)).transpose()?,
        effects: each.into_iter().collect::<Result<_, _>>()?,
        left_behind,
        warnings: all.warnings,
        from: from.name,
        to: to.name,
    })
}

/// A session without a mistake in its setup: of another, every sentence would be about the mistake.
fn converge_session(pipeline: &Pipeline, progress: &dyn Steps) -> Result<Converged, HeldOutError> {
    let settled = armcal_pipeline::settle(pipeline, progress)?;
    settled.refuse_mistakes()?;
    Ok(settled)
}

/// What is judged, and what cannot be.
fn effects_to_judge(
    named: Vec<EffectSpec>,
    from: &Pipeline,
    taught: &Converged,
    progress: &dyn Steps,
) -> Result<(Vec<EffectSpec>, Vec<LeftOut>), HeldOutError> {
    let geometry = &taught.fitted.geometry;
    let mut all = frames::effect_specs(from, geometry)?;
    all.extend(named);
    let mut left_behind = Vec::new();
    if all.is_empty()
        && let Some(found) = taught.diagnose(from, progress)?
    {
        // Both sessions together are several recordings: a formula of one's time says nothing of the other.
        let (lasting, of_time) = found.lasting(geometry.chain().joint_names(), 2)?;
        all = lasting;
        left_behind.extend(of_time.iter().map(LeftOut::of_time));
    }
    // What is said of the lasting ones is said where they are carried over.
    let (lasting, events): (Vec<_>, Vec<_>) = all.into_iter().partition(|e| is_lasting(e, &mut Vec::new()));
    left_behind.extend(events.iter().map(LeftOut::event));
    Ok((lasting, left_behind))
}

/// HeldOutError at every pose of the second session [m].
type Errors = BTreeMap<DwellId, f64>;

/// Two sessions, one teaching the other.
struct Carrier<'a> {
    path: &'a Path,
    from: &'a Pipeline,
    taught: &'a Fitted,
    to: &'a Pipeline,
    judge: &'a Fitted,
}

/// What a model of the first session leaves in the second.
#[derive(Clone)]
struct CarriedOver {
    nominal_errors_m: Errors,
    errors_m: Errors,
    warnings: Vec<Warning>,
}

impl Carrier<'_> {
    /// Calibrates the first session with these effects and looks at the second with that.
    fn carried(&self, effects: &[EffectSpec]) -> Result<CarriedOver, HeldOutError> {
        let Fitted { geometry, observations, session, .. } = self.taught;
        let model = with_effects(self.from, geometry, effects, observations)?;
        let calibration = calibrate(&model, observations, &self.from.fit, &HoldoutConfig::None)?;
        let then = StoredArms {
            geometry: geometry.clone(),
            nominal_values: calibration.nominal_values[..geometry.parameters().len()].to_vec(),
            values: calibration.fit.values(),
            model,
        };
        let judging = &self.judge.observations;
        let mut placed = place_arms(&then, session, self.path, self.to, &self.judge.geometry)?;
        let mut warnings = placed.fit_frames(self.to, judging)?;
        warnings.append(&mut placed.warnings);
        let errors = |values: &[f64]| -> Errors {
            mean_by_dwell(
                judging.iter().map(|o| (o.dwell, placed.model.residual(values, o).position_m.norm())),
            )
        };
        Ok(CarriedOver {
            nominal_errors_m: errors(&placed.nominal),
            errors_m: errors(&placed.calibrated),
            warnings,
        })
    }
}
