//! An arm that gives way while it rests: its readings creep, slowly, one way, and never faster than before.
//!
//! A compliant arm whose tip rests in a cavity does so, and one whose controller relaxes. Whoever moves an arm from one
//! pose to the next speeds up first, and a joint that hunts goes to and fro.

use armcal_core::robust::median;
use std::ops::Range;

use crate::series::seconds_between;

/// Pieces a rest is divided into to see how it moves.
const PIECES: usize = 6;
/// A piece may be faster than the ones before by this factor.
const FASTER: f64 = 1.5;
/// Share of the whole way that the joint may go back.
const BACK: f64 = 0.2;

/// How far each joint creeps over these rows [rad]; none where one moves otherwise, or further than `most_rad`, or none
/// moves beyond the tolerance.
pub(crate) fn joint_creep_rad(
    time_ns: &[i64],
    joint_rad: &[Vec<f64>],
    rows: &Range<usize>,
    tolerance_rad: &[f64],
    most_rad: f64,
) -> Option<Vec<f64>> {
    if rows.len() < 3 * PIECES {
        return None;
    }
    let cut = |k: usize| rows.start + k * rows.len() / PIECES;
    let pieces: Vec<Range<usize>> = (0..PIECES).map(|k| cut(k)..cut(k + 1)).collect();
    let since_s = |row: usize| seconds_between(time_ns[rows.start], time_ns[row]);
    let mid_s: Vec<f64> = pieces.iter().map(|p| 0.5 * (since_s(p.start) + since_s(p.end - 1))).collect();
    let one = |(column, tolerance): (&Vec<f64>, &f64)| {
        let at: Vec<f64> = pieces.iter().map(|p| median(&column[p.clone()])).collect();
        let steps: Vec<f64> = at.windows(2).map(|w| w[1] - w[0]).collect();
        let whole: f64 = steps.iter().sum();
        let back: f64 = steps.iter().map(|s| (-s * whole.signum()).max(0.0)).sum();
        let speed = |k: usize| (steps[k] * whole.signum() - tolerance).max(0.0) / (mid_s[k + 1] - mid_s[k]);
        let usual = |k: usize| (steps[k] * whole.signum() + tolerance).max(0.0) / (mid_s[k + 1] - mid_s[k]);
        let speeds_up = (1..steps.len()).any(|k| (0..k).any(|before| speed(k) > FASTER * usual(before)));
        let steady = back <= tolerance.max(BACK * whole.abs()) && !speeds_up;
        // Two ends of the straight pieces lie outside of their middles.
        let crept = whole * PIECES as f64 / (PIECES - 1) as f64;
        (steady && crept.abs() <= most_rad).then_some(crept)
    };
    let crept: Vec<f64> = joint_rad.iter().zip(tolerance_rad).map(one).collect::<Option<_>>()?;
    let moves = crept.iter().zip(tolerance_rad).any(|(crept, tolerance)| crept.abs() > 2.0 * tolerance);
    moves.then_some(crept)
}

/// The half of a rest in which it has settled most: the last, at least `least_s` long.
pub(crate) fn end_of(time_ns: &[i64], rows: &Range<usize>, least_s: f64) -> Range<usize> {
    let last_ns = time_ns[rows.end - 1];
    let whole_s = seconds_between(time_ns[rows.start], last_ns);
    let kept_s = (0.5 * whole_s).max(least_s + 1e-9);
    let first =
        rows.clone().rev().take_while(|row| seconds_between(time_ns[*row], last_ns) <= kept_s + 1e-9).last();
    // One row more, so that what is kept is no shorter than asked for.
    first.map_or(rows.clone(), |first| first.saturating_sub(1).max(rows.start)..rows.end)
}

/// A straight line through values over time.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Line {
    /// Per second.
    pub slope: f64,
    /// Time of the mean since the first value [s].
    pub middle_s: f64,
    /// Time from the first value to the last [s].
    pub span_s: f64,
    /// Sum of the squared times from the middle [s^2].
    pub square_s2: f64,
}

/// None for fewer than five values, or without time between them.
pub(crate) fn fit_line(time_ns: &[i64], values: &[f64]) -> Option<Line> {
    if values.len() < 5 {
        return None;
    }
    let since = |t: &i64| seconds_between(time_ns[0], *t);
    let span_s = since(&time_ns[time_ns.len() - 1]);
    let middle_s = time_ns.iter().map(since).sum::<f64>() / values.len() as f64;
    let square_s2: f64 = time_ns.iter().map(|t| (since(t) - middle_s).powi(2)).sum();
    let product = |(t, v): (&i64, &f64)| (since(t) - middle_s) * (v - values[0]);
    let slope = time_ns.iter().zip(values).map(product).sum::<f64>() / square_s2;
    slope.is_finite().then_some(Line { slope, middle_s, span_s, square_s2 })
}

/// Values without the line that they creep along, and how far that goes from the first to the last.
pub(crate) fn subtract_line(time_ns: &[i64], values: &[f64]) -> Option<(Vec<f64>, f64)> {
    let line = fit_line(time_ns, values)?;
    let left = |(t, v): (&i64, &f64)| v - line.slope * (seconds_between(time_ns[0], *t) - line.middle_s);
    Some((time_ns.iter().zip(values).map(left).collect(), line.slope * line.span_s))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testkit::{Random, ns};

    fn times(rows: usize) -> Vec<i64> {
        (0..rows).map(|i| ns(i as f64 * 0.01)).collect()
    }

    fn crept(path: impl Fn(f64) -> f64) -> Option<f64> {
        let mut r = Random::new(3);
        let column: Vec<f64> = (0..200).map(|i| path(f64::from(i) * 0.01) + 2e-5 * r.normal()).collect();
        joint_creep_rad(&times(200), &[column], &(0..200), &[9e-5], 6e-3).map(|c| c[0])
    }

    #[test]
    fn giving_way_is_creep_and_moving_on_is_not() {
        let settles = crept(|t| 4e-3 * (-t / 0.8).exp()).expect("settles");
        assert!((-4.2e-3..-3.0e-3).contains(&settles), "{settles}");
        let steady = crept(|t| 1e-3 * t).expect("steady");
        assert!((steady - 2e-3).abs() < 2e-4, "{steady}");
        assert_eq!(crept(|_| 0.0), None);
        // From one pose to the next, to and fro, and too far.
        assert_eq!(crept(|t| 1e-3 / (1.0 + (-(t - 1.0) * 8.0).exp())), None);
        assert_eq!(crept(|t| 1e-3 * (4.0 * t).sin()), None);
        assert_eq!(crept(|t| 5e-3 * t), None);
    }

    #[test]
    fn the_end_of_a_rest_is_its_half_or_long_enough() {
        let time_ns = times(201);
        let kept = end_of(&time_ns, &(0..201), 0.4);
        assert!((99..=101).contains(&kept.start) && kept.end == 201, "{kept:?}");
        let short = end_of(&time_ns, &(100..150), 0.4);
        assert!(seconds_between(time_ns[short.start], time_ns[short.end - 1]) >= 0.4, "{short:?}");
    }
}
