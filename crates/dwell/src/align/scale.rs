//! The two streams seen through one smoothing kernel.

use nalgebra::Vector3;
use rayon::prelude::*;
use std::ops::Range;

use super::fine::{Fine, MIN_MOVEMENTS, Problem, Start, movements};
use super::profile::SpeedProfile;
use crate::series::{breaking_gap_s, median_period_s, seconds_between, unbroken};
use crate::{ClockConfig, DwellError};

/// Movements shorter than this are counted together when errors are estimated [s].
const SHORTEST_MOVEMENT_S: f64 = 1.5;

/// Groups of movements that a recording is divided into at most: neighbouring movements share the error of
/// the model, and this many groups tell a standard error to a tenth.
const MOST_MOVEMENTS: f64 = 50.0;

/// Speed above which a stream moves, as a share of its fast end: well above the noise of a resting tip,
/// whose smoothed speed is not zero.
const MOVING_SHARE: f64 = 0.15;

/// A path in seconds since an origin, and where it is unbroken.
pub(crate) struct Track {
    pub time_s: Vec<f64>,
    pub position_m: Vec<Vector3<f64>>,
    unbroken: Vec<Range<usize>>,
    /// Median sample period [s].
    pub period_s: f64,
}

impl Track {
    pub(crate) fn of(
        time_ns: &[i64],
        origin_ns: i64,
        position_m: Vec<Vector3<f64>>,
        config: &ClockConfig,
    ) -> Track {
        let gap_s = breaking_gap_s(config.max_gap_s, time_ns);
        Track {
            time_s: time_ns.iter().map(|&t| seconds_between(origin_ns, t)).collect(),
            unbroken: unbroken(time_ns, gap_s, |i| position_m[i].iter().all(|v| v.is_finite())),
            position_m,
            period_s: median_period_s(time_ns),
        }
    }

    /// Position of the row nearest to a time, where one lies within two periods.
    pub(crate) fn nearest(&self, t_s: f64) -> Option<Vector3<f64>> {
        let after = self.time_s.partition_point(|t| *t < t_s);
        let rows =
            [after.checked_sub(1), Some(after)].into_iter().flatten().filter(|i| *i < self.time_s.len());
        let distance = |i: &usize| (self.time_s[*i] - t_s).abs();
        let row = rows.min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
        (distance(&row) <= 2.0 * self.period_s).then(|| self.position_m[row])
    }

    fn speeds(&self, h_s: f64) -> SpeedProfile {
        SpeedProfile::new(&self.time_s, &self.position_m, &self.unbroken, h_s, 0.1 * h_s)
    }
}

/// Both speed profiles under a kernel of half-width `h_s`, and what counts as motion in them.
pub(crate) struct Scale {
    pub h_s: f64,
    pub sensor: SpeedProfile,
    pub robot: SpeedProfile,
    /// The robot's with each joint bent a little in turn.
    bent: Vec<SpeedProfile>,
    /// Measured value above which the tip moves, in the unit of the profile.
    moving_above: f64,
    /// Shortest length of a movement [s].
    shortest_s: f64,
}

impl Scale {
    /// Refuses streams that do not move enough.
    pub(crate) fn of(
        sensor: &Track,
        robot: &Track,
        bent: &[Track],
        h_s: f64,
        config: &ClockConfig,
    ) -> Result<Scale, DwellError> {
        let (sensor, robot) = (sensor.speeds(h_s), robot.speeds(h_s));
        let bent = bent.par_iter().map(|track| track.speeds(h_s)).collect();
        let (measured, predicted) = (sensor.quantile_m_s(0.99), robot.quantile_m_s(0.99));
        let least = config.min_speed_mm_s * 1e-3;
        let still = |what: &str, speed: f64| {
            if speed.is_nan() {
                format!("the {what} has no unbroken stretch of {:.2} s", 2.4 * h_s)
            } else {
                format!("the {what} never moves faster than {:.2} mm/s", speed * 1e3)
            }
        };
        if predicted.is_nan() || predicted < least {
            return Err(DwellError::NoMotion {
                seen: still("arm, by its joint stream and the nominal model,", predicted),
                advice: "record some moves between poses, or check the unit and order of the joints",
            });
        }
        if measured.is_nan() || measured < least {
            return Err(DwellError::NoMotion {
                seen: still("tip stream", measured),
                advice: "the arm does move: check the unit of the tip stream (\"m\" or \"mm\"), and that it shows the \
                         tip, not a static body",
            });
        }
        let moving_above = (MOVING_SHARE * measured).max(0.5 * least);
        let moving_s = 0.1 * h_s * sensor.points(1).iter().filter(|p| p.1 > moving_above).count() as f64;
        if moving_s < config.min_motion_s {
            return Err(DwellError::NoMotion {
                seen: format!(
                    "the tip moves for {moving_s:.1} s in all, less than clock.min_motion_s = {}",
                    config.min_motion_s
                ),
                advice: "record more moves between poses",
            });
        }
        let points = sensor.points(1);
        let seen_s = points.last().map_or(0.0, |p| p.0) - points.first().map_or(0.0, |p| p.0);
        let shortest_s =
            (moving_s / 12.0).min(SHORTEST_MOVEMENT_S).max(4.0 * h_s).max(seen_s / MOST_MOVEMENTS);
        Ok(Scale { h_s, sensor, robot, bent, moving_above, shortest_s })
    }

    /// The same in logarithms. When something moves is then told by its beginning and end, however fast it
    /// gets in between. Motion begins in both at the same speed, that of the noise at rest: otherwise every
    /// move would look longer in one than in the other, and the difference like a drift.
    pub(crate) fn logarithmic(&self, ratio: f64) -> Scale {
        let still = |p: &SpeedProfile| (3.0 * p.quantile_m_s(0.1)).max(1e-4 * p.quantile_m_s(0.99));
        let still_m_s = still(&self.sensor).max(ratio * still(&self.robot));
        Scale {
            h_s: self.h_s,
            sensor: self.sensor.logarithm(still_m_s),
            robot: self.robot.logarithm(still_m_s / ratio),
            bent: self.bent.iter().map(|b| b.logarithm(still_m_s / ratio)).collect(),
            moving_above: 1.0,
            shortest_s: self.shortest_s,
        }
    }

    /// The fine estimate; without drift where the data tell it no better than `max_drift`.
    pub(crate) fn solve(&self, start: Start, reference_s: f64, max_drift: f64) -> Result<Fine, DwellError> {
        let points = movements(&self.sensor.points(2), self.moving_above, self.shortest_s);
        let solve = |with_drift: bool| {
            let problem = Problem::new(&self.robot, &self.bent, &points, reference_s, with_drift);
            problem.solve(start).ok_or_else(|| DwellError::NoMotion {
                seen: format!(
                    "there are {} separate movements, errors cannot be told from fewer than {MIN_MOVEMENTS}",
                    points.last().map_or(0, |p| p.movement + 1)
                ),
                advice: "record more moves between poses",
            })
        };
        let fine = solve(max_drift > 0.0)?;
        let drift_known = fine.covariance[(1, 1)].sqrt() <= max_drift;
        if fine.with_drift && !drift_known { solve(false) } else { Ok(fine) }
    }
}
