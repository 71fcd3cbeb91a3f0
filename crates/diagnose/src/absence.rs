//! Each of several names by its absence: what the refitted model does as well without is taken back.
//!
//! A search that goes forward accepts what explains the most, then what explains the most of what is left. The later a name
//! comes the less is left for it, and the more of that is chance: refitted together with all others, each must lower the
//! errors of held-out points by itself, as in a backward elimination.

use crate::compare::{compare_errors, compare_heldout, held_out_errors_m, mean_by_dwell};
use crate::conclude::{ShownBy, is_worth_naming, learnt, shown_by};
use crate::config::DiagnosisConfig;
use crate::diagnosis::{Diagnosis, Refitted};
use crate::observed::Calibrated;
use armcal_calibrate::{Calibration, ModelProblem, Objective, fitted_values};
use armcal_core::{DwellId, Observation, Severity, Stage, Warning};
use armcal_model::EffectSpec;
use std::collections::BTreeMap;

/// So few dwells show an effect that the mean of all is not clear of chance however much they change: with k alike among
/// many, Student's t is about sqrt(k).
const FEW: f64 = 10.0;

impl Diagnosis {
    /// The calibration with those of the names without each of which it errs more; the others are taken back, the one with
    /// the least evidence first.
    pub(crate) fn each_by_its_absence(
        &mut self,
        calibrated: &Calibrated<'_>,
        found: Refitted,
        config: &DiagnosisConfig,
    ) -> Refitted {
        let mut found = found;
        while let Some((k, without)) = self.superfluous(calibrated, &found, config) {
            self.take_back_one(k, (&without.calibration, &found.calibration), calibrated, config);
            found = without;
        }
        found
    }

    /// The name with the least evidence of those without which the model errs no more, and the model without it; none of a
    /// single effect.
    fn superfluous(
        &self,
        calibrated: &Calibrated<'_>,
        found: &Refitted,
        config: &DiagnosisConfig,
    ) -> Option<(usize, Refitted)> {
        let mut by_evidence: Vec<usize> = (0..self.effects.len()).collect();
        by_evidence.sort_by(|a, b| self.effects[*a].log_evidence.total_cmp(&self.effects[*b].log_evidence));
        by_evidence.into_iter().filter(|_| found.effects.len() > 1).find_map(|k| {
            let mut others = found.effects.clone();
            let own = others.iter().position(|e| e.to_string() == self.effects[k].name)?;
            others.remove(own);
            if clearly_needed(&others, calibrated, found, config) {
                return None;
            }
            let without = calibrated.with(others)?;
            let needed = needed(&without.calibration, &found.calibration, calibrated, config);
            (!needed).then_some((k, without))
        })
    }

    fn take_back_one(
        &mut self,
        k: usize,
        (without, with): (&Calibration, &Calibration),
        calibrated: &Calibrated<'_>,
        config: &DiagnosisConfig,
    ) {
        let name = self.effects.remove(k).name;
        self.name_again();
        let held = compare_heldout(without, with, calibrated.observations, config);
        let change = held.map_or_else(String::new, |h| format!(": it {}, p = {:.3}", h.change_text(), h.p));
        let message = format!(
            "{name} is not named: refitted beside what is named, it does not lower the errors of held-out points by more than \
             chance{change}"
        );
        self.warnings.push(Warning::new(Severity::Notice, Stage::Diagnose, "name-not-needed", name, message));
    }
}

/// Whether the model errs more without an effect: on held-out points so clearly as is asked of the best of many; where these
/// cannot tell, on fitted ones.
fn needed(
    without: &Calibration,
    with: &Calibration,
    calibrated: &Calibrated<'_>,
    config: &DiagnosisConfig,
) -> bool {
    let clear = || {
        compare_heldout(without, with, calibrated.observations, config)
            .is_none_or(|held| held.p <= config.max_p_adjusted)
    };
    match shown_by(without, with, calibrated.observations, config) {
        ShownBy::Nothing => false,
        ShownBy::Judged => clear(),
        ShownBy::Fitted => !learnt(without, with) || carried_by(without, with) < FEW,
    }
}

/// Whether the model without an effect errs clearly more than with it even where it has seen what was held out of that: in its
/// turns it does no better.
fn clearly_needed(
    others: &[EffectSpec],
    calibrated: &Calibrated<'_>,
    found: &Refitted,
    config: &DiagnosisConfig,
) -> bool {
    let with = &found.calibration;
    let Some(without_m) = errors_of_a_fit_to_all_m(others, calibrated, with) else { return false };
    let held = compare_errors(&without_m, &held_out_errors_m(with), calibrated.observations, config);
    held.is_some_and(|held| {
        let worth = is_worth_naming(held.before, held.after, with.noise_floor_m * 1e3);
        worth && held.helps() && held.p <= config.max_p_adjusted
    })
}

/// Errors of the dwells that were held out of `with`, by a fit of the model with these effects to all [m].
fn errors_of_a_fit_to_all_m(
    effects: &[EffectSpec],
    calibrated: &Calibrated<'_>,
    with: &Calibration,
) -> Option<BTreeMap<DwellId, f64>> {
    // Eq. 4 of the paper ends anywhere within its limit.
    if calibrated.fit.objective == Objective::Paper {
        return None;
    }
    let model = calibrated.model.with_effects(effects, calibrated.session).ok()?;
    let known: BTreeMap<&str, f64> =
        with.fit.estimates.iter().map(|e| (e.parameter.name.as_str(), e.value)).collect();
    let start = model.parameters().iter().map(|p| known.get(p.name.as_str()).copied().unwrap_or(p.nominal));
    let problem = ModelProblem::new(&model, calibrated.observations, calibrated.fit).ok()?;
    let start: Vec<f64> = start.collect();
    let scale = Some(with.fit.sigma_scale);
    let fitted = fitted_values(&problem, &start, scale, calibrated.fit).ok()?;
    let held = with.residuals.iter().zip(calibrated.observations).filter(|(r, _)| r.held_out);
    let error_m = |o: &Observation| model.residual(&fitted.values, o).position_m.norm();
    Some(mean_by_dwell(held.map(|(r, o)| (r.dwell, error_m(o)))))
}

/// How many held-out dwells carry the change of their errors: `(sum |c|)^2 / sum c^2`, the number of them if all changed alike.
fn carried_by(without: &Calibration, with: &Calibration) -> f64 {
    let (before, after) = (held_out_errors_m(without), held_out_errors_m(with));
    let changes: Vec<f64> =
        before.iter().filter_map(|(dwell, b)| after.get(dwell).map(|a| (a - b).abs())).collect();
    let square: f64 = changes.iter().map(|c| c * c).sum();
    changes.iter().sum::<f64>().powi(2) / square.max(f64::MIN_POSITIVE)
}

#[cfg(test)]
#[path = "tests/absence.rs"]
mod tests;
