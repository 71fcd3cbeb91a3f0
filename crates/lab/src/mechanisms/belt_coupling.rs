//! A belt that runs around another joint's axis: where the two pulleys there differ, turning that joint pulls
//! the belt, and the joint it drives turns along.

use super::*;

/// `kind = "belt_coupling"`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BeltCoupling {
    /// The joint that is dragged along. Default 3.
    #[serde(default = "three")]
    pub joint: usize,
    /// The joint that drags. Default 2.
    #[serde(default = "two")]
    pub by: usize,
    /// How far one turns for a turn of the other [%]: the difference of the pulleys' radii.
    pub share_percent: f64,
}

fn three() -> usize {
    3
}

fn two() -> usize {
    2
}

impl Mechanism for BeltCoupling {
    fn ahead(&mut self, _now: &RigState<'_>, joint_rad: &[f64]) -> Option<(usize, f64)> {
        Some((self.joint, joint_rad[self.by - 1] * self.share_percent / 100.0))
    }
}

impl Hidden for BeltCoupling {
    fn check(&self, keys: &Keys) -> Result<(), LabError> {
        keys.joint("joint", self.joint)?;
        keys.joint("by", self.by)?;
        if self.by == self.joint {
            return Err(keys.wrong("by", "must be another joint".into()));
        }
        keys.within("share_percent", self.share_percent, [-100.0, 100.0])
    }
}
