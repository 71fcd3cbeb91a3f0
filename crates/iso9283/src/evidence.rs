//! What an assessment is made from: visits to commanded poses, commanded and attained paths.

use crate::IsoError;
use crate::command::CommandPath;
use crate::settling::check_run;
use crate::tip_pose::{TimedPose, TipPose};
use nalgebra::Vector3;
use serde::Serialize;

/// One stop of the arm at a commanded pose. All poses of an [`Evidence`] are in one frame, that of the standard's
/// x, y, z: the robot's base frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Visit {
    /// Name of the commanded pose. Visits of one name are cycles of one command.
    pub pose: String,
    /// Index of the recording: the arm goes from one visit to the next within a recording only.
    pub recording: usize,
    /// The commanded pose.
    pub commanded: TipPose,
    /// The attained pose: the mean at rest.
    pub attained: TipPose,
    /// Time of the rest [ns], on one clock for all recordings.
    pub time_ns: i64,
    /// Direction in which the tip moved before it came to rest, of any length above zero; none where it is unknown.
    pub approach: Option<Vector3<f64>>,
    /// When the arm departed from the rest before, where that is known [ns].
    pub departed_ns: Option<i64>,
    /// The tip around the stop, until it rests; may be empty.
    pub arrival: Vec<TimedPose>,
}

/// A commanded path and the attained ones.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PathTest {
    /// Its name.
    pub name: String,
    /// The command path as a polyline, dense where it is curved.
    pub commanded: Vec<TipPose>,
    /// What was attained, one run a cycle.
    pub runs: Vec<Vec<TimedPose>>,
    /// Commanded speed [m/s], where it is constant.
    pub speed_m_s: Option<f64>,
}

/// Everything a recording, or several, can say about a robot.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Evidence {
    /// Stops at commanded poses, in any order.
    pub visits: Vec<Visit>,
    /// Paths.
    pub paths: Vec<PathTest>,
}

/// How evidence is read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Approaches within this angle of the first of them count as one direction [rad].
    pub same_direction_rad: f64,
    /// Radius of the limit band of clauses 7.4, 7.5 and 9 [m], as the maker states it; without it, the pose
    /// repeatability.
    pub limit_band_m: Option<f64>,
    /// The command path has a corner where it turns by more than this [rad].
    pub corner_rad: f64,
    /// The orientation changes along a command path where it turns by more than this [rad].
    pub reorientation_rad: f64,
    /// Number m of measuring planes along a path.
    pub planes: usize,
}

impl Default for Settings {
    fn default() -> Settings {
        Settings {
            same_direction_rad: 30_f64.to_radians(),
            limit_band_m: None,
            corner_rad: 30_f64.to_radians(),
            reorientation_rad: 5_f64.to_radians(),
            planes: 100,
        }
    }
}

impl Evidence {
    /// Fails where a number is not finite, samples are not in order of time, or one name has two commanded poses.
    pub fn check(&self) -> Result<(), IsoError> {
        for (index, visit) in self.visits.iter().enumerate() {
            let finite = visit.attained.is_finite() && visit.commanded.is_finite();
            if !finite || visit.approach.is_some_and(|d| d.iter().any(|v| !v.is_finite())) {
                return Err(IsoError::NotFinite { what: format!("visits to '{}'", visit.pose), index });
            }
            check_run(&format!("arrival of visit {index} to '{}'", visit.pose), &visit.arrival)?;
            self.check_command(index, visit)?;
        }
        for path in &self.paths {
            CommandPath::new(&path.commanded)?;
            for (index, run) in path.runs.iter().enumerate() {
                check_run(&format!("run {index} of path '{}'", path.name), run)?;
            }
        }
        Ok(())
    }

    fn check_command(&self, index: usize, visit: &Visit) -> Result<(), IsoError> {
        // Rounding of a frame's transformation, not a move of the target.
        const SAME: f64 = 1e-9;
        let Some(first) = self.visits.iter().find(|other| other.pose == visit.pose) else { return Ok(()) };
        let distance_m = (visit.commanded.position_m - first.commanded.position_m).norm();
        let turn_rad = visit.commanded.turn_from_rad(&first.commanded).map_or(0.0, |turn| turn.norm());
        if distance_m <= SAME && turn_rad <= SAME {
            return Ok(());
        }
        Err(IsoError::CommandMoved {
            pose: visit.pose.clone(),
            visit: index,
            distance_mm: distance_m * 1e3,
            angle_deg: turn_rad.to_degrees(),
        })
    }
}
