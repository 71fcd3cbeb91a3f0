//! What the model of a run would become: with what the diagnosis found, and with each of the best candidates.

use crate::diagnosed::{calibrated, chosen_again};
use armcal_calibrate::{calibrate_beside, holdout_turns};
use armcal_config::Pipeline;
use armcal_core::{Severity, Stage, Warning};
use armcal_diagnose::ParameterReport;
use armcal_model::EffectSpec;
use armcal_report::{Refit, Run};
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

/// Makes the choice of what was found again without each part of the hold-out. The verdict stands without it: what stops
/// it is said in its place.
fn choose_again(run: &mut Run, pipeline: &Pipeline, progress: &dyn Steps) {
    let Some(mut diagnosis) = run.diagnosis.take_if(|_| !run.steps.is_empty()) else { return };
    let poses = run.observations.len();
    let parts =
        holdout_turns(&run.model, &run.observations, &pipeline.holdout).map_or(0, |turns| turns.len());
    if poses > CHOSEN_AGAIN_OBSERVATIONS || parts > CHOSEN_AGAIN_PARTS {
        let any = if run.is_pool() { "" } else { "; `armcal add suggested` does it for any" };
        let why = format!(
            "a run does so for up to {CHOSEN_AGAIN_OBSERVATIONS} poses and {CHOSEN_AGAIN_PARTS} parts of the hold-out, here \
             are {poses} and {parts}{any}"
        );
        diagnosis.not_chosen_again = Some(why);
    } else {
        match chosen_again(pipeline, &calibrated(run, pipeline), &diagnosis, progress) {
            Ok(nested) => diagnosis.nested = nested,
            Err(e) => diagnosis.not_chosen_again = Some(e.to_string()),
        }
    }
    run.diagnosis = Some(diagnosis);
}

/// What the run's model would become: with what was found, and with each of the best candidates.
pub fn add_refits(run: &mut Run, pipeline: &Pipeline, progress: &dyn Steps) -> Result<(), RunError> {
    add_steps(run, pipeline, progress)?;
    choose_again(run, pipeline, progress);
    progress.step("fitting the best candidates");
    run.alternatives = alternatives(run, pipeline);
    size_by_refits(run);
    Ok(())
}

/// Tells the sizes that the refits found, in place of those of one step from the model without them: far from it, where the
/// errors are a thousand times the noise, a step is short.
fn size_by_refits(run: &mut Run) {
    let Some(mut diagnosis) = run.diagnosis.take() else { return };
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
    let named = run.steps.iter().find(|step| step.effects.len() == diagnosis.effects.len());
    for found in diagnosis.effects.iter_mut().filter(|found| found.combination.is_none()) {
        named.into_iter().for_each(|step| resize(step, &found.name, &mut found.parameters));
    }
    for candidate in &mut diagnosis.candidates {
        let is_of = |refit: &&Refit| refit.effects.join("+") == candidate.spec;
        let refit = run.steps.iter().chain(&run.alternatives).find(is_of);
        refit.into_iter().for_each(|refit| resize(refit, &candidate.spec, &mut candidate.parameters));
    }
    run.diagnosis = Some(diagnosis);
}

/// Adds what the diagnosis found to the model, each time fitted anew: one named effect after the other, then all that has
/// no name at once.
fn add_steps(run: &mut Run, pipeline: &Pipeline, progress: &dyn Steps) -> Result<(), RunError> {
    run.steps.clear();
    let Some(diagnosis) = &run.diagnosis else { return Ok(()) };
    let found = diagnosis.suggested(run.model.chain().joint_names())?;
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
            None => refit(run, pipeline, &found[..count]),
        };
        match step {
            Ok(step) => run.steps.push(step),
            // The verdict stands without it; only the picture of this step is missing.
            Err(e) => {
                let message =
                    format!("the model with it cannot be fitted on this hold-out, so it is not shown: {e}");
                let name = found[count - 1].to_string();
                let code = "step-not-fitted";
                run.warnings.push(Warning::new(Severity::Notice, Stage::Calibrate, code, name, message));
                break;
            }
        }
    }
    Ok(())
}

/// The most probable candidates, each alone in the run's model; not those that are a step already.
///
/// One that cannot be fitted on this hold-out has no refit; the ranking says what is known about it.
fn alternatives(run: &Run, pipeline: &Pipeline) -> Vec<Refit> {
    let Some(diagnosis) = &run.diagnosis else { return Vec::new() };
    let members = |spec: &str| -> Vec<String> { spec.split('+').map(str::to_owned).collect() };
    let best = diagnosis.candidates.iter().map(|c| members(&c.spec));
    let [most, fewest] = ALTERNATIVES;
    let count = (REFITTED_OBSERVATIONS / run.observations.len().max(1)).clamp(fewest, most);
    let wanted: Vec<Vec<String>> =
        best.filter(|effects| run.steps.iter().all(|step| step.effects != *effects)).take(count).collect();
    let refit = |effects: &Vec<String>| {
        let specs = effects.iter().map(|spec| run.model.effect(spec)).collect::<Result<Vec<_>, _>>().ok()?;
        refit(run, pipeline, &specs).ok()
    };
    wanted.par_iter().filter_map(refit).collect()
}

/// The run's model with more effects, calibrated on its observations.
fn refit(run: &Run, pipeline: &Pipeline, effects: &[EffectSpec]) -> Result<Refit, RunError> {
    let model = run.model.with_effects(effects, &run.session)?;
    let (fit, holdout) = (&pipeline.fit, &pipeline.holdout);
    let calibration = calibrate_beside(Some(&run.calibration), &model, &run.observations, fit, holdout)?;
    Ok(Refit { effects: effects.iter().map(EffectSpec::to_string).collect(), model, calibration })
}
