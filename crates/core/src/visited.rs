//! Where a joint has been: the bins of its range with a reading in them.
//!
//! Smallest and largest reading hide what lies unvisited between them, and one stray pose makes them wide.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Width of a bin of a turning joint [rad]: 5 deg.
const TURNING_BIN: f64 = 5.0 * std::f64::consts::PI / 180.0;
/// Width of a bin of a sliding joint [m].
const SLIDING_BIN: f64 = 0.05;

/// The visited part of one joint's range.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Visited {
    /// Width of a bin [rad] (sliding: [m]); the bins begin at zero.
    pub bin: f64,
    /// Runs of neighbouring visited bins, lowest first, from the lower end of the first bin to the upper end of the last.
    pub intervals: Vec<[f64; 2]>,
}

impl Visited {
    /// By these readings of a joint that turns or slides; those that are no numbers do not count.
    pub fn of(readings: impl Iterator<Item = f64>, slides: bool) -> Visited {
        let bin = if slides { SLIDING_BIN } else { TURNING_BIN };
        let mut bins: Vec<i64> =
            readings.filter(|q| q.is_finite()).map(|q| (q / bin).floor() as i64).collect();
        bins.sort_unstable();
        bins.dedup();
        let runs = bins.chunk_by(|a, b| b - a == 1);
        let ends = |run: &[i64]| Some([*run.first()? as f64 * bin, (*run.last()? + 1) as f64 * bin]);
        Visited { bin, intervals: runs.filter_map(ends).collect() }
    }

    /// Whether a reading is in a visited bin or the one beside it; beyond that, nothing near was visited.
    pub fn is_near(&self, reading: f64) -> bool {
        self.intervals.iter().any(|[low, high]| (low - self.bin..=high + self.bin).contains(&reading))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn deg(intervals: &Visited) -> Vec<[i64; 2]> {
        intervals.intervals.iter().map(|ends| ends.map(|rad| rad.to_degrees().round() as i64)).collect()
    }

    #[test]
    fn gaps_between_visited_bins_stay_gaps() {
        let readings = [1.0, 2.0, 7.0, 61.0, -0.5, f64::NAN].map(f64::to_radians);
        let visited = Visited::of(readings.into_iter(), false);
        assert_eq!(deg(&visited), [[-5, 10], [60, 65]]);
        for (reading_deg, near) in [
            (-9.0, true),
            (-11.0, false),
            (14.0, true),
            (16.0, false),
            (40.0, false),
            (56.0, true),
            (69.0, true),
        ] {
            assert_eq!(visited.is_near(f64::to_radians(reading_deg)), near, "{reading_deg} deg");
        }
    }

    #[test]
    fn a_sliding_joint_is_told_in_metres() {
        let visited = Visited::of([0.11, 0.16].into_iter(), true);
        let ends = visited.intervals[0];
        assert!((ends[0] - 0.1).abs() < 1e-12 && (ends[1] - 0.2).abs() < 1e-12, "{ends:?}");
    }

    #[test]
    fn nothing_is_near_where_nothing_was_visited() {
        let nowhere = Visited::of(std::iter::empty(), false);
        assert!(nowhere.intervals.is_empty() && !nowhere.is_near(0.0));
    }
}
