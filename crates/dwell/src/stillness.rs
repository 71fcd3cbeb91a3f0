//! Where a stream stands still: the spread of each reading in a short window, against the noise at rest.
//!
//! A window as long as a period of hand tremor sees slow motion, fast motion and tremor alike; a speed
//! averaged over the same window would not see the tremor.

use armcal_core::robust::{MAD_TO_SIGMA, median, percentile, percentile_in};
use rayon::prelude::*;
use std::ops::Range;

use crate::series::seconds_between;

/// More readings than these in a window are thinned.
const MAX_IN_WINDOW: usize = 48;

/// Rows per block in which high-frequency noise is measured.
const BLOCK: usize = 16;

/// A still joint may spread by this much more than its high-frequency noise explains (correlated noise).
const CORRELATED_NOISE: f64 = 4.0;

/// One channel (a joint, or one axis of the tip) with what it does at rest.
pub(crate) struct Channel {
    /// Standard deviation within the window around each row; infinite where there are too few rows.
    pub spread: Vec<f64>,
    /// The same at rest.
    pub noise: f64,
}

impl Channel {
    /// Measures spread and noise of one column within its unbroken stretches.
    ///
    /// The noise at rest is the low mode of the spreads themselves, so it is right for correlated noise too;
    /// but never more than [`CORRELATED_NOISE`] times what second differences show, so that a recording in
    /// which the arm never rests does not pass its slowest motion off as noise.
    pub(crate) fn of(
        time_ns: &[i64],
        column: &[f64],
        stretches: &[Range<usize>],
        window_s: f64,
        floor: f64,
    ) -> Channel {
        let mut spread = vec![f64::INFINITY; column.len()];
        for stretch in stretches {
            spread_within(time_ns, column, stretch.clone(), window_s, &mut spread);
        }
        let at_rest = low_mode(&spread, floor);
        let fast = high_frequency_noise(column, stretches);
        let noise = at_rest.max(fast).min((CORRELATED_NOISE * fast).max(floor));
        Channel { spread, noise: if noise.is_finite() { noise } else { floor } }
    }
}

/// [`Channel::of`] for every column, in order, in parallel.
pub(crate) fn channels_of_columns(
    time_ns: &[i64],
    columns: &[Vec<f64>],
    stretches: &[Range<usize>],
    window_s: f64,
    floors: &[f64],
) -> Vec<Channel> {
    let pairs = columns.par_iter().zip(floors);
    pairs.map(|(column, &floor)| Channel::of(time_ns, column, stretches, window_s, floor)).collect()
}

/// Runs of rows between falling to `enter` or below and rising above `leave`.
pub(crate) fn hysteresis(level: &[f64], stretch: Range<usize>, enter: f64, leave: f64) -> Vec<Range<usize>> {
    let mut runs = Vec::new();
    let mut start = None;
    for i in stretch.clone() {
        match start {
            None if level[i] <= enter => start = Some(i),
            Some(s) if level[i] > leave => {
                runs.push(s..i);
                start = None;
            }
            _ => {}
        }
    }
    if let Some(s) = start {
        runs.push(s..stretch.end);
    }
    runs
}

/// The middle of the lowest population of the values: the median of those within three times the first
/// decile (or within `floor`, for a quantised column that does not change at all at rest).
fn low_mode(values: &[f64], floor: f64) -> f64 {
    let limit = (3.0 * percentile(values, 0.1)).max(floor);
    let low: Vec<f64> = values.iter().copied().filter(|v| *v <= limit).collect();
    median(&low)
}

/// White noise of a column from its second differences, blind to motion at constant speed.
fn high_frequency_noise(column: &[f64], stretches: &[Range<usize>]) -> f64 {
    let blocks: Vec<f64> = stretches
        .iter()
        .flat_map(|s| column[s.clone()].chunks(BLOCK))
        .filter(|block| block.len() >= 5)
        .map(|block| {
            let mut second = [f64::NAN; BLOCK];
            let found = block.windows(3).map(|w| (w[2] - 2.0 * w[1] + w[0]).abs());
            second.iter_mut().zip(found).for_each(|(second, found)| *second = found);
            // The variance of q[i+1] - 2 q[i] + q[i-1] is six times that of q.
            MAD_TO_SIGMA * percentile_in(&mut second[..block.len() - 2], 0.5) / 6f64.sqrt()
        })
        .collect();
    low_mode(&blocks, 0.0)
}

fn spread_within(time_ns: &[i64], column: &[f64], stretch: Range<usize>, window_s: f64, out: &mut [f64]) {
    let (mut first, mut end) = (stretch.start, stretch.start);
    for i in stretch.clone() {
        while seconds_between(time_ns[first], time_ns[i]) > 0.5 * window_s {
            first += 1;
        }
        end = end.max(i + 1);
        while end < stretch.end && seconds_between(time_ns[i], time_ns[end]) <= 0.5 * window_s {
            end += 1;
        }
        out[i] = standard_deviation(&column[first..end]);
    }
}

fn standard_deviation(window: &[f64]) -> f64 {
    let every = window.len().div_ceil(MAX_IN_WINDOW).max(1);
    let used = || window.iter().step_by(every);
    let n = window.len().div_ceil(every);
    if n < 3 {
        return f64::INFINITY;
    }
    let mean = used().sum::<f64>() / n as f64;
    let deviation = (used().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1) as f64).sqrt();
    if deviation.is_finite() { deviation } else { f64::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testkit::{Random, ns};

    fn channel(column: &[f64]) -> Channel {
        let time_ns: Vec<i64> = (0..column.len()).map(|i| ns(i as f64 * 0.01)).collect();
        Channel::of(&time_ns, column, std::slice::from_ref(&(0..column.len())), 0.12, 1e-6)
    }

    #[test]
    fn noise_at_rest_is_found_below_motion() {
        // Three tenths of the time at rest, the rest a swing: the noise is that of the rest.
        let mut r = Random::new(5);
        let column: Vec<f64> = (0..3000)
            .map(|i| if i % 1000 < 300 { 0.0 } else { (f64::from(i) * 0.02).sin() } + 2e-5 * r.normal())
            .collect();
        let c = channel(&column);
        assert!((1.4e-5..3e-5).contains(&c.noise), "{}", c.noise);
        assert!(c.spread[150] < 6e-5 && c.spread[600] > 1e-3);
    }

    #[test]
    fn slow_motion_without_rest_is_not_noise() {
        let mut r = Random::new(6);
        let column: Vec<f64> = (0..3000).map(|i| f64::from(i) * 0.01 * 0.1 + 2e-5 * r.normal()).collect();
        let c = channel(&column);
        assert!(c.noise < 1.2e-4, "{}", c.noise);
        assert!(c.spread.iter().all(|s| *s > 5.0 * c.noise));
    }

    #[test]
    fn tremor_is_not_still_although_its_mean_is() {
        let column: Vec<f64> =
            (0..400).map(|i| 3e-4 * (f64::from(i) * 0.01 * 10.0 * std::f64::consts::TAU).sin()).collect();
        let c = channel(&column);
        assert!(c.spread[200] > 1.5e-4);
    }

    #[test]
    fn hysteresis_bridges_what_stays_below_the_upper_threshold() {
        let level = [9.0, 0.5, 1.5, 0.8, 1.9, 2.5, 0.9, 0.1];
        assert_eq!(hysteresis(&level, 0..8, 1.0, 2.0), vec![1..5, 6..8]);
    }
}
