//! How far a change of the joints' readings moves the arm. What moves it by far more than the errors are undoes no mistake:
//! with the mistake the errors would be of that size.

use super::hypotheses::Hypothesis;
use super::trial::Misfit;
use armcal_core::{Dwell, FeatureId};
use armcal_model::Model;
use armcal_stages::links::fit_rigid_motion;
use armcal_stages::{Fitted, Inputs};
use nalgebra::Point3;

/// A fit takes up much of what a mistake does, and leaves more than this share of it.
const LEAST_LEFT: f64 = 0.03;
/// Where this share of the dwells is used, those that no change could place do not hide the size of the errors.
const NEARLY_ALL: f64 = 0.9;

/// The arm with the readings as they are.
pub struct Moving<'a> {
    inputs: &'a Inputs,
    model: &'a Model,
    nominal: Vec<f64>,
    left_m: f64,
}

impl<'a> Moving<'a> {
    /// None where the errors are of a part of the dwells.
    pub fn of(inputs: &'a Inputs, fitted: &'a Fitted, before: &Misfit) -> Option<Moving<'a>> {
        let all = inputs.dwells().count() as f64;
        let (model, nominal) = (&fitted.geometry, fitted.geometry.nominal());
        let left_m = before.mean_m;
        (before.used as f64 >= NEARLY_ALL * all).then_some(Moving { inputs, model, nominal, left_m })
    }

    /// Whether the change moves the arm by more than what errors by so little could be left of.
    pub fn goes_too_far(&self, h: &Hypothesis) -> bool {
        let changed = h.undone(self.inputs);
        let features: Vec<FeatureId> = self.model.features().map(|(feature, _)| feature).collect();
        let moved_m = features.iter().map(|feature| self.moved_m(&changed, *feature)).fold(0.0, f64::max);
        self.left_m < LEAST_LEFT * moved_m
    }

    /// Root mean square distance [m] by which a point of the arm is elsewhere, the frames of each recording moved along.
    fn moved_m(&self, changed: &Inputs, feature: FeatureId) -> f64 {
        let at_m =
            |d: &Dwell| self.model.feature_in_base(&self.nominal, feature, &d.joint_rad).translation.vector;
        let mut sum_m2 = 0.0;
        for (own, other) in self.inputs.seen.iter().zip(&changed.seen) {
            let dwells = own.dwells.iter().zip(&other.dwells);
            if dwells.clone().all(|(a, b)| a.joint_rad == b.joint_rad) {
                continue;
            }
            let (from_m, to_m): (Vec<_>, Vec<_>) = dwells.map(|(a, b)| (at_m(a), at_m(b))).unzip();
            let Some(motion) = fit_rigid_motion(&from_m, &to_m) else { continue };
            let pairs = from_m.iter().zip(&to_m);
            sum_m2 += pairs
                .map(|(a, b)| (motion * Point3::from(*a) - Point3::from(*b)).norm_squared())
                .sum::<f64>();
        }
        (sum_m2 / self.inputs.dwells().count().max(1) as f64).sqrt()
    }
}
