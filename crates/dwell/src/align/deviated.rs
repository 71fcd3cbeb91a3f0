//! Speeds that the nominal model predicts, with its uncertain parameters where they are taken to be.

use armcal_core::JointSamples;
use nalgebra::Vector3;
use rayon::prelude::*;

use super::profile::SpeedProfile;
use super::scale::{Scale, Track};
use super::spread::{Deviations, FURTHER};
use super::{NominalArm, Streams};
use crate::ClockConfig;

/// Rows of the joint stream per half-width of the kernel that the uncertain parameters are tried on.
const TRIED_ROWS: f64 = 5.0;

/// Motion of a joint [rad] (prismatic: [m]) up to which the tip is where it was, whatever the uncertain parameters.
const RESTING_RAD: f64 = 1e-4;

impl Streams<'_> {
    /// The speeds that the model with these parameters predicts.
    pub(super) fn robot_speeds(&self, scale: &Scale, parameters: &[f64]) -> SpeedProfile {
        if parameters.iter().all(|p| *p == 0.0) {
            return scale.robot.clone();
        }
        scale.like_robot(
            predicted(self.joints, self.robot_origin_ns, self.arm, parameters, self.config).speeds(scale.h_s),
        )
    }

    /// Speeds with each uncertain parameter further off in turn; none where there are no such parameters.
    pub(super) fn deviations(&self, scale: &Scale, so_far: &[f64]) -> Option<Deviations> {
        if so_far.is_empty() {
            return None;
        }
        let rows = self.robot.thinned(scale.h_s / TRIED_ROWS);
        let thin = JointSamples {
            time_ns: rows.iter().map(|row| self.joints.time_ns[*row]).collect(),
            joint_rad: self
                .joints
                .joint_rad
                .iter()
                .map(|c| rows.iter().map(|row| c[*row]).collect())
                .collect(),
            ..JointSamples::default()
        };
        let (moved, of_row) = where_moved(&thin);
        let speeds = |parameters: &[f64]| {
            let tip_m = |row: &usize| (self.arm.tip_m)(&thin.row_rad(*row), parameters);
            let at_m: Vec<Vector3<f64>> = moved.par_iter().map(tip_m).collect();
            let path_m = of_row.iter().map(|k| at_m[*k]).collect();
            scale.like_robot(
                Track::of(&thin.time_ns, self.robot_origin_ns, path_m, self.config).speeds(scale.h_s),
            )
        };
        let further = |k: usize| {
            let mut parameters = so_far.to_vec();
            parameters[k] += FURTHER;
            speeds(&parameters)
        };
        let deviated = (0..so_far.len()).into_par_iter().map(further).collect();
        Some(Deviations { so_far: so_far.to_vec(), now: speeds(so_far), deviated })
    }
}

/// The path that a model predicts of the joints' readings.
pub(super) fn predicted(
    joints: &JointSamples,
    origin_ns: i64,
    arm: NominalArm<'_>,
    parameters: &[f64],
    config: &ClockConfig,
) -> Track {
    let tip_m = |row| (arm.tip_m)(&joints.row_rad(row), parameters);
    let path_m = (0..joints.len()).into_par_iter().map(tip_m).collect();
    Track::of(&joints.time_ns, origin_ns, path_m, config)
}

/// Rows at which the arm is not where it was at the one before them, and which of these every row is as.
fn where_moved(joints: &JointSamples) -> (Vec<usize>, Vec<usize>) {
    let (mut moved, mut of_row) = (Vec::new(), Vec::with_capacity(joints.len()));
    let rests = |last: usize, row: usize| {
        joints.joint_rad.iter().all(|column| (column[row] - column[last]).abs() <= RESTING_RAD)
    };
    for row in 0..joints.len() {
        if moved.last().is_none_or(|last| !rests(*last, row)) {
            moved.push(row);
        }
        of_row.push(moved.len() - 1);
    }
    (moved, of_row)
}
