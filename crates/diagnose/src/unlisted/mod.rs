//! What to say about structure no listed effect explains: where, on what, what shape, and a formula to paste.

pub(crate) mod curves;
pub(crate) mod expression;

use crate::config::DiagnosisConfig;
use crate::diagnosis::ripple::{Peak, beside_slow, peak};
use crate::diagnosis::{Series, ShapePoint, UnknownReport};
use crate::enters::DependsOn;
use crate::judge::conditioned_problems::ConditionedProblem;
use crate::judge::score::bootstrap_weights;
use crate::problem::{Channel, Problem};
use crate::unlisted::expression::{fit_expression, to_digits};
use crate::weigh::Outside;
use crate::weigh::cells::Unlisted;
use crate::weigh::drivers::{Driver, range};
use crate::weigh::evidence::{best_amplitude, posterior_coefficients};
use armcal_core::Unit;
use nalgebra::{DMatrix, DVector};
use std::f64::consts::PI;

/// Angles in a half wave of the last harmonic, and between how many harmonics a curve is offered.
const A_HALF_WAVE: f64 = 4.0;
const FEWEST_HARMONICS: f64 = 16.0;
const MOST_HARMONICS: f64 = 60.0;
/// Points of a shape: at least, and for each function of its basis, so that the quickest wave is drawn as one.
const FEWEST_POINTS: usize = 41;
const POINTS_A_FUNCTION: usize = 4;

/// Describes the best unlisted explanation of a weighed problem.
pub(crate) fn unknown_report(
    conditioned: &ConditionedProblem,
    config: &DiagnosisConfig,
) -> Option<UnknownReport> {
    let weighed = &conditioned.weighed;
    // A discrepancy that beats every cell knows the driver better than any cell; a cell also knows where.
    describe_unlisted(conditioned, weighed.best_cell().or_else(|| weighed.best_unlisted())?, config)
}

/// Describes one unlisted explanation.
pub(crate) fn describe_unlisted(
    conditioned: &ConditionedProblem,
    outside: &Outside,
    config: &DiagnosisConfig,
) -> Option<UnknownReport> {
    let ConditionedProblem { problem, weighed, .. } = conditioned;
    let (best, ln) = (&outside.what, outside.ln_evidence);
    let gram = weighed.base.gram(&weighed.dense(&best.columns, problem));
    let a = best_amplitude(&gram, &weighed.base, config);
    let (theta, covariance) = posterior_coefficients(&gram, a);
    let drop = theta.dot(&gram.g);
    let variance = weighed.base.variance_without(drop);
    let effect = weighed.regularised(&best.columns, problem, config);
    let places = weighed.gain(problem, &effect, &conditioned.exam().folds, config);
    let score = conditioned.score_with(&effect);
    let listed = conditioned.leading_entries(config).into_iter().next();
    let costs = conditioned.costs(config);
    let mut all = vec![(&score, costs.of_unlisted()), (conditioned.nothing(), costs.of_nothing())];
    all.extend(listed.iter().map(|(k, score)| (score, costs.of_entry(*k))));
    let channel = best.channel.and_then(|c| problem.channels.get(c));
    let driver = best.driver.and_then(|d| weighed.dependences.drivers.get(d));
    let (mut shape, mut strongest, mut series) = (Vec::new(), None, None);
    if let (Some(channel), Some(driver)) = (channel, driver) {
        let axis = strongest_axis(&gram.a, &theta, channel.columns.ncols());
        shape = shape_points(problem, best, driver, axis, &theta, &(covariance * variance));
        if best.enters.own_angle(best.depends).is_some() {
            let per = driver.basis.ncols();
            let curve = best.unit_si * (driver.basis.as_ref() * theta.rows(axis * per, per));
            strongest = peak(&driver.value, curve.as_slice(), per);
            let typical_rad = to_digits(beside_slow(&driver.value, curve.as_slice()), 2);
            series = Some(Series { harmonics: resolved_harmonics(&driver.value), typical_rad });
        }
    }
    // A formula acts on one thing: where the best cell has no such thing, the best one that has.
    let formulable = |u: &&Outside| {
        u.what.channel.and_then(|c| problem.channels.get(c)).is_some_and(|c| !c.axes.is_empty())
            && u.what.depends != DependsOn::Recording
    };
    let best_formulable = || {
        let all = weighed.unlisted.iter().filter(formulable);
        all.max_by(|a, b| a.ln_evidence.total_cmp(&b.ln_evidence))
    };
    let pasted = Some(outside).filter(formulable).or_else(best_formulable);
    let formula = pasted.and_then(|u| {
        let (channel, driver) =
            (&problem.channels[u.what.channel?], &weighed.dependences.drivers[u.what.driver?]);
        let gram = weighed.base.gram(&weighed.dense(&u.what.columns, problem));
        let (theta, _) = posterior_coefficients(&gram, a);
        let axis = strongest_axis(&gram.a, &theta, channel.columns.ncols());
        let mut e = fit_expression(problem, weighed, channel, axis, driver, config)?;
        e.share_of_shape = if drop > 0.0 { (e.share_of_shape / drop).clamp(0.0, 1.0) } else { 0.0 };
        Some(e)
    });
    let mut rivals: Vec<&Outside> = weighed
        .unlisted
        .iter()
        .filter(|u| u.ln_evidence > ln - config.margin_nats && u.what.name() != best.name())
        .collect();
    rivals.sort_by(|a, b| b.ln_evidence.total_cmp(&a.ln_evidence));
    Some(UnknownReport {
        channel: best.enters.clone(),
        driver: best.depends,
        probability: bootstrap_weights(&all, config)[0],
        gain_nats: score.above(conditioned.nothing()).nats,
        unit: channel.map_or(Unit::Metre, |c: &Channel| c.unit),
        shape,
        ripple: strongest.filter(Peak::is_alone).map(|p| p.ripple),
        peak: strongest,
        series,
        expression: formula,
        places,
        rivals: rivals.into_iter().map(|u| u.what.name()).collect(),
    })
}

