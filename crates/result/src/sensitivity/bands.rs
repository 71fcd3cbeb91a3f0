//! The mean of an implied error along a driver, with its interval: the line the eye follows through the points.

use super::basis::Basis;
use crate::column::Column;
use armcal_calibrate::grouped_ci95;
use armcal_diagnose::DependsOn;
use serde::Serialize;

/// Points a bin holds at least.
const POINTS: usize = 6;
/// Bins at most.
const BINS: usize = 10;
/// No bin reaches across a gap wider than this share of the driver's range: nothing is known inside it.
const GAP: f64 = 0.12;

/// Bin means of one channel over one driver for one direction of arrival.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Band {
    /// Index of the channel.
    pub channel: usize,
    /// Key of the driver.
    pub driver: DependsOn,
    /// 1, -1 or 0 (not known) for a joint, `null` where directions do not matter.
    pub direction: Option<i8>,
    /// Mean driver of each bin.
    pub x: Column,
    /// Mean implied error of each bin.
    pub mean: Column,
    /// Half of the 95 % interval of that mean, dwells taken as independent.
    pub half: Column,
}

/// Which drivers are drawn for a channel; none for one that is not drawn.
pub fn drivers_of(basis: &Basis, channel: usize) -> Vec<DependsOn> {
    if !basis.drawn[channel] {
        return Vec::new();
    }
    let keys = match basis.sensitivity.channels[channel].joint {
        Some(j) => [DependsOn::Angle(j), DependsOn::Torque(j), DependsOn::Time],
        None => [DependsOn::Time, DependsOn::Temperature, DependsOn::Load],
    };
    keys.into_iter().filter(|key| basis.driver(*key).is_some()).collect()
}

/// All bands of one channel's implied errors.
pub fn bands(basis: &Basis, channel: usize, implied: &[Option<f64>]) -> Vec<Band> {
    let keys = drivers_of(basis, channel);
    keys.into_iter().flat_map(|key| bands_over(basis, channel, key, implied)).collect()
}

/// The bands over one driver.
pub fn bands_over(basis: &Basis, channel: usize, key: DependsOn, implied: &[Option<f64>]) -> Vec<Band> {
    let Some(driver) = basis.driver(key) else { return Vec::new() };
    let joint = basis.sensitivity.channels[channel].joint;
    let x = &basis.drivers[driver].values.0;
    let directions: Vec<Option<i8>> = match joint {
        Some(_) => [1, -1, 0].map(Some).to_vec(),
        None => vec![None],
    };
    let cuts: &[f64] = if key == DependsOn::Time { &basis.time_cuts } else { &[] };
    let mut all = Vec::new();
    for direction in directions {
        let of_it = |i: usize| direction.is_none_or(|d| joint.is_some_and(|j| basis.arrival[j][i] == d));
        let points = (0..implied.len()).filter(|i| of_it(*i)).filter_map(|i| Some((x[i]?, implied[i]?)));
        let [x, mean, half] = bin_means(points.collect(), cuts);
        if !x.is_empty() {
            let (x, mean, half) = (Column::of(x), Column::of(mean), Column::of(half));
            all.push(Band { channel, driver: key, direction, x, mean, half });
        }
    }
    all
}

/// Bins of as many points each, never parting equal drivers nor reaching across a gap or a cut: mean driver, mean, half of its 95 %
/// interval. `None` stands for a gap, so that no line leads across.
fn bin_means(mut points: Vec<(f64, f64)>, cuts: &[f64]) -> [Vec<Option<f64>>; 3] {
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let range = points.last().map_or(0.0, |last| last.0 - points[0].0);
    let size = points.len().div_ceil(BINS).max(POINTS);
    let mut columns = [Vec::new(), Vec::new(), Vec::new()];
    let mut put = |row: [Option<f64>; 3]| columns.iter_mut().zip(row).for_each(|(all, one)| all.push(one));
    let mut begun = false;
    let apart = |a: f64, b: f64| b - a > GAP * range || cuts.iter().any(|cut| (a..b).contains(cut));
    for stretch in points.chunk_by(|a, b| !apart(a.0, b.0)) {
        let bins = (stretch.len() / size).max(usize::from(stretch.len() >= POINTS));
        if bins > 0 && std::mem::replace(&mut begun, true) {
            put([None; 3]);
        }
        let mut from = 0;
        for bin in 0..bins {
            let mut to = (stretch.len() * (bin + 1)) / bins;
            while to < stretch.len() && stretch[to].0 == stretch[to.max(1) - 1].0 {
                to += 1;
            }
            if to <= from {
                continue;
            }
            let own = &stretch[from..to];
            let n = own.len() as f64;
            let [low, high] = grouped_ci95(&own.iter().map(|(_, y)| (*y, 1.0)).collect::<Vec<_>>());
            let mean = |of: fn(&(f64, f64)) -> f64| own.iter().map(of).sum::<f64>() / n;
            put([Some(mean(|p| p.0)), Some(mean(|p| p.1)), Some((high - low) / 2.0)]);
            from = to;
        }
    }
    columns
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_hold_equal_shares_and_their_interval_is_students() {
        let points: Vec<(f64, f64)> = (0..12).rev().map(|i| (f64::from(i), f64::from(i % 6))).collect();
        let [x, mean, half] = bin_means(points, &[]);
        assert_eq!((x, mean), (vec![Some(2.5), Some(8.5)], vec![Some(2.5), Some(2.5)]));
        // t(0.975, 5) * sd / sqrt(6), sd of 0..5 = 1.8708.
        assert!((half[0].expect("interval") - 2.570_582 * 1.870_829 / 6f64.sqrt()).abs() < 1e-5);
    }

    #[test]
    fn equal_drivers_stay_in_one_bin() {
        let points = (0..30).map(|i| (f64::from(i / 20), 1.0)).collect();
        let [x, ..] = bin_means(points, &[]);
        assert_eq!(x, [Some(0.0), None, Some(1.0)]);
    }

    #[test]
    fn no_bin_reaches_across_a_gap() {
        let points = (0..21).map(|i| (f64::from(i) + if i < 9 { 0.0 } else { 50.0 }, 1.0)).collect();
        let [x, ..] = bin_means(points, &[]);
        assert_eq!(x, [Some(4.0), None, Some(61.5), Some(67.5)]);
    }

    #[test]
    fn no_bin_reaches_across_a_cut() {
        let points = (0..18).map(|i| (f64::from(i), 1.0)).collect();
        let [x, ..] = bin_means(points, &[8.5]);
        assert_eq!(x, [Some(4.0), None, Some(13.0)]);
    }

    #[test]
    fn few_points_have_no_bin() {
        assert!(bin_means(vec![(0.0, 1.0); 3], &[])[0].is_empty());
    }
}
