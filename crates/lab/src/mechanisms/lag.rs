//! A joint that approaches what drives it exponentially, as behind a viscous coupling or a soft servo; led by a hand, the
//! encoder approaches it, as behind a filter.
//!
//! Where motors jog the tip to a place, they wait until it is there.

use super::*;

/// `kind = "lag"`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lag {
    /// The joint.
    pub joint: usize,
    /// Time in which the way that is left shrinks to a third (1/e) [s].
    pub time_constant_s: f64,
    /// When, and where the side that follows was then [s, rad].
    #[serde(skip)]
    pub(crate) before: Option<[f64; 2]>,
}

impl Lag {
    /// Where the follower of `leader_rad` is by now.
    fn follow(&mut self, now: &RigState<'_>, leader_rad: f64) -> f64 {
        let [time_s, follower_rad] = self.before.unwrap_or([now.time_s, leader_rad]);
        let left = (-(now.time_s - time_s) / self.time_constant_s).exp();
        let follower_rad = leader_rad + (follower_rad - leader_rad) * left;
        self.before = Some([now.time_s, follower_rad]);
        follower_rad
    }
}

impl Mechanism for Lag {
    fn motor_to_link(&mut self, now: &RigState<'_>, joint_rad: &mut [f64]) {
        joint_rad[self.joint - 1] = self.follow(now, joint_rad[self.joint - 1]);
    }

    fn link_to_motor(&mut self, now: &RigState<'_>, joint_rad: &mut [f64]) {
        let link_rad = joint_rad[self.joint - 1];
        if now.motors_lead {
            self.before = Some([now.time_s, link_rad]);
        } else {
            joint_rad[self.joint - 1] = self.follow(now, link_rad);
        }
    }
}

impl Hidden for Lag {
    fn check(&self, keys: &Keys) -> Result<(), LabError> {
        keys.joint("joint", self.joint)?;
        keys.stiff("time_constant_s", self.time_constant_s)
    }
}
