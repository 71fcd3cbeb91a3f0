//! Motion led by a hand: the links move, and the motors follow through the gears.

use super::{Engine, Pace, QUICK_REST_STEPS, QUICK_STEP_S, SHORTEST_SECTION_S, step_count};
use crate::LabError;
use crate::hand::minimum_jerk;
use crate::trace::{Rest, STEP_S};
use nalgebra::{Point3, Vector3};

impl Engine<'_> {
    /// Leads the tip by hand to a point on the board [m, board frame], tremor growing or fading on the way from
    /// one size to the other [m].
    pub fn guide(
        &mut self,
        to_board_m: Vector3<f64>,
        duration_s: f64,
        tremor_m: [f64; 2],
        what: &str,
    ) -> Result<(), LabError> {
        self.driven_by_hand = true;
        let world_from_tip = self.world_from_base * Point3::from(self.arm.tip(&self.link_rad));
        let from_board_m = self.world_from_board.inverse_transform_point(&world_from_tip).coords;
        let (steps, step_s) = self.hand_steps(duration_s, QUICK_STEP_S);
        for step in 1..=steps {
            let share = step as f64 / steps as f64;
            let way = from_board_m.lerp(&to_board_m, minimum_jerk(share));
            // The tip is where the hand took it over: its tremor cannot begin with a jump.
            let grip = (step as f64 * step_s / 0.05).min(1.0);
            let size = tremor_m[0] + (tremor_m[1] - tremor_m[0]) * share;
            let shake = self.tremor.sample() * if self.config.hand.motors_lead { 0.0 } else { size * grip };
            self.hand_step(&(way + shake), step_s, what)?;
        }
        Ok(())
    }

    /// Leads the arm by hand to joint angles [rad], link side, and holds it there.
    pub fn lead_to_pose(&mut self, joint_rad: &[f64], speed_m_s: f64, hold_s: f64, rest: Rest) {
        self.driven_by_hand = true;
        let from = self.link_rad.clone();
        let way_m = (self.arm.tip(joint_rad) - self.arm.tip(&from)).norm();
        let (steps, step_s) =
            self.hand_steps((1.9 * way_m / speed_m_s).max(SHORTEST_SECTION_S), QUICK_STEP_S);
        for step in 1..=steps {
            let share = minimum_jerk(step as f64 / steps as f64);
            let link = from.iter().zip(joint_rad).map(|(a, b)| a + (b - a) * share).collect();
            self.lead_step(link, step_s);
        }
        let first = self.trace.len();
        let (steps, step_s) = self.hand_steps(hold_s, hold_s / QUICK_REST_STEPS as f64);
        (0..steps).for_each(|_| self.lead_step(joint_rad.to_vec(), step_s));
        self.note(Some(rest), first);
    }

    /// Lets the tip rest at a point on the board [m, board frame], and notes the rest.
    pub fn rest_by_hand(
        &mut self,
        at_board_m: Vector3<f64>,
        duration_s: f64,
        tremor_m: f64,
        rest: Rest,
        what: &str,
    ) -> Result<(), LabError> {
        let first = self.trace.len();
        // One position stands for many: tremor has averaged out.
        let left = if self.pace == Pace::Quick {
            (self.config.hand.tremor_s / duration_s).min(1.0).sqrt()
        } else {
            1.0
        };
        let (steps, step_s) = self.hand_steps(duration_s, duration_s / QUICK_REST_STEPS as f64);
        for _ in 0..steps {
            let shake =
                self.tremor.sample() * if self.config.hand.motors_lead { 0.0 } else { tremor_m * left };
            self.hand_step(&(at_board_m + shake), step_s, what)?;
        }
        self.note(Some(rest), first);
        Ok(())
    }

    /// How many steps a movement of the hand takes, and how long each.
    fn hand_steps(&self, duration_s: f64, quick_s: f64) -> (usize, f64) {
        match self.pace {
            Pace::Full => (step_count(duration_s).max(1), STEP_S),
            Pace::Quick => {
                let count = (duration_s / quick_s).round().max(1.0);
                (count as usize, duration_s / count)
            }
        }
    }

    fn hand_step(&mut self, to_board_m: &Vector3<f64>, step_s: f64, what: &str) -> Result<(), LabError> {
        self.pass(step_s);
        let world = self.world_from_board * Point3::from(*to_board_m);
        let target = self.world_from_base.inverse_transform_point(&world).coords;
        let link = self
            .arm
            .solve(&target, &self.link_rad)
            .map_err(|miss| self.unreachable("true", what, miss.short_by_m))?;
        self.hand_turns_motors(link, step_s);
        Ok(())
    }

    fn lead_step(&mut self, link_rad: Vec<f64>, step_s: f64) {
        self.pass(step_s);
        self.hand_turns_motors(link_rad, step_s);
    }

    fn hand_turns_motors(&mut self, link_rad: Vec<f64>, step_s: f64) {
        self.link_rad = link_rad;
        let mut motor = self.link_rad.clone();
        let mut mechanisms = std::mem::take(&mut self.mechanisms);
        mechanisms.iter_mut().rev().for_each(|m| m.link_to_motor(&self.moment(), &mut motor));
        self.mechanisms = mechanisms;
        self.servo.follow(&motor, step_s);
        self.record();
        self.set_point_rad = self.reading_rad.clone();
    }
}
