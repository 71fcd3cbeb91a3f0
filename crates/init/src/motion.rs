//! Does a body move when the joints do? Speeds of both, compared over the delay that their clocks leave open.

use nalgebra::Vector3;
use std::collections::BTreeMap;

/// Length of a bin [ns]: long against the noise of a camera, short against a motion.
const BIN_NS: i64 = 100_000_000;
/// Delays that are tried, in bins: those in which a pipeline searches by itself, then those of clocks that nobody set.
const DELAYS: i64 = 20;
const FAR_DELAYS: i64 = 1200;
/// Likeness that needs no further search, and the one that a far delay must have: of so many, one is alike by chance.
const ALIKE: f64 = 0.5;
const SURELY_ALIKE: f64 = 0.8;
/// Common bins below which a correlation says nothing.
const FEWEST: usize = 50;

/// Speed in every bin that has a successor, with the number of the bin, in the order of time.
pub struct Speeds(Vec<(i64, f64)>);

impl Speeds {
    /// Of points in time.
    pub fn of(time_ns: &[i64], point_m: impl Fn(usize) -> Vector3<f64>) -> Speeds {
        let mut bins: BTreeMap<i64, (Vector3<f64>, f64)> = BTreeMap::new();
        for (i, time_ns) in time_ns.iter().enumerate() {
            let (sum, count) = bins.entry(time_ns.div_euclid(BIN_NS)).or_insert((Vector3::zeros(), 0.0));
            (*sum, *count) = (*sum + point_m(i), *count + 1.0);
        }
        let mean = |(sum, count): &(Vector3<f64>, f64)| sum / *count;
        let speed =
            |(bin, own): (&i64, _)| Some((*bin, (mean(bins.get(&(bin + 1))?) - mean(own)).norm() / 0.1));
        Speeds(bins.iter().filter_map(speed).collect())
    }
}

/// How many times as fast the body moves as the arm, where it is as late as that.
pub fn speed_ratio(arm: &Speeds, body: &Speeds, delay_s: f64) -> f64 {
    let delay = (delay_s * 1e9 / BIN_NS as f64).round() as i64;
    let sums = common_bins(&arm.0, &body.0, delay).fold((0.0, 0.0), |(a, b), (x, y)| (a + x, b + y));
    sums.1 / sums.0
}

/// How alike two speeds are, and by how much the second is late [s]: the largest correlation over all delays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Likeness {
    /// Pearson's correlation.
    pub correlation: f64,
    /// Sensor minus robot [s].
    pub delay_s: f64,
}

/// Compares the speeds of the arm with those of a body; none where they were not seen moving together.
pub fn compare_speeds(arm: &Speeds, body: &Speeds) -> Option<Likeness> {
    let at = |delay: i64| {
        let correlation = pearson(common_bins(&arm.0, &body.0, delay))?;
        Some(Likeness { correlation, delay_s: delay as f64 * BIN_NS as f64 * 1e-9 })
    };
    // Of equals the shortest delay.
    let best = |delays: i64| {
        let all = (0..=delays).flat_map(|delay| [delay, -delay]).filter_map(at);
        all.reduce(|best, next| if next.correlation > best.correlation { next } else { best })
    };
    let near = best(DELAYS);
    if near.is_some_and(|l| l.correlation > ALIKE) {
        return near;
    }
    best(FAR_DELAYS).filter(|l| l.correlation > SURELY_ALIKE).or(near)
}

/// Speeds in the bins that both have, the second late by so many.
fn common_bins<'a>(
    a: &'a [(i64, f64)],
    b: &'a [(i64, f64)],
    delay: i64,
) -> impl Iterator<Item = (f64, f64)> + 'a {
    let mut next = 0;
    a.iter().filter_map(move |(bin, speed)| {
        while b.get(next).is_some_and(|(other, _)| *other < bin + delay) {
            next += 1;
        }
        b.get(next).filter(|(other, _)| *other == bin + delay).map(|(_, other)| (*speed, *other))
    })
}

fn pearson(pairs: impl Iterator<Item = (f64, f64)>) -> Option<f64> {
    let (mut n, mut x, mut y, mut xx, mut yy, mut xy) = (0usize, 0.0, 0.0, 0.0, 0.0, 0.0);
    for (a, b) in pairs {
        n += 1;
        x += a;
        y += b;
        xx += a * a;
        yy += b * b;
        xy += a * b;
    }
    let count = n as f64;
    let [vx, vy] = [xx - x * x / count, yy - y * y / count];
    (n >= FEWEST && vx > 0.0 && vy > 0.0).then(|| (xy - x * y / count) / (vx * vy).sqrt())
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may stop")]
mod tests {
    use super::*;

    #[test]
    fn a_late_copy_is_alike_and_as_late_as_it_is() {
        let times: Vec<i64> = (0..6000).map(|i| i * 10_000_000).collect();
        // Ever faster, so that no stretch of it is like another.
        let path =
            |t: f64| Vector3::new((0.3 * t + 0.01 * t * t).sin(), (0.11 * t).cos(), 0.2 * (0.7 * t).sin());
        let arm = Speeds::of(&times, |i| path(times[i] as f64 * 1e-9));
        for delay_s in [0.0, 0.6, -1.3, 41.7] {
            let body = Speeds::of(&times, |i| path(times[i] as f64 * 1e-9 - delay_s));
            let found = compare_speeds(&arm, &body).unwrap();
            assert!(
                found.correlation > 0.99 && (found.delay_s - delay_s).abs() < 0.05,
                "{delay_s}: {found:?}"
            );
        }
        let other = Speeds::of(&times, |i| path(7.0 + 1.37 * times[i] as f64 * 1e-9));
        assert!(compare_speeds(&arm, &other).unwrap().correlation < 0.6);
        // What stands still correlates with nothing, and two seconds are too little.
        assert!(compare_speeds(&arm, &Speeds::of(&times, |_| Vector3::zeros())).is_none());
        let short = Speeds::of(&times[..200], |i| path(times[i] as f64 * 1e-9));
        assert!(compare_speeds(&arm, &short).is_none());
    }
}
