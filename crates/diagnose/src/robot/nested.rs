//! What a choice is worth on points that had no part in it: the whole search again without each part of the hold-out.
//!
//! A hold-out keeps points from the fit, not from the choice of what is fitted: of hundreds of explanations the one that
//! suits the held-out points best looks better on them than it is (Varma and Simon, BMC Bioinformatics 7:91, 2006). Here
//! every turn of the hold-out is diagnosed without its points, with a hold-out of its own inside, and what that finds
//! predicts them.

use crate::config::{DiagnosisConfig, RESAMPLINGS};
use crate::robot::{Calibrated, diagnose};
use crate::{DiagnoseError, Diagnosis, Nested};
use armcal_calibrate::{
    Calibration, HoldoutConfig, calibrate, compare_errors, held_out_errors_m, holdout_turns,
};
use armcal_core::{DwellId, Observation};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Folds inside a turn where the hold-out itself cannot be taken once more.
const INNER_FOLDS: usize = 4;

/// Chooses again in every turn of the hold-out; none where nothing was found, or nothing is held out.
///
/// # Errors
/// A turn that cannot be calibrated or diagnosed.
pub fn nested_validation(
    calibrated: &Calibrated<'_>,
    found: &Diagnosis,
    config: &DiagnosisConfig,
) -> Result<Option<Nested>, DiagnoseError> {
    let Calibrated { model, calibration, observations, holdout, .. } = *calibrated;
    let Some(refitted) = &found.refitted else { return Ok(None) };
    let turns = holdout_turns(model, observations, holdout)?;
    let config = DiagnosisConfig { resamplings: config.resamplings.min(RESAMPLINGS), ..config.clone() };
    let done: Vec<Result<Fold, DiagnoseError>> =
        turns.par_iter().map(|held| diagnose_fold(calibrated, held, &config)).collect();
    let done = done.into_iter().collect::<Result<Vec<_>, _>>()?;
    let after: BTreeMap<DwellId, f64> =
        done.iter().flat_map(|t| t.errors_m.iter().map(|(d, e)| (*d, *e))).collect();
    let held_out = compare_errors(&held_out_errors_m(calibration), &after, observations, config.flips());
    Ok(held_out.map(|held_out| Nested {
        held_out,
        chosen_on_all_mm: refitted.calibration.holdout.fitted.mean_m * 1e3,
        chosen: done.into_iter().map(|t| t.chosen).collect(),
    }))
}

/// What was chosen without some points, and the errors that it leaves on them.
struct Fold {
    chosen: Vec<String>,
    errors_m: BTreeMap<DwellId, f64>,
}

fn diagnose_fold(
    calibrated: &Calibrated<'_>,
    held: &[usize],
    config: &DiagnosisConfig,
) -> Result<Fold, DiagnoseError> {
    let Calibrated { model, observations, session, fit, .. } = *calibrated;
    let is_held = |i: usize| held.binary_search(&i).is_ok();
    let seen: Vec<Observation> =
        observations.iter().enumerate().filter(|(i, _)| !is_held(*i)).map(|(_, o)| o.clone()).collect();
    let (holdout, calibration) = inner_holdout(calibrated, &seen)?;
    let within =
        Calibrated { model, calibration: &calibration, observations: &seen, session, fit, holdout: &holdout };
    let found = diagnose(&within, config)?;
    let (effects, _) = found.lasting(model.chain().joint_names(), session.recordings)?;
    let model = match effects.is_empty() {
        true => model.clone(),
        false => model.with_effects(&effects, session)?,
    };
    let dwells = held.iter().map(|i| observations[*i].dwell).map(|d| [d.recording, d.dwell]).collect();
    let predicted = calibrate(&model, observations, fit, &HoldoutConfig::Dwells { dwells })?;
    let chosen = effects.iter().map(ToString::to_string).collect();
    Ok(Fold { chosen, errors_m: held_out_errors_m(&predicted) })
}

/// The hold-out once more among what a turn sees, or folds of it where too little is left for that.
fn inner_holdout(
    calibrated: &Calibrated<'_>,
    seen: &[Observation],
) -> Result<(HoldoutConfig, Calibration), DiagnoseError> {
    let Calibrated { model, fit, holdout, .. } = *calibrated;
    let again = match holdout {
        HoldoutConfig::EachRecording | HoldoutConfig::RecordingFolds { .. } => HoldoutConfig::EachRecording,
        HoldoutConfig::CavityFolds { k } => HoldoutConfig::CavityFolds { k: *k },
        _ => HoldoutConfig::CavityFolds { k: INNER_FOLDS },
    };
    let several = seen.iter().any(|o| o.dwell.recording != seen[0].dwell.recording);
    let by_recording = again == HoldoutConfig::EachRecording;
    let folds = HoldoutConfig::CavityFolds { k: INNER_FOLDS };
    for holdout in [again, folds].into_iter().skip(usize::from(by_recording && !several)) {
        if let Ok(calibration) = calibrate(model, seen, fit, &holdout) {
            return Ok((holdout, calibration));
        }
    }
    Ok((HoldoutConfig::None, calibrate(model, seen, fit, &HoldoutConfig::None)?))
}
