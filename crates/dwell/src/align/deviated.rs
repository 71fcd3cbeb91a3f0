//! Speeds that the nominal model predicts with its uncertain parameters where they are taken to be, and what these do to them.

use armcal_core::JointSamples;
use nalgebra::Vector3;
use rayon::prelude::*;
use std::borrow::Cow;

use super::profile::SpeedProfile;
use super::scale::{Scale, Track};
use super::{PlacedArm, Streams};

/// Rows of the joint stream per half-width of the kernel that the uncertain parameters are tried on.
const TRIED_ROWS: f64 = 5.0;

/// How far around the times it is for a path is predicted anew, in half-widths of the kernel: one for the kernel, and one for what
/// the parameters move the clock by.
const PATH_WIDTHS: f64 = 2.0;
/// From one grid point of its speeds to the next, in half-widths: what a cubic misses of the speed between points twice as far
/// from each other moves a clock by ten microseconds and more where the kernel is long.
const FINE_STEP: f64 = 0.05;

/// Motion of a joint [rad] (prismatic: [m]) up to which the tip is where it was, whatever the uncertain parameters.
const RESTING_RAD: f64 = 1e-4;

/// The path of the tip under a model, and how each uncertain parameter moves it.
pub(crate) struct Deviations {
    /// The parameters, in standard deviations of their priors.
    pub so_far: Vec<f64>,
    h_s: f64,
    /// Where speeds are logarithms: the speed that counts as standing still [m/s].
    still_m_s: Option<f64>,
    /// Rows of the path: time [s], and the place among `moved` where the arm then is.
    rows: Vec<(f64, usize)>,
    moved: Vec<Moved>,
}

/// The part of the robot's track around some times.
pub(crate) struct Near {
    track: Track,
    joint_rows: Vec<usize>,
}

/// The tip in one pose of the arm.
struct Moved {
    tip_m: Vector3<f64>,
    /// Its motion per standard deviation of each parameter [m].
    by_m: Vec<Vector3<f64>>,
}

impl Streams<'_> {
    /// The speeds that the model with these parameters predicts.
    pub(super) fn robot_speeds<'s>(&self, scale: &'s Scale, parameters: &[f64]) -> Cow<'s, SpeedProfile> {
        if parameters.iter().all(|p| *p == 0.0) {
            return Cow::Borrowed(&scale.robot);
        }
        let step_s = scale.robot.step_s();
        Cow::Owned(self.speeds((&self.robot, &self.joint_rows), scale, parameters, step_s))
    }

    /// The part of the robot's track that speeds at these times on its clock [s] come from.
    pub(super) fn near(&self, scale: &Scale, at_s: impl Iterator<Item = f64>) -> Near {
        let all = self.robot.thinned(0.0);
        let reached = runs_in_reach(&self.robot.time_s, &all, PATH_WIDTHS * scale.h_s, at_s);
        let (track, rows) = self.robot.of_runs(&reached);
        Near { track, joint_rows: rows.into_iter().map(|row| self.joint_rows[row]).collect() }
    }

    /// The speeds there that the model with these parameters predicts.
    pub(super) fn speeds_near(&self, near: &Near, scale: &Scale, parameters: &[f64]) -> SpeedProfile {
        self.speeds((&near.track, &near.joint_rows), scale, parameters, FINE_STEP * scale.h_s)
    }

    /// Speeds along a track, of which these are the rows in the joint stream.
    fn speeds(
        &self,
        (track, joint_rows): (&Track, &[usize]),
        scale: &Scale,
        parameters: &[f64],
        step_s: f64,
    ) -> SpeedProfile {
        let path_m = predicted_path_m(self.joints, joint_rows, &*self.arm.with(parameters));
        scale.like_robot(track.speeds_of(&path_m, scale.h_s, step_s))
    }

    /// What each uncertain parameter does to the speeds at some times on the robot's clock [s]; none where there are no such
    /// parameters.
    pub(super) fn deviations(
        &self,
        scale: &Scale,
        so_far: &[f64],
        at_s: impl Iterator<Item = f64>,
    ) -> Option<Deviations> {
        if so_far.is_empty() {
            return None;
        }
        let thinned = self.robot.thinned(scale.h_s / TRIED_ROWS);
        let rows = runs_in_reach(&self.robot.time_s, &thinned, scale.h_s, at_s).concat();
        let joint_rows: Vec<usize> = rows.iter().map(|row| self.joint_rows[*row]).collect();
        let (moved, of_row) = where_moved(self.joints, &joint_rows);
        let arm = self.arm.with(so_far);
        let at = |row: &usize| {
            let mut by_m = vec![Vector3::zeros(); so_far.len()];
            let tip_m = arm.motions_m(&self.joints.row_rad(*row), &mut by_m);
            Moved { tip_m, by_m }
        };
        let time_s = rows.iter().map(|row| self.robot.time_s[*row]);
        Some(Deviations {
            so_far: so_far.to_vec(),
            h_s: scale.h_s,
            still_m_s: scale.robot_still_m_s,
            rows: time_s.zip(of_row).collect(),
            moved: moved.par_iter().map(at).collect(),
        })
    }
}

