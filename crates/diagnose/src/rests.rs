//! Where a joint rests in its play: an angle of its own in every dwell, which no reading shows.
//!
//! Backlash says on which flank a joint that came from one side stands. Where neither load nor friction presses it there it
//! rests anywhere between: noise of that joint, no larger than the gap lets it be. Once the gap has a name and the scatter
//! that is left is certainly that of its joint, the part of the gap that it takes joins the model, so that the floor and the
//! weights of the fit know of it. A scatter larger than the gap is something else.

use crate::diagnosis::{Diagnosis, Refitted};
use crate::implied::{BLURRED, ImpliedError, implied_joint_errors};
use crate::noise::Noise;
use crate::observed::Calibrated;
use armcal_calibrate::calibrate;
use armcal_core::robust::median;
use armcal_core::{Severity, Stage, Warning};
use armcal_model::EffectSpec;

/// The shape of an effect that says how much of its gap a joint rests in.
const REST: &str = "rest";
/// A part of the gap below which it makes no difference.
const NEGLIGIBLE: f64 = 0.1;
/// An estimate this far above the whole gap still is the whole gap: chance.
const WHOLE: f64 = 1.25;

impl Diagnosis {
    /// The calibration with what was found, joints resting in gaps that were found where the scatter is theirs. Names
    /// follow it.
    pub(crate) fn with_rests(&mut self, calibrated: &Calibrated<'_>, refitted: Refitted) -> Refitted {
        let Some((spec, joint, part)) = self.rest(calibrated, &refitted) else { return refitted };
        let named = spec.clone().with(REST, part);
        let with_rest = |e: &EffectSpec| if *e == spec { named.clone() } else { e.clone() };
        let effects: Vec<EffectSpec> = refitted.effects.iter().map(with_rest).collect();
        let Calibrated { model, observations, session, fit, holdout, .. } = *calibrated;
        let Ok(model) = model.with_effects(&effects, session) else { return refitted };
        let Ok(calibration) = calibrate(&model, observations, fit, holdout) else { return refitted };
        let (old, new) = (spec.to_string(), named.to_string());
        let names = self.effects.iter_mut().flat_map(|e| std::iter::once(&mut e.name).chain(&mut e.set));
        names.chain(&mut self.names).filter(|name| **name == old).for_each(|name| name.clone_from(&new));
        let message = format!(
            "{new}: joint {} rests in another place of its play in every dwell, over {:.0} % of the gap; no reading shows where, \
             so that the noise floor counts it ({:.3} mm with it, {:.3} mm without); a preload, or an encoder on the link, \
             takes it away",
            joint + 1,
            100.0 * part,
            calibration.noise_floor_m * 1e3,
            refitted.calibration.noise_floor_m * 1e3
        );
        let warnings = vec![Warning::new(Severity::Notice, Stage::Diagnose, "rests-in-play", new, message)];
        Refitted { effects, model, calibration, warnings }
    }

    /// The gap that was found, its joint, and the part of it in which the joint rests; none where the scatter is not certainly
    /// that of the joint, or larger than the gap.
    fn rest(&self, calibrated: &Calibrated<'_>, refitted: &Refitted) -> Option<(EffectSpec, usize, f64)> {
        let (kind, _) = self.noise.correlated()?;
        let values = refitted.calibration.fit.values();
        let gaps = refitted.model.gaps(&values).into_iter();
        let (spec, joint, width) = gaps
            .filter(|(spec, joint, _)| {
                *Noise::Slack(*joint).word() == *kind && refitted.effects.contains(spec)
            })
            .find(|(spec, ..)| spec.shape.iter().all(|(name, _)| name != REST))?;
        let variance = own_variance(calibrated, refitted, &values, joint)?;
        let part = (12.0 * variance).sqrt() / width.abs();
        let told = (NEGLIGIBLE..=WHOLE).contains(&part);
        told.then(|| (spec, joint, (100.0 * part.min(1.0)).round() / 100.0))
    }
}

/// Variance of a joint's own angle from dwell to dwell beyond what the noise of each explains [rad^2] (prismatic: [m^2]):
/// the weighted mean of the squared implied errors less their variances.
fn own_variance(
    calibrated: &Calibrated<'_>,
    refitted: &Refitted,
    values: &[f64],
    joint: usize,
) -> Option<f64> {
    let calibration = &refitted.calibration;
    let judged = calibration.residuals.iter().zip(calibrated.observations);
    let judged = judged.filter(|(r, _)| r.held_out == calibration.held_out());
    let errors: Vec<ImpliedError> = judged
        .filter_map(|(r, o)| implied_joint_errors(&refitted.model, values, o, &r.fitted_m).swap_remove(joint))
        .collect();
    let usual = median(&errors.iter().map(|e| e.sigma).collect::<Vec<_>>());
    let (mut sum, mut weights) = (0.0, 0.0);
    for e in errors.iter().filter(|e| e.sigma < BLURRED * usual) {
        let weight = e.sigma.powi(-2);
        sum += weight * (e.error.powi(2) - e.sigma.powi(2));
        weights += weight;
    }
    (weights > 0.0 && sum > 0.0).then(|| sum / weights)
}
