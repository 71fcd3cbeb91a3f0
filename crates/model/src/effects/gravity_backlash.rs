//! Backlash of a joint whose gap gravity closes.
//!
//! # What moves
//! Gravity presses the link against one flank of the gap, whichever way the motor turns; only where drag exceeds
//! the gravity torque does the direction of arrival decide.
//!
//! # Equation
//! `dq = -(b/2) tanh((F s - tau/T) / e)`, T the gravity torque of the nominal arm stretched out, F the drag and e
//! the smoothing as fractions of it; the part of tau that the outer links cause counts r times. F = 0: gravity alone
//! decides.
//!
//! # Parameters and units
//! `width` b [rad]; shapes `friction` F [1], `smoothing` e [1], `outer` r [1]: nobody knows the masses, and where the
//! torque changes sign depends on their ratio.
//! Shape `seated` [1], 1 unless said: the share that acts while a cavity holds the tip; 0 where the hand carries the
//! arm there. Where it is between -1 and 1, nothing holds the joint on a flank there: it rests anywhere in its gap, with
//! variance `(b/2)^2 (1 - seated^2) / 3`, noise of these dwells.
//! Shape `rest` [1], 0 unless said: the part r of its gap in which the joint rests anywhere in every dwell, with variance
//! `(r b/2)^2 / 3`.
//!
//! # Signature in the data
//! A jump where the gravity torque of the joint changes sign, a constant elsewhere: with one sign of torque it is
//! the zero of the joint.
//!
//! # Not to be confused with
//! `backlash`, which flips with the direction; `compliance`, which grows with the torque.
//!
//! # Source
//! Contact torque of a gap with friction, notes of the project (eq. 4); Slamani, Bonev 2012.

use super::prelude::*;

pub(super) const KIND: EffectKind = EffectKind {
    summary: "play whose flank gravity chooses",
    family: Family::LostMotion,
    toggle: Toggle::Load,
    shapes: &[
        Shape {
            name: "friction",
            unit: Unit::One,
            default: Some(0.0),
            lower: 0.0,
            upper: 10.0,
            meaning: "drag as a fraction of the largest gravity torque",
            parameter: true,
            values: Some(friction_values),
        },
        Shape {
            name: "smoothing",
            unit: Unit::One,
            default: Some(0.05),
            lower: 1e-3,
            upper: 10.0,
            meaning: "width of the change of flank as a fraction of the largest gravity torque",
            parameter: true,
            values: Some(smoothing_values),
        },
        Shape {
            name: "outer",
            unit: Unit::One,
            default: Some(1.0),
            lower: 0.1,
            upper: 10.0,
            meaning: "weight of the outer links relative to their default masses",
            parameter: true,
            values: Some(outer_weight_values),
        },
        SEATED,
        REST,
    ],
    never_negative: &["width"],
    confused_with: &["backlash", "compliance", "arm_compliance"],
    place: effect_placement,
    lookalikes: &[Lookalikes::LostMotion],
    ..EffectKind::PLAIN
};

#[derive(Debug)]
struct GravityBacklash {
    joint: usize,
    per_torque: f64,
}

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    let joint = context.joint()?;
    context.loaded(joint)?;
    let (typical, bound) = (context.joint_size(joint, 0.5), context.joint_size(joint, 8.0));
    let width = amplitude("width", context.joint_unit(joint), typical, bound, "width of the gap");
    let per_torque = 1.0 / context.reference_torque_nm(joint);
    Ok(Placement::new(vec![width], GravityBacklash { joint, per_torque }))
}

fn friction_values(_placing: &EffectContext<'_>, _observations: &[Observation]) -> Vec<f64> {
    vec![0.05, 0.1, 0.2, 0.3, 0.5]
}

/// A rigid gap changes flanks at once; the default allows for masses that nobody knows.
fn smoothing_values(_placing: &EffectContext<'_>, _observations: &[Observation]) -> Vec<f64> {
    vec![0.01]
}

/// The last joint has no outer links.
fn outer_weight_values(context: &EffectContext<'_>, _observations: &[Observation]) -> Vec<f64> {
    match context.spec.target {
        Some(joint) if context.zero.joints.get(joint).is_some_and(|j| j.links.len() > 1) => {
            vec![0.5, 0.65, 0.8, 1.25, 1.5, 2.0, 3.0]
        }
        _ => Vec::new(),
    }
}

impl Physics for GravityBacklash {
    fn deform<D: Scalar>(&self, theta: &[D], x: &Drivers<'_>, change: &mut Deformation<D>) {
        let [width, friction, smoothing, outer] = [theta[0], theta[1], theta[2], theta[3]];
        let torque = &x.torque()[self.joint];
        let load = (outer * torque.outer_nm + (torque.total_nm() - torque.outer_nm)) * self.per_torque;
        let contact = (friction * x.arrival[self.joint] - load) / smoothing;
        change.joint(self.joint, width * contact.tanh() * -0.5);
    }

    fn gap(&self, theta: &[f64]) -> Option<(usize, f64)> {
        Some((self.joint, theta[0]))
    }
}
