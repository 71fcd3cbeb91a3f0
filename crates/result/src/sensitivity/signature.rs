//! An effect by itself: what the fitted model says it does, and what the measurements say without it.
//!
//! ```text
//! d = r(effect at zero) - r(all),   y = sensitivity . (r + d),   line = sensitivity . d
//! ```
//!
//! with everything else as fitted beside the effect (a component-plus-residual plot: Cook, Technometrics 35, 1993). Geometry
//! that took the effect over in the fit without it gives it back here, so its whole shape is seen.

use super::bands::{Band, bands_over};
use super::basis::Basis;
use crate::column::Column;
use crate::run::{Refit, Run};
use armcal_diagnose::DependsOn;
use armcal_model::{Family, PlacedEffect};
use nalgebra::Vector3;
use serde::Serialize;

/// The joint that an effect names is preferred unless another channel shows this much more of it.
const PREFERENCE: f64 = 0.1;
/// Bins in which a driver is judged.
const BINS: usize = 12;
/// A driver earlier in the list is kept while it leaves at most this much more of the variance than the best.
const TIE: f64 = 0.005;

/// One effect as seen from the channel and over the driver that show it best.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Signature {
    /// The effect.
    pub effect: String,
    /// One line of the catalogue about it.
    pub summary: &'static str,
    /// Index of the channel.
    pub channel: usize,
    /// Key of the driver.
    pub driver: DependsOn,
    /// Share of the effect that the channel shows, squared, 0 to 1.
    pub share: f64,
    /// What the effect does in each dwell, in the channel's unit.
    pub effect_is: Column,
    /// What is measured there without it.
    pub measured: Column,
    /// Means of what is measured, along the driver.
    pub bands: Vec<Band>,
}

/// The signatures of all effects of a refitted model that move the tip.
pub fn signatures(run: &Run, basis: &Basis, refit: &Refit) -> Vec<Signature> {
    refit.model.effects().iter().filter_map(|effect| effect_signature(run, basis, refit, effect)).collect()
}

fn effect_signature(run: &Run, basis: &Basis, refit: &Refit, effect: &PlacedEffect) -> Option<Signature> {
    let with = refit.calibration.fit.values();
    let mut without = with.clone();
    let start = effect.parameters.start;
    without[start..start + effect.amplitudes].fill(0.0);
    let difference_m: Vec<Vector3<f64>> = run
        .observations
        .iter()
        .map(|o| refit.model.residual(&without, o).position_m - refit.model.residual(&with, o).position_m)
        .collect();
    let moved = difference_m.iter().map(|d| d.norm_squared()).sum::<f64>();
    // Not a number where a formula of the user has no value at zero.
    if !moved.is_finite() || moved == 0.0 {
        return None;
    }
    // Any channel alone stands for what is off along one direction: there the shares say nothing of them.
    let scalars = run.observations.iter().filter(|o| o.is_scalar()).count();
    let preference = if 2 * scalars > run.observations.len() { 1.0 } else { PREFERENCE };
    let (channel, share) = best_channel(basis, &difference_m, (effect.spec.target, preference))?;
    let effect_is = basis.sensitivity.implied(channel, &difference_m);
    let driver = match effect.spec.since {
        // What else changed at that moment, the temperature for one, is no cause of an event.
        Some(_) => basis.driver(DependsOn::Time),
        None => best_driver(basis, channel, effect.kind.family, &effect_is),
    }?;
    let residuals = refit.calibration.residuals.iter().zip(&difference_m);
    let partial_m: Vec<Vector3<f64>> = residuals.map(|(r, d)| r.fitted_m + d).collect();
    let measured = basis.sensitivity.implied(channel, &partial_m);
    let key = basis.drivers[driver].key;
    Some(Signature {
        effect: effect.spec.to_string(),
        summary: effect_summary(run, effect),
        channel,
        driver: key,
        share,
        bands: bands_over(basis, channel, key, &measured),
        measured: Column::of(measured),
        effect_is: Column::of(effect_is),
    })
}

