//! Motion along set-points in joint space, as a controller is told them from outside.

use super::quickly::STEPS_A_ROW;
use super::{Engine, Pace, SHORTEST_SECTION_S, step_count};
use crate::hand::minimum_jerk;
use crate::trace::STEP_S;

/// Peak of the speed of a minimum-jerk move over its mean.
const PEAK_OVER_MEAN: f64 = 1.875;

impl Engine<'_> {
    /// Moves all joints together to set-points [rad], from rest to rest, the one that goes furthest at this speed.
    pub fn drive_joints(&mut self, to_rad: &[f64], speed_rad_s: f64) {
        self.motors_take_over();
        let from = self.set_point_rad.clone();
        let way_rad = from.iter().zip(to_rad).map(|(a, b)| (b - a).abs()).fold(0.0, f64::max);
        let duration_s = (PEAK_OVER_MEAN * way_rad / speed_rad_s).max(SHORTEST_SECTION_S);
        self.command(duration_s, |time_s| {
            let share = minimum_jerk(time_s / duration_s);
            from.iter().zip(to_rad).map(|(a, b)| a + (b - a) * share).collect()
        });
    }

    /// Follows set-points [rad] at their times [s], straight from one to the next. Returns the step of each.
    pub fn follow_joints(&mut self, time_s: &[f64], joint_rad: &[Vec<f64>]) -> Vec<usize> {
        self.motors_take_over();
        let begin = self.trace.len();
        let duration_s = time_s.last().copied().unwrap_or(0.0);
        self.command(duration_s, |now_s| {
            let above = time_s.partition_point(|t| *t <= now_s).clamp(1, time_s.len() - 1);
            let share = (now_s - time_s[above - 1]) / (time_s[above] - time_s[above - 1]);
            let ends = joint_rad[above - 1].iter().zip(&joint_rad[above]);
            ends.map(|(a, b)| a + (b - a) * share.clamp(0.0, 1.0)).collect()
        });
        let (first, last) = (self.trace.time_s[begin], self.trace.len() - 1);
        let step = |t: &f64| self.trace.time_s[begin..].partition_point(|s| s - first < *t) + begin;
        time_s.iter().map(|t| step(t).min(last)).collect()
    }

    fn command(&mut self, duration_s: f64, at: impl Fn(f64) -> Vec<f64>) {
        // How far a joint swings beyond its target decides on which flank of a gap it comes to rest.
        self.swinging = true;
        let steps = step_count(duration_s).max(1);
        if self.pace == Pace::Quick {
            for done in (0..steps).step_by(STEPS_A_ROW) {
                let ahead = (done + STEPS_A_ROW).min(steps);
                let ends = [done, ahead].map(|step| at(step as f64 * STEP_S));
                self.swing(&ends, ahead - done);
            }
            return;
        }
        let steps_a_set_point = self.steps_a_set_point();
        for step in 0..=steps {
            if step % steps_a_set_point == 0 || step == steps {
                self.set_point_rad = at(step as f64 * STEP_S).iter().map(|q| self.counted(*q)).collect();
            }
            self.motor_step();
        }
    }
}
