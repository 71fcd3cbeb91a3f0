//! The arm between its dwells: where the sensor saw the tip, and the joints at that moment.

use crate::history::History;
use crate::pauses::{Encoders, Tip};
use crate::series::{check_joints, check_poses, seconds_between};
use crate::summary::mean_temperature_c;
use crate::{ClockAlignment, DwellConfig, DwellError};
use armcal_core::{Arrival, Dwell, JointSamples, Samples, gaps};
use nalgebra::Vector3;
use rayon::prelude::*;

const DOING: &str = "following the moving arm";

/// Half the time over which a joint's velocity is measured [s]: long against the jitter of stamps, short against a move.
const VELOCITY_HALF_S: f64 = 0.02;

/// One frame of the sensor while the arm moved.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackSample {
    /// Time on the robot's clock [ns].
    pub time_ns: i64,
    /// Which motion it belongs to, from 0: a dwell or a break of the stream ends one.
    pub motion: usize,
    /// Joint readings, interpolated [rad].
    pub joint_rad: Vec<f64>,
    /// Joint velocities [rad/s].
    pub joint_velocity_radps: Vec<f64>,
    /// Direction each joint moves, or last moved, in.
    pub arrival: Vec<Arrival>,
    /// As [`Dwell::path_memory_rad`].
    pub path_memory_rad: Vec<Vec<f64>>,
    /// As [`Dwell::pair_memory_rad`].
    pub pair_memory_rad: Vec<[Vec<f64>; 2]>,
    /// As [`Dwell::effort_nm`].
    pub effort_nm: Option<Vec<f64>>,
    /// Temperature [degC], where the recording has it.
    pub temperature_c: Option<f64>,
    /// Position of the tracked body in the sensor's frame [m].
    pub position_m: Vector3<f64>,
}

/// Every frame of the tip outside the dwells, in order of time; none without a tip stream.
///
/// The tip's stamps are brought to the robot's clock by `clock`, and the joint readings interpolated linearly. Frames beyond
/// the joint stream, or in a break of it, are left out.
///
/// # Errors
/// No joint rows, columns of different length, stamps that do not increase.
pub fn track(
    samples: &Samples,
    clock: Option<&ClockAlignment>,
    dwells: &[Dwell],
    config: &DwellConfig,
) -> Result<Vec<TrackSample>, DwellError> {
    config.check()?;
    check_joints(&samples.joints, DOING)?;
    let Some(tip) = samples.tip.as_ref().filter(|t| !t.is_empty()) else { return Ok(Vec::new()) };
    check_poses(tip, DOING, "tip")?;
    let encoders = Encoders::of(&samples.joints, config);
    let tip = Tip::of(tip, clock, &samples.joints.time_ns, config);
    let history = History::of(&encoders, config);
    // Which motion a frame belongs to hangs on the frames before it; all else about it does not.
    let mut motions = Motions::new(dwells);
    let mut found = Vec::new();
    for (row, time_ns) in tip.robot_ns.iter().copied().enumerate() {
        let seen = tip.samples.position_m[row].iter().all(|v| v.is_finite());
        let reading = Reading::at(&encoders, time_ns).filter(|_| seen);
        let motion = motions.of(time_ns, reading.as_ref().map(|r| r.stretch));
        found.extend(motion.zip(reading).map(|(motion, reading)| (row, motion, reading)));
    }
    let moment = |(row, motion, reading): (usize, usize, Reading)| {
        let time_ns = tip.robot_ns[row];
        let joint_rad = reading.joint_rad(&samples.joints);
        TrackSample {
            time_ns,
            motion,
            joint_velocity_radps: velocities_radps(&encoders, time_ns, joint_rad.len()),
            arrival: history.arrival(reading.next, &joint_rad),
            path_memory_rad: history.path_memory(reading.next, &joint_rad),
            pair_memory_rad: history.pair_memory(reading.next, &joint_rad),
            effort_nm: reading.effort_nm(&samples.joints),
            temperature_c: samples
                .temperature
                .as_ref()
                .and_then(|t| mean_temperature_c(t, time_ns, time_ns, config.temperature_max_age_s)),
            joint_rad,
            position_m: tip.samples.position_m[row],
        }
    };
    Ok(found.into_par_iter().map(moment).collect())
}

/// Numbers the motions between dwells.
struct Motions<'a> {
    dwells: &'a [Dwell],
    /// Dwells that are over, and the stretch of the joint stream, of the last moment.
    last: Option<(usize, usize)>,
    motion: usize,
}

impl<'a> Motions<'a> {
    fn new(dwells: &'a [Dwell]) -> Motions<'a> {
        Motions { dwells, last: None, motion: 0 }
    }

    /// The motion a moment belongs to; none within a dwell, or where there are no joints.
    fn of(&mut self, time_ns: i64, stretch: Option<usize>) -> Option<usize> {
        let over = self.dwells.partition_point(|d| d.end_ns < time_ns);
        if self.dwells.get(over).is_some_and(|d| d.start_ns <= time_ns) {
            return None;
        }
        let now = (over, stretch?);
        if self.last.is_some_and(|last| last != now) {
            self.motion += 1;
        }
        self.last = Some(now);
        Some(self.motion)
    }
}

/// A time between two rows of the joint stream.
struct Reading {
    /// Row after it.
    next: usize,
    /// Share of the way to that row.
    share: f64,
    /// Stretch of the stream.
    stretch: usize,
}

impl Reading {
    /// None outside the stream and in its breaks.
    fn at(encoders: &Encoders<'_>, time_ns: i64) -> Option<Reading> {
        let rows = &encoders.joints.time_ns;
        let next = rows.partition_point(|t| *t < time_ns);
        let previous = next.checked_sub(1)?;
        let stretch = encoders.stretches.iter().position(|s| s.contains(&previous) && s.contains(&next))?;
        let share = seconds_between(rows[previous], time_ns) / seconds_between(rows[previous], rows[next]);
        Some(Reading { next, share, stretch })
    }

    fn joint_rad(&self, joints: &JointSamples) -> Vec<f64> {
        joints.joint_rad.iter().map(|column| self.between(column)).collect()
    }

    fn effort_nm(&self, joints: &JointSamples) -> Option<Vec<f64>> {
        gaps::if_any_known(joints.effort_nm.as_ref()?.iter().map(|column| self.between(column)).collect())
    }

    fn between(&self, column: &[f64]) -> f64 {
        column[self.next - 1] + self.share * (column[self.next] - column[self.next - 1])
    }
}

/// Central differences; one-sided at the ends of a stretch.
fn velocities_radps(encoders: &Encoders<'_>, time_ns: i64, joints: usize) -> Vec<f64> {
    let half_ns = (VELOCITY_HALF_S * 1e9) as i64;
    let at = |shift_ns: i64| {
        let time_ns = time_ns.saturating_add(shift_ns);
        Reading::at(encoders, time_ns).map(|r| (time_ns, r.joint_rad(encoders.joints)))
    };
    let now = || at(0);
    match (at(-half_ns).or_else(now), at(half_ns).or_else(now)) {
        (Some((from_ns, from)), Some((to_ns, to))) if to_ns > from_ns => {
            let time_s = seconds_between(from_ns, to_ns);
            from.iter().zip(&to).map(|(from, to)| (to - from) / time_s).collect()
        }
        _ => vec![0.0; joints],
    }
}

#[cfg(test)]
#[path = "track_tests.rs"]
mod tests;
