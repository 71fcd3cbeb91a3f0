//! What is drawn of joints, and of which.

use crate::findings::Findings;
use armcal_result::analysis::moves_tip;
use armcal_result::proto::JointErrors;

/// What is drawn of a joint, split by direction of arrival.
#[derive(Clone, Copy)]
pub(super) enum What {
    /// Of the calibrated model.
    Error,
    /// With everything found.
    After,
    /// What the effects found do.
    Effect,
}

impl What {
    /// All directions together, for the scale.
    pub fn whole(self, m: &JointErrors) -> &[f64] {
        match self {
            What::Error => &m.error,
            What::After => &m.error_after,
            What::Effect => &m.effect,
        }
    }

    pub fn words(self) -> &'static str {
        match self {
            What::Error => "",
            What::After => " rest",
            What::Effect => " effects",
        }
    }

    pub fn suffix(self) -> &'static str {
        match self {
            What::Error => "",
            What::After => "_after",
            What::Effect => "_effect",
        }
    }
}

/// The joints that move the tip.
pub(super) fn tip_moving_joints(f: &Findings) -> impl Iterator<Item = &JointErrors> {
    f.joints.iter().filter(|m| moves_tip(&m.unit, m.error.iter().copied()))
}
