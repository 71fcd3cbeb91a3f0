//! Where a joint rests in its play: an angle of its own in every dwell, which no reading shows.
//!
//! Backlash says on which flank a joint that came from one side stands. Where neither load nor friction presses it there it
//! rests anywhere between: noise of that joint, no larger than the gap lets it be. Once the gap has a name and the scatter
//! that is left is certainly that of its joint, the part of the gap that it takes joins the model, so that the floor and the
//! weights of the fit know of it. A scatter larger than the gap is something else.

use crate::diagnosis::{Diagnosis, Refitted};
use crate::problem::Candidate;
use crate::robot::Calibrated;
use crate::weigh::scatter::IMPROBABLE;
use armcal_calibrate::tails::ln_f_tail;
use armcal_calibrate::{BLURRED, ImpliedError, PositionNoise, implied_joint_errors};
use armcal_core::robust::median;
use armcal_core::{Code, Severity, Stage, Warning};
use armcal_model::EffectSpec;

/// The shape of an effect that says how much of its gap a joint rests in.
const REST: &str = "rest";
/// A part of the gap below which it makes no difference.
const NEGLIGIBLE: f64 = 0.1;
/// No joint rests in more than its gap; how wide that is, the directions of arrival tell.
const WHOLE: f64 = 1.0;

/// Rounds in which the part of the gap and the fit that it weighs settle.
const ROUNDS: usize = 4;
/// A part that changes by less has settled.
const SETTLED: f64 = 0.02;

impl Diagnosis {
    /// The calibration with what was found, joints resting in gaps that were found where the scatter is theirs. Names
    /// follow it.
    pub(crate) fn with_rests(&mut self, calibrated: &Calibrated<'_>, found: Refitted) -> Refitted {
        let Some((spec, joint)) = self.loose(calibrated, &found) else { return found };
        let Some((part, refitted)) = fit_rest_part(calibrated, &found, &spec, joint) else { return found };
        let (old, new) = (spec.to_string(), spec.with(REST, part).to_string());
        let names = self.effects.iter_mut().flat_map(|e| std::iter::once(&mut e.name).chain(&mut e.set));
        names.chain(&mut self.names).filter(|name| **name == old).for_each(|name| name.clone_from(&new));
        for candidate in &mut self.candidates {
            let members = candidate.spec.split(Candidate::AND);
            let renamed: Vec<&str> =
                members.map(|name| if name == old { new.as_str() } else { name }).collect();
            candidate.spec = renamed.join(Candidate::AND);
        }
        let message = format!(
            "{new}: joint {} rests in another place of its play in every dwell, over {:.0} % of the gap; no reading shows where, \
             so that it counts as noise ({:.3} mm with it, {:.3} mm without); a preload, or an encoder on the link, \
             takes it away",
            joint + 1,
            100.0 * part,
            refitted.calibration.noise_floor_m * 1e3,
            found.calibration.noise_floor_m * 1e3
        );
        let warnings = vec![Warning::new(Severity::Notice, Stage::Diagnose, Code::RestsInPlay, new, message)];
        Refitted { warnings, ..refitted }
    }

    /// A gap that was found, and its joint, where the errors that are left are beyond doubt of that joint.
    fn loose(&self, calibrated: &Calibrated<'_>, found: &Refitted) -> Option<(EffectSpec, usize)> {
        let values = found.calibration.fit.values();
        let gaps = found.model.gaps(&values).into_iter();
        let mut gaps =
            gaps.filter(|(spec, _, width)| may_rest(spec, *width) && found.effects.contains(spec)).peekable();
        gaps.peek()?;
        let (joint, p) = most_of(calibrated, found, &values)?;
        gaps.find(|(_, at, _)| *at == joint && p < IMPROBABLE).map(|(spec, joint, _)| (spec, joint))
    }
}

/// Whether a joint may rest in a gap: no part of it has been told yet, and it is one. A link that leads in the hand of a servo is
/// no link in a gap.
fn may_rest(spec: &EffectSpec, width: f64) -> bool {
    (width > 0.0 || spec.shape.is_empty()) && spec.shape.iter().all(|(name, _)| name != REST)
}

