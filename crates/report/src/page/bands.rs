//! The mean of an implied error along a driver, with its interval: the line the eye follows through the points.

use super::basis::Basis;
use super::numbers::Column;
use armcal_calibrate::grouped_ci95;
use serde::Serialize;

/// Points a bin holds at least.
const POINTS: usize = 6;
/// Bins at most.
const BINS: usize = 10;

/// Bin means of one channel over one driver for one direction of arrival.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Band {
    /// Index of the channel.
    pub channel: usize,
    /// Key of the driver.
    pub driver: String,
    /// 1, -1 or 0 (not known) for a joint, `null` where directions do not matter.
    pub direction: Option<i8>,
    /// Mean driver of each bin.
    pub x: Column,
    /// Mean implied error of each bin.
    pub mean: Column,
    /// Half of the 95 % interval of that mean, dwells taken as independent.
    pub half: Column,
}

/// Which drivers are drawn for a channel.
pub(crate) fn drivers_of(basis: &Basis, channel: usize) -> Vec<String> {
    let keys: Vec<String> = match basis.levers.channels[channel].joint {
        Some(j) => vec![format!("q{}", j + 1), format!("tau{}", j + 1), "time".into()],
        None => ["time", "temperature", "load"].map(str::to_owned).to_vec(),
    };
    keys.into_iter().filter(|key| basis.driver(key).is_some()).collect()
}

/// All bands of one channel's implied errors.
pub(crate) fn bands(basis: &Basis, channel: usize, implied: &[Option<f64>]) -> Vec<Band> {
    let keys = drivers_of(basis, channel);
    keys.iter().flat_map(|key| bands_over(basis, channel, key, implied)).collect()
}

/// The bands over one driver.
pub(crate) fn bands_over(basis: &Basis, channel: usize, key: &str, implied: &[Option<f64>]) -> Vec<Band> {
    let Some(driver) = basis.driver(key) else { return Vec::new() };
    let joint = basis.levers.channels[channel].joint;
    let x = &basis.drivers[driver].values.0;
    let directions: Vec<Option<i8>> = match joint {
        Some(_) => [1, -1, 0].map(Some).to_vec(),
        None => vec![None],
    };
    // Nothing is known of the time between two recordings, so no line leads across it.
    let stretches: Vec<Option<usize>> = match key {
        "time" => (0..=basis.recording.iter().copied().max().unwrap_or(0)).map(Some).collect(),
        _ => vec![None],
    };
    let mut all = Vec::new();
    for (direction, stretch) in directions.iter().flat_map(|d| stretches.iter().map(move |s| (*d, *s))) {
        let of_it = |i: usize| {
            direction.is_none_or(|d| joint.is_some_and(|j| basis.arrival[j][i] == d))
                && stretch.is_none_or(|recording| basis.recording[i] == recording)
        };
        let points = (0..implied.len()).filter(|i| of_it(*i)).filter_map(|i| Some((x[i]?, implied[i]?)));
        let (x, mean, half) = binned(points.collect());
        if !x.is_empty() {
            let (x, mean, half) = (Column::of_all(x), Column::of_all(mean), Column::of(half));
            all.push(Band { channel, driver: key.to_owned(), direction, x, mean, half });
        }
    }
    all
}

/// Bins of as many points each, never parting equal drivers: mean driver, mean, half of its 95 % interval.
fn binned(mut points: Vec<(f64, f64)>) -> (Vec<f64>, Vec<f64>, Vec<Option<f64>>) {
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let bins = (points.len() / POINTS).min(BINS);
    let (mut x, mut mean, mut half) = (Vec::new(), Vec::new(), Vec::new());
    let mut from = 0;
    for bin in 0..bins {
        let mut to = (points.len() * (bin + 1)) / bins;
        while to < points.len() && points[to].0 == points[to.max(1) - 1].0 {
            to += 1;
        }
        if to <= from {
            continue;
        }
        let own = &points[from..to];
        let n = own.len() as f64;
        let changes: Vec<(f64, f64)> = own.iter().map(|(_, y)| (*y, 1.0)).collect();
        let [low, high] = grouped_ci95(&changes);
        x.push(own.iter().map(|p| p.0).sum::<f64>() / n);
        mean.push(own.iter().map(|p| p.1).sum::<f64>() / n);
        half.push(Some((high - low) / 2.0));
        from = to;
    }
    (x, mean, half)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_hold_equal_shares_and_their_interval_is_students() {
        let points: Vec<(f64, f64)> = (0..12).rev().map(|i| (f64::from(i), f64::from(i % 6))).collect();
        let (x, mean, half) = binned(points);
        assert_eq!((x, mean), (vec![2.5, 8.5], vec![2.5, 2.5]));
        // t(0.975, 5) * sd / sqrt(6), sd of 0..5 = 1.8708.
        assert!((half[0].expect("interval") - 2.570_582 * 1.870_829 / 6f64.sqrt()).abs() < 1e-5);
    }

    #[test]
    fn equal_drivers_stay_in_one_bin() {
        let points = (0..30).map(|i| (f64::from(i / 20), 1.0)).collect();
        let (x, ..) = binned(points);
        assert_eq!(x, [0.0, 1.0]);
        assert!(binned(vec![(0.0, 1.0); 3]).0.is_empty());
    }
}
