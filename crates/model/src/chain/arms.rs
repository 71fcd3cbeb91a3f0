//! Several arms in one world: their chains side by side, and what joins their tips.
//!
//! ```text
//! tips in one point:      0 = tip_1(q_1, p_1) - tip_2(q_2, p_2)              3 rows [m]
//! tips on a rigid link:   0 = |tip_1(q_1, p_1) - tip_2(q_2, p_2)| - length   1 row  [m]
//! ```
//!
//! Each arm is the other's reference then, and no camera is needed (Bennett and Hollerbach 1991: autonomous calibration of
//! single-loop closed kinematic chains; Zhuang and Roth 1996, ch. 9).

use super::{Chain, Masses, Source};
use crate::ModelError;
use crate::segment::{Joint, Segment};
use armcal_core::Parameter;
use std::ops::Range;

/// The part of a joined chain that is one arm's.
#[derive(Debug, Clone, PartialEq)]
pub struct Arm {
    /// Its name, the prefix of its parameters and joints: `right.joint1.theta`.
    pub name: String,
    /// The arm by itself.
    pub chain: Chain,
    /// Its parameters among those of all arms.
    pub parameters: Range<usize>,
    /// Its joints among those of all arms.
    pub joints: Range<usize>,
    /// Its segments among those of all arms.
    pub(crate) segments: Range<usize>,
}

impl Chain {
    /// Several arms side by side: their parameters, joints and links one arm behind the other, each named `<arm>.<name>`.
    ///
    /// # Errors
    /// Two arms of one name, a name that cannot be a prefix.
    pub fn joined(arms: Vec<(String, Chain)>) -> Result<Chain, ModelError> {
        check_names(&arms)?;
        let mut all = Chain {
            name: arms.iter().map(|(_, chain)| chain.name.as_str()).collect::<Vec<_>>().join(" and "),
            segments: Vec::new(),
            end: None,
            parameters: Vec::new(),
            joint_names: Vec::new(),
            joint_limits: Vec::new(),
            source: Source::Arms(Vec::new()),
            // Each arm has decided for its own.
            masses: Some(Masses::Urdf),
        };
        let mut parts = Vec::with_capacity(arms.len());
        for (name, chain) in arms {
            let (segments, parameters) = (all.segments.len(), all.parameters.len());
            let joints = all.joint_names.len();
            all.segments
                .extend(chain.weighed().iter().map(|s| s.behind(&name, segments, parameters, joints)));
            let prefixed = |p: &Parameter| Parameter { name: format!("{name}.{}", p.name), ..p.clone() };
            all.parameters.extend(chain.parameters.iter().map(prefixed));
            all.joint_names.extend(chain.joint_names.iter().map(|joint| format!("{name}.{joint}")));
            all.joint_limits.extend(chain.joint_limits.iter().copied());
            parts.push(Arm {
                name,
                parameters: parameters..all.parameters.len(),
                joints: joints..all.joint_names.len(),
                segments: segments..all.segments.len(),
                chain,
            });
        }
        all.source = Source::Arms(parts);
        Ok(all)
    }

    /// The arms that it was joined from; none where it is one arm.
    pub fn arms(&self) -> &[Arm] {
        match &self.source {
            Source::Arms(arms) => arms,
            Source::Dh(_) | Source::Urdf(_) => &[],
        }
    }

    /// One of the arms by itself, and where its parameters are among all; of one arm, that.
    pub fn arm(&self, arm: usize) -> (&Chain, Range<usize>) {
        let own = self.arms().get(arm).map(|arm| (&arm.chain, arm.parameters.clone()));
        own.unwrap_or((self, 0..self.parameters.len()))
    }

    /// The joints that are in one arm with a joint, itself among them.
    pub(crate) fn joints_beside(&self, joint: usize) -> Range<usize> {
        let own = self.arms().iter().find(|arm| arm.joints.contains(&joint));
        own.map_or(0..self.joint_names.len(), |arm| arm.joints.clone())
    }
}

impl Segment {
    /// The same in a longer list, behind so many segments, parameters and joints of other arms.
    fn behind(&self, arm: &str, segments: usize, parameters: usize, joints: usize) -> Segment {
        Segment {
            parent: self.parent.map(|parent| parent + segments),
            frame: self.frame.as_ref().map(|frame| format!("{arm}.{frame}")),
            joint: self.joint.map(|joint| Joint { index: joint.index + joints, ..joint }),
            parameters: self.parameters.start + parameters..self.parameters.end + parameters,
            ..self.clone()
        }
    }
}

fn check_names(arms: &[(String, Chain)]) -> Result<(), ModelError> {
    let bad = |problem: String| Err(ModelError::BadArms { problem });
    for (at, (name, _)) in arms.iter().enumerate() {
        if name.is_empty() || name == "link" || name.contains('.') {
            return bad(format!("an arm cannot be named `{name}`; use a word such as right"));
        }
        if arms[..at].iter().any(|(other, _)| other == name) {
            return bad(format!("both are named `{name}`; give each a name of its own"));
        }
    }
    Ok(())
}