/// Harmonics of a turn that these angles resolve: a half wave of the last one holds [`A_HALF_WAVE`] of them, at their usual
/// distance.
fn resolved_harmonics(angles_rad: &[f64]) -> u32 {
    let mut sorted = angles_rad.to_vec();
    sorted.sort_by(f64::total_cmp);
    let mut gaps: Vec<f64> = sorted.windows(2).map(|w| w[1] - w[0]).filter(|gap| *gap > 0.0).collect();
    gaps.sort_by(f64::total_cmp);
    let usual_rad = gaps.get(gaps.len() / 2).copied().unwrap_or(PI);
    (PI / (A_HALF_WAVE * usual_rad)).round().clamp(FEWEST_HARMONICS, MOST_HARMONICS) as u32
}

/// The axis whose fitted part moves the residual most.
fn strongest_axis(a: &DMatrix<f64>, theta: &DVector<f64>, axes: usize) -> usize {
    let per = theta.len() / axes.max(1);
    let power = |axis: usize| {
        let part = theta.rows(axis * per, per);
        (part.transpose() * a.view((axis * per, axis * per), (per, per)) * part)[(0, 0)]
    };
    (0..axes).max_by(|x, y| power(*x).total_cmp(&power(*y))).unwrap_or(0)
}

/// Posterior mean and band of one axis along the driver.
fn shape_points(
    problem: &Problem,
    best: &Unlisted,
    driver: &Driver,
    axis: usize,
    theta: &DVector<f64>,
    covariance: &DMatrix<f64>,
) -> Vec<ShapePoint> {
    let per = driver.basis.ncols();
    let own = theta.rows(axis * per, per);
    let spread = covariance.view((axis * per, axis * per), (per, per));
    let at = |at: f64, basis: DVector<f64>| ShapePoint {
        at,
        value: best.unit_si * basis.dot(&own),
        sigma: best.unit_si * (basis.transpose() * spread * &basis)[(0, 0)].max(0.0).sqrt(),
    };
    let (low, high) = range(&driver.value);
    match (&driver.kernel, driver.what) {
        (Some(kernel), _) => {
            let points = FEWEST_POINTS.max(POINTS_A_FUNCTION * per + 1);
            let x = |k: usize| low + (high - low) * k as f64 / (points - 1) as f64;
            (0..points).map(|k| at(x(k), kernel.at(x(k)))).collect()
        }
        (None, DependsOn::Recording) => {
            let mut first: Vec<(usize, usize)> = Vec::new();
            for (i, d) in problem.dwells.iter().enumerate() {
                if first.iter().all(|f| f.0 != d.id.recording) {
                    first.push((d.id.recording, i));
                }
            }
            first.sort_unstable();
            first.into_iter().map(|(r, i)| at(r as f64, driver.basis.row(i).transpose())).collect()
        }
        // At the mean pose only the switched value itself is left.
        (None, _) => [low, high]
            .into_iter()
            .map(|v| {
                let dwell = (0..driver.value.len()).find(|i| driver.value[*i] == v).unwrap_or(0);
                let mut basis = DVector::zeros(per);
                basis[0] = driver.basis[(dwell, 0)];
                at(v, basis)
            })
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::resolved_harmonics;

    #[test]
    fn more_poses_resolve_more_of_a_curve() {
        let evenly = |n: usize, deg: f64| -> Vec<f64> {
            (0..=n).map(|k| (deg * k as f64 / n as f64).to_radians()).collect()
        };
        // 1.5 deg apart: a half wave of four is 6 deg, 30 of which make half a turn.
        assert_eq!(resolved_harmonics(&evenly(60, 90.0)), 30);
        assert_eq!(resolved_harmonics(&evenly(1000, 90.0)), 60);
        assert_eq!(resolved_harmonics(&evenly(5, 90.0)), 16);
        assert_eq!(resolved_harmonics(&[0.4; 7]), 16, "it never turned");
    }
}
