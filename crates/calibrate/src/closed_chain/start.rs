//! Where the base that nobody knows starts: the pose that brings the tips together with both arms at nominal.

use super::{ClosedChain, ClosedObservation, is_of_base};
use crate::CalibrateError;
use crate::rigid_fit::{Pair, rigid_fit};
use armcal_core::Role;

impl ClosedChain {
    /// Lets an estimated base start where the nominal arms close the chain best: the robust rigid motion of one arm's
    /// tips onto the other's (Kabsch 1976). A link's direction is unknown, so that its length is ignored: the start is
    /// off by as much, which the fit makes up for.
    ///
    /// # Errors
    /// Effects already placed on that arm, which would keep the base they know.
    pub fn place_bases(&mut self, observations: &[ClosedObservation]) -> Result<(), CalibrateError> {
        for arm in [0, 1] {
            let model = &self.arms[arm].model;
            let estimated = |role: Role| role == Role::EstimatedFrame;
            if !model.parameters().iter().any(|p| p.free && is_of_base(p) && estimated(p.role)) {
                continue;
            }
            if model.parameters().iter().any(|p| p.role == Role::Effect) {
                let problem = format!("place the base of {} before its effects", self.arms[arm].name);
                return Err(CalibrateError::ClosedChain { problem });
            }
            let (p, other) = (self.nominal(), 1 - arm);
            let pairs: Vec<Pair> = observations
                .iter()
                .map(|o| {
                    let of_other = &self.arms[other].model;
                    let here = model.tip_in_base(self.of_arm(arm, &p), &o.arms[arm].joint_rad);
                    let there = of_other.predicted_tip_in_world(self.of_arm(other, &p), &o.arms[other]);
                    Pair { from: here.translation.vector, to: there }
                })
                .collect();
            let current = model.base_in_world(self.of_arm(arm, &p));
            self.arms[arm].model.set_base_start(rigid_fit(&pairs, &current, true));
        }
        *self = ClosedChain::new(self.arms.clone(), self.closure)?;
        Ok(())
    }
}