/// The joint along which errors are largest against those across it, and how improbable that is of errors alike in every direction
/// (F test).
fn most_of(calibrated: &Calibrated<'_>, found: &Refitted, values: &[f64]) -> Option<(usize, f64)> {
    let Refitted { model, calibration, .. } = found;
    let mut sums = vec![[0.0; 3]; model.joint_count()];
    for (r, o) in calibration.judged_pairs(calibrated.observations) {
        let Some(noise) = PositionNoise::of(model, values, o) else { continue };
        let all = noise.weigh(&r.fitted_m).dot(&r.fitted_m);
        for (sum, of) in sums.iter_mut().zip(implied_joint_errors(model, values, o, &r.fitted_m)) {
            let Some(ImpliedError { error, sigma }) = of else { continue };
            let along = (error / sigma).powi(2);
            *sum = add_dwell_errors(*sum, along, all);
        }
    }
    least_probable(&sums)
}

/// The sums with one dwell more: its squared error along a joint of all of it, and half of the rest.
fn add_dwell_errors([along, across, n]: [f64; 3], own: f64, all: f64) -> [f64; 3] {
    [along + own, across + 0.5 * (all - own), n + 1.0]
}

/// The joint whose ratio of squared errors along it to those across it (half of their sum, they have two directions) is the least probable,
/// and how probable that is.
fn least_probable(along_across_n: &[[f64; 3]]) -> Option<(usize, f64)> {
    let p = |[along, across, n]: &[f64; 3]| ln_f_tail(along / across.max(1e-300), *n, 2.0 * n);
    let by_joint = along_across_n.iter().map(p).enumerate().filter(|(_, ln_p)| ln_p.is_finite());
    by_joint.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(joint, ln_p)| (joint, ln_p.exp()))
}

/// The part of the gap in which its joint rests, and the fit that weighs its dwells by that; none where that is
/// nothing, or more than the gap.
fn fit_rest_part(
    calibrated: &Calibrated<'_>,
    found: &Refitted,
    spec: &EffectSpec,
    joint: usize,
) -> Option<(f64, Refitted)> {
    let (mut part, mut now) = (0.0, found.clone());
    for _ in 0..ROUNDS {
        let next = part_of_gap(calibrated, &now, (&spec.kind, joint), part)?;
        if (next - part).abs() < SETTLED {
            break;
        }
        part = next;
        let named = spec.clone().with(REST, part);
        let with_rest = |e: &EffectSpec| if e == spec { named.clone() } else { e.clone() };
        let effects: Vec<EffectSpec> = found.effects.iter().map(with_rest).collect();
        now = calibrated.with(effects)?;
    }
    Some((part, now))
}

/// The part of the gap of one kind in which a joint rests, from a fit that assumed `assumed` of it.
fn part_of_gap(
    calibrated: &Calibrated<'_>,
    now: &Refitted,
    (kind, joint): (&str, usize),
    assumed: f64,
) -> Option<f64> {
    let values = now.calibration.fit.values();
    let (_, _, width) =
        now.model.gaps(&values).into_iter().find(|(of, at, _)| of.kind == kind && *at == joint)?;
    let variance = (assumed * width).powi(2) / 12.0 + own_variance(calibrated, now, &values, joint);
    let part = (12.0 * variance.max(0.0)).sqrt() / width.abs();
    (NEGLIGIBLE..=WHOLE).contains(&part).then(|| (100.0 * part).round() / 100.0)
}

/// Variance of a joint's own angle from dwell to dwell beyond what the noise of each explains [rad^2] (prismatic: [m^2]),
/// negative where that is less, not a number where no dwell tells: the weighted mean of the squared implied errors less their
/// variances.
fn own_variance(calibrated: &Calibrated<'_>, refitted: &Refitted, values: &[f64], joint: usize) -> f64 {
    let calibration = &refitted.calibration;
    let errors: Vec<ImpliedError> = calibration
        .judged_pairs(calibrated.observations)
        .filter_map(|(r, o)| implied_joint_errors(&refitted.model, values, o, &r.fitted_m).swap_remove(joint))
        .collect();
    let usual = median(&errors.iter().map(|e| e.sigma).collect::<Vec<_>>());
    let (mut sum, mut weights) = (0.0, 0.0);
    for e in errors.iter().filter(|e| e.sigma < BLURRED * usual) {
        let weight = e.sigma.powi(-2);
        sum += weight * (e.error.powi(2) - e.sigma.powi(2));
        weights += weight;
    }
    sum / weights
}

#[cfg(test)]
#[path = "../tests/rests.rs"]
mod tests;
