//! The two streams seen through one smoothing kernel.

use nalgebra::Vector3;
use std::ops::Range;

use super::fine::{MIN_MOVEMENTS, Point, group_movements};
use super::profile::SpeedProfile;
use crate::series::{breaking_gap_s, seconds_between, typical_period_s, unbroken_runs};
use crate::{ClockConfig, DwellError};

/// Movements shorter than this are counted together when errors are estimated [s].
const SHORTEST_MOVEMENT_S: f64 = 1.5;

/// Groups of movements that a recording is divided into at most: neighbouring movements share the error of
/// the model, and this many groups tell a standard error to a tenth.
const MOST_MOVEMENTS: f64 = 50.0;

/// Speed above which a stream moves, as a share of its fast end: well above the noise of a resting tip,
/// whose smoothed speed is not zero.
const MOVING_SHARE: f64 = 0.15;

/// From one grid point of a profile to the next, in half-widths of the kernel.
const GRID_STEP: f64 = 0.1;

/// A path in seconds since an origin, and where it is unbroken.
pub(crate) struct Track {
    pub time_s: Vec<f64>,
    pub position_m: Vec<Vector3<f64>>,
    unbroken: Vec<Range<usize>>,
    /// Typical time between samples [s].
    pub period_s: f64,
}

impl Track {
    pub(crate) fn of(
        time_ns: &[i64],
        origin_ns: i64,
        position_m: Vec<Vector3<f64>>,
        config: &ClockConfig,
    ) -> Track {
        let period_s = typical_period_s(time_ns);
        let gap_s = breaking_gap_s(config.max_gap_s, period_s);
        Track {
            time_s: time_ns.iter().map(|&t| seconds_between(origin_ns, t)).collect(),
            unbroken: unbroken_runs(time_ns, gap_s, |i| position_m[i].iter().all(|v| v.is_finite())),
            position_m,
            period_s,
        }
    }

    /// The same stamps on another path without more breaks, as speeds.
    pub(crate) fn speeds_of(&self, position_m: &[Vector3<f64>], h_s: f64, step_s: f64) -> SpeedProfile {
        SpeedProfile::new(&self.time_s, position_m, &self.unbroken, h_s, step_s)
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

    /// Rows no closer to each other than `apart_s`, and where the path is broken the last one before.
    pub(crate) fn thinned(&self, apart_s: f64) -> Vec<usize> {
        let mut kept: Vec<usize> = Vec::new();
        for rows in &self.unbroken {
            for row in rows.clone() {
                let apart = kept.last().is_none_or(|last| self.time_s[row] - self.time_s[*last] >= apart_s);
                if apart || row + 1 == rows.end {
                    kept.push(row);
                }
            }
        }
        kept
    }

    /// Some rows of the path in runs between which it is not known, as a path of its own, broken where this one is; and which
    /// rows those are.
    pub(crate) fn of_runs(&self, runs: &[&[usize]]) -> (Track, Vec<usize>) {
        let (mut rows, mut unbroken) = (Vec::new(), Vec::new());
        let stretch = |row: &usize| self.unbroken.partition_point(|stretch| stretch.end <= *row);
        for run in runs {
            for part in run.chunk_by(|a, b| stretch(a) == stretch(b)) {
                unbroken.push(rows.len()..rows.len() + part.len());
                rows.extend_from_slice(part);
            }
        }
        let time_s = rows.iter().map(|row| self.time_s[*row]).collect();
        let position_m = rows.iter().map(|row| self.position_m[*row]).collect();
        (Track { time_s, position_m, unbroken, period_s: self.period_s }, rows)
    }

    pub(crate) fn speeds(&self, h_s: f64) -> SpeedProfile {
        self.speeds_of(&self.position_m, h_s, GRID_STEP * h_s)
    }
}

/// Both speed profiles under a kernel of half-width `h_s`, and what counts as motion in them.
#[derive(Clone)]
pub(crate) struct Scale {
    pub h_s: f64,
    pub sensor: SpeedProfile,
    pub robot: SpeedProfile,
    /// Where the robot's is a logarithm: the speed that counts as standing still [m/s].
    pub robot_still_m_s: Option<f64>,
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
        h_s: f64,
        config: &ClockConfig,
    ) -> Result<Scale, DwellError> {
        let (sensor, robot) = (sensor.speeds(h_s), robot.speeds(h_s));
        let (measured, predicted) = (sensor.quantile_m_s(0.99), robot.quantile_m_s(0.99));
        let least = config.min_speed_mm_s * 1e-3;
        if predicted.is_nan() || measured.is_nan() {
            let stream = if predicted.is_nan() { "joint" } else { "tip" };
            return Err(DwellError::Broken { stream, needed_s: 2.4 * h_s, rows: String::new() });
        }
        let still =
            |what: &str, speed: f64| format!("the {what} never moves faster than {:.2} mm/s", speed * 1e3);
        if predicted < least {
            return Err(DwellError::NoMotion {
                seen: still("arm, by its joint stream and the nominal model,", predicted),
                advice: "record some moves between poses, or check the unit and order of the joints",
            });
        }
        if measured < least {
            return Err(DwellError::NoMotion {
                seen: still("tip stream", measured),
                advice: "the arm does move: check the unit of the tip stream (\"m\" or \"mm\"), and that it shows the \
                         tip, not a static body",
            });
        }
        let moving_above = (MOVING_SHARE * measured).max(0.5 * least);
        let points = sensor.points(1);
        let moving_s = GRID_STEP * h_s * points.iter().filter(|p| p.1 > moving_above).count() as f64;
        if moving_s < config.min_motion_s {
            return Err(DwellError::NoMotion {
                seen: format!(
                    "the tip moves for {moving_s:.1} s in all, less than clock.min_motion_s = {}",
                    config.min_motion_s
                ),
                advice: "record more moves between poses",
            });
        }
        let seen_s = points.last().map_or(0.0, |p| p.0) - points.first().map_or(0.0, |p| p.0);
        let shortest_s =
            (moving_s / 12.0).min(SHORTEST_MOVEMENT_S).max(4.0 * h_s).max(seen_s / MOST_MOVEMENTS);
        Ok(Scale { h_s, sensor, robot, robot_still_m_s: None, moving_above, shortest_s })
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
            robot_still_m_s: Some(still_m_s / ratio),
            moving_above: 1.0,
            shortest_s: self.shortest_s,
        }
    }

    /// Speeds in the unit of the robot's profile.
    pub(crate) fn like_robot(&self, speeds: SpeedProfile) -> SpeedProfile {
        self.robot_still_m_s.map(|still| speeds.logarithm(still)).unwrap_or(speeds)
    }

    /// The sensor's points, grouped in movements; short movements are counted alone where there would be too few.
    pub(crate) fn movements(&self) -> Result<Vec<Point>, DwellError> {
        let points = self.sensor.points(2);
        let mut shortest_s = self.shortest_s;
        loop {
            let grouped = group_movements(&points, self.moving_above, shortest_s);
            let groups = grouped.last().map_or(0, |p| p.movement + 1);
            if groups >= MIN_MOVEMENTS {
                return Ok(grouped);
            }
            shortest_s *= 0.7;
            if shortest_s < 2.0 * self.h_s {
                return Err(DwellError::NoMotion {
                    seen: format!(
                        "there are {groups} separate movements, too few: errors cannot be told from fewer than \
                         {MIN_MOVEMENTS}"
                    ),
                    advice: "record more moves between poses",
                });
            }
        }
    }
}