/// One line about an effect; a formula that a user did not write is one that the diagnosis proposes.
fn effect_summary(run: &Run, effect: &PlacedEffect) -> &'static str {
    let own = run.model.effects().iter().any(|e| e.spec == effect.spec);
    match effect.kind.family {
        Family::User if !own => "a formula with the shape of what no listed effect explains",
        _ => effect.kind.summary,
    }
}

/// The channel that alone stands for most of the displacements; the effect's own joint where that is as good but for so much.
fn best_channel(
    basis: &Basis,
    difference_m: &[Vector3<f64>],
    (target, preference): (Option<usize>, f64),
) -> Option<(usize, f64)> {
    let shares: Vec<f64> =
        (0..basis.sensitivity.channels.len()).map(|c| basis.sensitivity.share(c, difference_m)).collect();
    let best = (0..shares.len()).max_by(|a, b| shares[*a].total_cmp(&shares[*b]))?;
    let chosen = target.filter(|own| shares[*own] > shares[best] - preference).unwrap_or(best);
    Some((chosen, shares[chosen]))
}

/// The driver over which the effect scatters least within a bin and a direction of arrival; what gives way is looked at over
/// torque first.
fn best_driver(basis: &Basis, channel: usize, family: Family, effect: &[Option<f64>]) -> Option<usize> {
    let joint = basis.sensitivity.channels[channel].joint;
    let mut own = joint.map_or(Vec::new(), |j| vec![DependsOn::Angle(j), DependsOn::Torque(j)]);
    if family == Family::Elasticity {
        own.reverse();
    }
    let first = own.into_iter().chain([DependsOn::Temperature, DependsOn::Time]);
    let mut order: Vec<usize> = first.filter_map(|key| basis.driver(key)).collect();
    order.extend((0..basis.drivers.len()).filter(|d| !order.contains(d)).collect::<Vec<_>>());
    let left: Vec<f64> = order.iter().map(|d| residual_variance_ratio(basis, joint, *d, effect)).collect();
    let best = left.iter().copied().fold(f64::INFINITY, f64::min);
    order.into_iter().zip(left).find(|(_, left)| *left <= best + TIE).map(|(driver, _)| driver)
}

/// Share of the effect's variance that straight pieces over a driver leave, each direction by itself.
fn residual_variance_ratio(
    basis: &Basis,
    joint: Option<usize>,
    driver: usize,
    effect: &[Option<f64>],
) -> f64 {
    let x = &basis.drivers[driver].values.0;
    let direction = |i: usize| joint.map_or(0, |j| basis.arrival[j][i]);
    let points: Vec<(i8, f64, f64)> =
        (0..effect.len()).filter_map(|i| Some((direction(i), x[i]?, effect[i]?))).collect();
    let mut left = 0.0;
    for direction in [1, -1, 0] {
        let mut own: Vec<(f64, f64)> =
            points.iter().filter(|p| p.0 == direction).map(|p| (p.1, p.2)).collect();
        own.sort_by(|a, b| a.0.total_cmp(&b.0));
        left += own.chunks(own.len().div_ceil(BINS).max(1)).map(about_line).sum::<f64>();
    }
    let mean = points.iter().map(|p| p.2).sum::<f64>() / points.len().max(1) as f64;
    left / points.iter().map(|p| (p.2 - mean).powi(2)).sum::<f64>()
}

/// Sum of squares about the straight line through points.
fn about_line(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let (x0, y0) = points.iter().fold((0.0, 0.0), |m, p| (m.0 + p.0 / n, m.1 + p.1 / n));
    let sum = |of: &dyn Fn(f64, f64) -> f64| points.iter().map(|p| of(p.0 - x0, p.1 - y0)).sum::<f64>();
    let (xx, xy, yy) = (sum(&|x, _| x * x), sum(&|x, y| x * y), sum(&|_, y| y * y));
    if xx > 0.0 { (yy - xy * xy / xx).max(0.0) } else { yy }
}
