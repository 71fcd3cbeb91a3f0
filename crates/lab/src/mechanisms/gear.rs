//! A transmission that is not quite proportional: the motor leads the link by an angle that depends on where
//! the link is.

use crate::mechanism::Named;
use crate::{Mechanism, RigState};

/// The shape of a transmission's error.
pub(super) trait Lead: Named + std::fmt::Debug + Send {
    /// The joint, from 1.
    fn joint(&self) -> usize;

    /// Whether it is the reading that is off, and motor and link agree.
    fn of_reading(&self) -> bool {
        false
    }

    /// Motor less link (reading less motor) where the link is at `link_rad` [rad].
    fn lead_rad(&self, link_rad: f64) -> f64;

    /// The link's angle for a motor's: the error changes slowly with the angle, so the fixed point is near.
    fn link_rad(&self, motor_rad: f64) -> f64 {
        let mut link = motor_rad;
        for _ in 0..100 {
            let next = motor_rad - self.lead_rad(link);
            if (next - link).abs() < 1e-14 {
                return next;
            }
            link = next;
        }
        link
    }
}

impl<L: Lead> Mechanism for L {
    fn motor_to_link(&mut self, _now: &RigState<'_>, joint_rad: &mut [f64]) {
        let q = &mut joint_rad[self.joint() - 1];
        if !self.of_reading() {
            *q = self.link_rad(*q);
        }
    }

    fn link_to_motor(&mut self, _now: &RigState<'_>, joint_rad: &mut [f64]) {
        let q = &mut joint_rad[self.joint() - 1];
        if !self.of_reading() {
            *q += self.lead_rad(*q);
        }
    }

    fn distort_encoder(&self, _now: &RigState<'_>, reading_rad: &mut [f64]) {
        let q = &mut reading_rad[self.joint() - 1];
        if self.of_reading() {
            *q += self.lead_rad(*q);
        }
    }
}
