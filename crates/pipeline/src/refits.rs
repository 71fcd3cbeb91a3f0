//! What the model of a run would become: with what the diagnosis found, and with each of the best candidates.

use crate::diagnosed::{chosen_again, diagnosis_input};
use armcal_calibrate::{calibrate_beside, holdout_turns};
use armcal_config::Pipeline;
use armcal_core::{Code, Severity, Stage, Warning};
use armcal_diagnose::{Calibrated, Diagnosis, ParameterReport};
use armcal_model::EffectSpec;
use armcal_result::{Refit, Run};
use armcal_stages::{RunError, Steps};
use rayon::prelude::*;

/// Candidates that are refitted for the report, at most and at least.
const ALTERNATIVES: [usize; 2] = [8, 2];
/// Observations fitted for all of them together: thousands of poses make every refit slow.
const REFITTED_OBSERVATIONS: usize = 4000;

/// Observations, and parts of the hold-out, of which a run makes the choice of effects again without each part: each is
/// a diagnosis of its own, and of more `armcal add suggested` makes them.
const CHOSEN_AGAIN_OBSERVATIONS: usize = 1000;
const CHOSEN_AGAIN_PARTS: usize = 3;

/// What the model of a run would become: with what was found, and with each of the best candidates.
pub fn add_refits(run: &mut Run, pipeline: &Pipeline, progress: &dyn Steps) -> Result<(), RunError> {
    (run.steps, run.alternatives) = Default::default();
    let Some(mut diagnosis) = run.diagnosis.take() else { return Ok(()) };
    let calibrated = diagnosis_input(run, pipeline);
    let Refits { steps, alternatives, warnings } = sized_by_refits(&mut diagnosis, &calibrated, progress)?;
    if !steps.is_empty() {
        choose_again(&mut diagnosis, pipeline, (&calibrated, run.is_pool()), progress);
    }
    (run.steps, run.alternatives, run.diagnosis) = (steps, alternatives, Some(diagnosis));
    run.warnings.extend(warnings);
    Ok(())
}

/// Models that a diagnosis proposes, fitted.
pub(crate) struct Refits {
    steps: Vec<Refit>,
    alternatives: Vec<Refit>,
    warnings: Vec<Warning>,
}

/// Fits what a diagnosis proposes, and tells the sizes that come out in place of those of one step from the model without
/// them: far from it, where the errors are a thousand times the noise, a step is short.
pub(crate) fn sized_by_refits(
    diagnosis: &mut Diagnosis,
    calibrated: &Calibrated<'_>,
    progress: &dyn Steps,
) -> Result<Refits, RunError> {
    let (steps, warnings) = cumulative_refits(diagnosis, calibrated, progress)?;
    progress.step("fitting the best candidates");
    let alternatives = alternative_refits(diagnosis, calibrated, &steps);
    let estimate = |refit: &Refit, name: &str| {
        let estimates = &refit.calibration.fit.estimates;
        estimates.iter().find(|e| e.parameter.name == name).map(|e| (e.value, e.ci95))
    };
    let resize = |refit: &Refit, spec: &str, sizes: &mut [ParameterReport]| {
        for size in sizes {
            let name =
                if size.name.contains(':') { size.name.clone() } else { format!("{spec}.{}", size.name) };
            if let Some((value, ci95)) = estimate(refit, &name) {
                (size.value, size.ci95) = (value, ci95);
                size.upper_limit95 = value.abs() + 0.5 * (ci95[1] - ci95[0]);
            }
        }
    };
    // What was found, by the model with all of it that has a name.
    let named = steps.iter().find(|step| step.effects.len() == diagnosis.effects.len());
    for found in diagnosis.effects.iter_mut().filter(|found| found.combination.is_none()) {
        named.into_iter().for_each(|step| resize(step, &found.name, &mut found.parameters));
    }
    for candidate in &mut diagnosis.candidates {
        let is_of = |refit: &&Refit| refit.effects.join("+") == candidate.spec;
        let refit = steps.iter().chain(&alternatives).find(is_of);
        refit.into_iter().for_each(|refit| resize(refit, &candidate.spec, &mut candidate.parameters));
    }
    Ok(Refits { steps, alternatives, warnings })
}

