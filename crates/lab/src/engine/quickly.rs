//! Motion under motor control on the quick path.

use super::{Engine, QUICK_REST_STEPS, QUICK_STEP_S};
use crate::LabError;
use crate::spline::Path;
use crate::trace::STEP_S;

/// Steps of the motors for each row that is recorded while they swing.
pub(super) const STEPS_A_ROW: usize = 10;

/// After this a swing has died away [s].
const SETTLED_S: f64 = 0.5;

impl Engine<'_> {
    /// Follows a path on the quick path: the motors are where the plan has them.
    pub(super) fn follow(&mut self, path: &Path, what: &str) -> Result<(), LabError> {
        if self.swinging {
            return self.swing_along(path, what);
        }
        let duration_s = ((path.duration_s() / STEP_S).ceil() + 1.0) * STEP_S;
        let steps = (duration_s / (2.0 * QUICK_STEP_S)).ceil().max(2.0) as usize;
        let mut planned_rad = self.set_point_rad.clone();
        for step in 1..=steps {
            let share = step as f64 / steps as f64;
            let Some(wanted) = path.position(share * path.duration_s()) else { continue };
            planned_rad = self
                .rig
                .nominal
                .solve(&wanted, &planned_rad)
                .map_err(|miss| self.unreachable("nominal", what, miss.short_by_m))?;
            self.set_point_rad = planned_rad.iter().map(|q| self.counted(*q)).collect();
            self.quick_motor_step(duration_s / steps as f64);
        }
        Ok(())
    }

    /// Follows a path under control: set-points between positions of the plan, one row a few steps of the motors.
    fn swing_along(&mut self, path: &Path, what: &str) -> Result<(), LabError> {
        let steps = (path.duration_s() / STEP_S).ceil() as usize + 1;
        let mut planned_rad = [self.set_point_rad.clone(), self.set_point_rad.clone()];
        let mut done = 0;
        while done < steps {
            let ahead = (done + STEPS_A_ROW).min(steps);
            let Some(wanted) = path.position(ahead as f64 * STEP_S) else { break };
            let next = self
                .rig
                .nominal
                .solve(&wanted, &planned_rad[1])
                .map_err(|miss| self.unreachable("nominal", what, miss.short_by_m))?;
            planned_rad = [std::mem::take(&mut planned_rad[1]), next];
            self.swing(&planned_rad, ahead - done);
            done = ahead;
        }
        Ok(())
    }

    /// Holds under control: the swing dies away, then nothing moves, from the step that is returned on.
    pub(super) fn quick_hold(&mut self, duration_s: f64) -> usize {
        let mut left_s = duration_s;
        let settling_s = if self.swinging { SETTLED_S.min(duration_s / 2.0) } else { 0.0 };
        while self.swinging && duration_s - left_s < settling_s {
            let hold = [self.set_point_rad.clone(), self.set_point_rad.clone()];
            self.swing(&hold, STEPS_A_ROW);
            left_s -= STEPS_A_ROW as f64 * STEP_S;
        }
        let first = self.trace.len();
        for _ in 0..QUICK_REST_STEPS {
            self.quick_motor_step(left_s / QUICK_REST_STEPS as f64);
        }
        first
    }

    /// Lets the motors follow set-points that go from one position to another, and records where that leads.
    pub(super) fn swing(&mut self, [from, to]: &[Vec<f64>; 2], steps: usize) {
        let off: Vec<f64> = self.reading_rad.iter().zip(&self.servo.angle_rad).map(|(r, m)| r - m).collect();
        for step in 1..=steps {
            let share = step as f64 / steps as f64;
            let set: Vec<f64> = from.iter().zip(to).map(|(a, b)| self.counted(a + (b - a) * share)).collect();
            let angles = self.servo.angle_rad.iter().zip(&off);
            let reading: Vec<f64> = angles.map(|(motor, off)| self.counted(motor + off)).collect();
            self.servo.step(&set, &reading, &self.gravity_nm, STEP_S);
            self.set_point_rad = set;
        }
        self.pass(steps as f64 * STEP_S);
        self.motors_turn_links();
        self.record();
    }

    /// The motors stand where the encoders read the set-points.
    pub(super) fn quick_motor_step(&mut self, step_s: f64) {
        self.pass(step_s);
        let mut motor = self.set_point_rad.clone();
        // What the encoders add to the motors' angles is small and smooth: the fixed point is near.
        for _ in 0..if self.mechanisms.is_empty() { 0 } else { 8 } {
            let mut reading = motor.clone();
            self.mechanisms.iter().for_each(|m| m.distort_encoder(&self.moment(), &mut reading));
            for (motor, (set, read)) in motor.iter_mut().zip(self.set_point_rad.iter().zip(&reading)) {
                *motor += set - read;
            }
        }
        self.servo.follow(&motor, step_s);
        self.motors_turn_links();
        self.record();
    }
}