impl Deviations {
    /// Change of the speed at a time per standard deviation of each parameter, as [`SpeedProfile`] smooths it.
    ///
    /// Between two rows the tip goes straight, and its velocity under the kernel `k` is
    /// `v = sum_j (p_j+1 - p_j) / (t_j+1 - t_j) * (K(t_j+1) - K(t_j))` with `K` the integral of `k`. The speed changes as
    /// the velocity does along its own direction. `shares` is room for the positions that count and their factors.
    pub(super) fn rates(&self, t_s: f64, shares: &mut Vec<(usize, f64)>, rates: &mut [f64]) {
        rates.fill(0.0);
        shares.clear();
        let first = self.rows.partition_point(|row| row.0 <= t_s - self.h_s).saturating_sub(1);
        let behind = self.rows[first..].iter().take_while(|row| row.0 < t_s + self.h_s).count();
        let rows = &self.rows[first..(first + behind + 1).min(self.rows.len())];
        for step in rows.windows(2) {
            let ((from_s, from), (to_s, to)) = (step[0], step[1]);
            // Where the arm rests it goes nowhere.
            if from != to {
                let share = (self.passed(to_s - t_s) - self.passed(from_s - t_s)) / (to_s - from_s);
                match shares.last_mut() {
                    Some(last) if last.0 == from => last.1 -= share,
                    _ => shares.push((from, -share)),
                }
                shares.push((to, share));
            }
        }
        let velocity: Vector3<f64> = shares.iter().map(|(at, share)| self.moved[*at].tip_m * *share).sum();
        let speed_m_s = velocity.norm();
        if speed_m_s == 0.0 {
            return;
        }
        let gain = self.still_m_s.map_or(1.0, |still| speed_m_s / (speed_m_s.powi(2) + still.powi(2)));
        let along = velocity * (gain / speed_m_s);
        for (at, share) in shares.iter() {
            let along = along * *share;
            for (rate, by_m) in rates.iter_mut().zip(&self.moved[*at].by_m) {
                *rate += along.dot(by_m);
            }
        }
    }

    /// The part of the kernel that lies before a time from its middle [s].
    fn passed(&self, from_middle_s: f64) -> f64 {
        let u = (from_middle_s / self.h_s).clamp(-1.0, 1.0);
        if u < 0.0 { 0.5 * (1.0 + u).powi(2) } else { 1.0 - 0.5 * (1.0 - u).powi(2) }
    }
}

/// The path that a model predicts of some rows of the joints' readings [m].
pub(super) fn predicted_path_m(
    joints: &JointSamples,
    rows: &[usize],
    arm: &dyn PlacedArm,
) -> Vec<Vector3<f64>> {
    let tip_m = |joint_rad: &mut Vec<f64>, row: &usize| {
        joint_rad.clear();
        joint_rad.extend(joints.joint_rad.iter().map(|column| column[*row]));
        arm.tip_m(joint_rad)
    };
    rows.par_iter().map_init(Vec::new, tip_m).collect()
}

/// Of some rows those that a kernel of half-width `h_s` at any of the times reaches, in runs without others between them.
fn runs_in_reach<'r>(
    time_s: &[f64],
    rows: &'r [usize],
    h_s: f64,
    at_s: impl Iterator<Item = f64>,
) -> Vec<&'r [usize]> {
    let mut reached = vec![false; rows.len()];
    for t_s in at_s {
        let first = rows.partition_point(|row| time_s[*row] <= t_s - h_s).saturating_sub(1);
        let after = rows[first..].iter().take_while(|row| time_s[**row] < t_s + h_s).count();
        reached.iter_mut().skip(first).take(after + 1).for_each(|reached| *reached = true);
    }
    let mut end = 0;
    let runs = reached.chunk_by(|a, b| a == b).map(|run| {
        end += run.len();
        (run[0], &rows[end - run.len()..end])
    });
    runs.filter(|(reached, _)| *reached).map(|(_, rows)| rows).collect()
}

/// Of some rows those at which the arm is not where it was at the one before them, and which of these every row is as.
fn where_moved(joints: &JointSamples, rows: &[usize]) -> (Vec<usize>, Vec<usize>) {
    let (mut moved, mut of_row) = (Vec::new(), Vec::with_capacity(rows.len()));
    let rests = |last: usize, row: usize| {
        joints.joint_rad.iter().all(|column| (column[row] - column[last]).abs() <= RESTING_RAD)
    };
    for &row in rows {
        if moved.last().is_none_or(|last| !rests(*last, row)) {
            moved.push(row);
        }
        of_row.push(moved.len() - 1);
    }
    (moved, of_row)
}