/// Makes the choice of what was found again without each part of the hold-out. The verdict stands without it: what stops
/// it is said in its place.
fn choose_again(
    diagnosis: &mut Diagnosis,
    pipeline: &Pipeline,
    (calibrated, is_pool): (&Calibrated<'_>, bool),
    progress: &dyn Steps,
) {
    let poses = calibrated.observations.len();
    let turns = holdout_turns(calibrated.model, calibrated.observations, calibrated.holdout);
    let parts = turns.map_or(0, |turns| turns.len());
    if poses > CHOSEN_AGAIN_OBSERVATIONS || parts > CHOSEN_AGAIN_PARTS {
        let any = if is_pool { "" } else { "; `armcal add suggested` does it for any" };
        let why = format!(
            "a run does so for up to {CHOSEN_AGAIN_OBSERVATIONS} poses and {CHOSEN_AGAIN_PARTS} parts of the hold-out, here \
             are {poses} and {parts}{any}"
        );
        diagnosis.not_chosen_again = Some(why);
        return;
    }
    match chosen_again(pipeline, calibrated, diagnosis, progress) {
        Ok(nested) => diagnosis.nested = nested,
        Err(e) => diagnosis.not_chosen_again = Some(e.to_string()),
    }
}

/// The model with what the diagnosis found, each time fitted anew: one named effect after the other, then all that has no name at
/// once.
fn cumulative_refits(
    diagnosis: &Diagnosis,
    calibrated: &Calibrated<'_>,
    progress: &dyn Steps,
) -> Result<(Vec<Refit>, Vec<Warning>), RunError> {
    let (mut steps, mut warnings) = (Vec::new(), Vec::new());
    let found = diagnosis.suggested(calibrated.model.chain().joint_names())?;
    let named = diagnosis.effects.len().min(found.len());
    let mut counts: Vec<usize> = (1..=named).chain([found.len()]).collect();
    counts.dedup();
    for count in counts.into_iter().filter(|count| *count > 0) {
        progress.step(&format!("fitting what was found ({count} of {})", found.len()));
        let known = diagnosis.refitted.as_deref().filter(|r| r.effects == found[..count]);
        let step = match known {
            Some(r) => Ok(Refit {
                effects: r.effects.iter().map(EffectSpec::to_string).collect(),
                model: r.model.clone(),
                calibration: r.calibration.clone(),
            }),
            None => refit_with_effects(calibrated, &found[..count]),
        };
        match step {
            Ok(step) => steps.push(step),
            // The verdict stands without it; only the picture of this step is missing.
            Err(e) => {
                let message =
                    format!("the model with it cannot be fitted on this hold-out, so it is not shown: {e}");
                let name = found[count - 1].to_string();
                let code = Code::StepNotFitted;
                warnings.push(Warning::new(Severity::Notice, Stage::Calibrate, code, name, message));
                break;
            }
        }
    }
    Ok((steps, warnings))
}

/// The most probable candidates, each alone in the run's model; not those that are a step already.
///
/// One that cannot be fitted on this hold-out has no refit; the ranking says what is known about it.
fn alternative_refits(diagnosis: &Diagnosis, calibrated: &Calibrated<'_>, steps: &[Refit]) -> Vec<Refit> {
    let members = |spec: &str| -> Vec<String> { spec.split('+').map(str::to_owned).collect() };
    let best = diagnosis.candidates.iter().map(|c| members(&c.spec));
    let [most, fewest] = ALTERNATIVES;
    let count = (REFITTED_OBSERVATIONS / calibrated.observations.len().max(1)).clamp(fewest, most);
    let wanted: Vec<Vec<String>> =
        best.filter(|effects| steps.iter().all(|step| step.effects != *effects)).take(count).collect();
    let refit = |effects: &Vec<String>| {
        let specs =
            effects.iter().map(|spec| calibrated.model.effect(spec)).collect::<Result<Vec<_>, _>>().ok()?;
        refit_with_effects(calibrated, &specs).ok()
    };
    wanted.par_iter().filter_map(refit).collect()
}

/// The calibrated model with more effects, on the same observations.
fn refit_with_effects(calibrated: &Calibrated<'_>, effects: &[EffectSpec]) -> Result<Refit, RunError> {
    let Calibrated { model, calibration, observations, session, fit, holdout } = *calibrated;
    let model = model.with_effects(effects, session)?;
    let calibration = calibrate_beside(Some(calibration), &model, observations, fit, holdout)?;
    Ok(Refit { effects: effects.iter().map(EffectSpec::to_string).collect(), model, calibration })
}
