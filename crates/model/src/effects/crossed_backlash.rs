//! Lost motion of one joint that follows the direction of another.
//!
//! # What moves
//! A cable or a belt that runs over another joint is dragged along by it: where that joint came from decides how
//! this one rests.
//!
//! # Equation
//! `dq_j = -(b/2) s_i`. Where the recording shows the path of joint i, the play operator on it: what is dragged along
//! follows joint i until its spring is stronger than the friction, and turns back as slowly. The derivative at b = 0 as in
//! `backlash`.
//!
//! # Parameters and units
//! `width` b [rad] (sliding joint: [m]), negative where j is dragged along with i; `from` i names the joint whose
//! direction counts. The spec names j.
//! Shape `seated` [1], 1 unless said: the share that acts while a cavity holds the tip, negative where a hand led the
//! link there and it lags elsewhere.
//!
//! # Signature in the data
//! The residual enters like a rotation of one joint and flips with the direction of arrival of another.
//!
//! # Not to be confused with
//! `backlash` of either joint: on a single path, where their directions always go together, nothing separates them.
//!
//! # Source
//! Dahl's friction with a sharp slip is the play operator: Visintin, Differential Models of Hysteresis, 1994, ch. III.

use super::play::{BEGUN_DEG, play_displacement};
use super::prelude::*;

pub(super) const KIND: EffectKind = EffectKind {
    aliases: &["cable drag"],
    summary: "lost motion of one joint that follows the direction of another",
    family: Family::LostMotion,
    toggle: Toggle::Direction,
    shapes: &[
        Shape {
            name: "from",
            unit: Unit::One,
            default: None,
            lower: 1.0,
            upper: 64.0,
            meaning: "number of the joint whose direction of arrival counts",
            parameter: false,
            values: Some(other_joints),
        },
        LED,
    ],
    confused_with: &["backlash", "belt_backlash"],
    place: effect_placement,
    lookalikes: &[Lookalikes::LostMotion],
    ..EffectKind::PLAIN
};

/// On longer arms only neighbours are offered.
const FEW_JOINTS: usize = 4;

#[derive(Debug)]
struct CrossedBacklash {
    joint: usize,
    from: usize,
    begun: f64,
    /// Of the unit of j per unit of i, where one of them slides.
    per_unit: f64,
}

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    let joint = context.joint()?;
    let number = context.shape("from").unwrap_or_default();
    let from = (0..context.zero.joints.len())
        .find(|k| (*k + 1) as f64 == number && *k != joint)
        .ok_or_else(|| format!("from = {number} is not the number of another joint"))?;
    let (typical, bound) = (context.joint_size(joint, 0.4), context.joint_size(joint, 8.0));
    let width = amplitude(
        "width",
        context.joint_unit(joint),
        typical,
        bound,
        "difference between the two directions",
    );
    let begun = context.joint_size(from, BEGUN_DEG);
    let per_unit = context.joint_size(joint, 1.0) / context.joint_size(from, 1.0);
    Ok(Placement::new(vec![width], CrossedBacklash { joint, from, begun, per_unit }))
}

fn other_joints(context: &EffectContext<'_>, _observations: &[Observation]) -> Vec<f64> {
    let own = context.spec.target.unwrap_or_default();
    let joints = context.nominal.chain.joints_beside(own);
    let near = |k: &usize| *k != own && (joints.len() <= FEW_JOINTS || k.abs_diff(own) == 1);
    joints.clone().filter(near).map(|k| (k + 1) as f64).collect()
}

impl Physics for CrossedBacklash {
    fn deform<D: Scalar>(&self, theta: &[D], x: &Drivers<'_>, change: &mut Deformation<D>) {
        let width = theta[0] * self.per_unit.recip();
        let dragged =
            play_displacement(width, self.begun, x.path_memory_rad(self.from), x.arrival[self.from]);
        change.joint(self.joint, dragged * self.per_unit);
    }
}
