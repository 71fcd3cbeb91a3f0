//! Two axes that should be parallel and are not.
//!
//! # What moves
//! The axis of a joint is tilted against the one before it, about the direction that a DH row between parallel axes
//! cannot describe.
//!
//! # Equation
//! `Ry(b)` before the joint: Hayati's beta of the row before it.
//!
//! # Parameters and units
//! `beta` b [rad].
//!
//! # Signature in the data
//! A constant tilt of everything beyond the joint: it turns with the joints before it, not with its own.
//!
//! # Not to be confused with
//! `eccentricity` and `second_harmonic` of the neighbours in a narrow range. A chain whose rows have beta, or a
//! URDF, contains it already.
//!
//! # Source
//! Hayati and Mirmirani 1985 (J. Robotic Systems 2:4).

use super::prelude::*;
use crate::segment::Geometry;

pub(super) const KIND: EffectKind = EffectKind {
    aliases: &["axis not parallel (Hayati beta)"],
    summary: "an axis is not parallel to the one before it",
    family: Family::Geometry,
    confused_with: &["eccentricity", "second_harmonic", "gear_ratio", "belt_coupling"],
    place: effect_placement,
    ..EffectKind::PLAIN
};

#[derive(Debug)]
struct AxisTilt {
    slot: Slot,
}

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    let joint = context.turning_joint()?;
    context
        .parallel_to_previous(joint)
        .ok_or("its axis is not parallel to the one before it, so the chain describes every small tilt")?;
    let segment = context.zero.joints[joint].segment;
    let slot = Slot::Before(segment);
    let tree = &context.nominal.tree.0;
    let described = match tree[segment].parent.map(|before| &tree[before].geometry) {
        Some(Geometry::StandardDh { hayati } | Geometry::ModifiedDh { hayati }) => *hayati,
        Some(Geometry::Origin { .. } | Geometry::Axis(_)) | None => true,
    };
    if described {
        return Err("the chain has this tilt among its own parameters; free them".to_owned());
    }
    let deg = 1f64.to_radians();
    let beta =
        amplitude("beta", Unit::Radian, 0.6 * deg, 10.0 * deg, "tilt about y of the row before the joint");
    Ok(Placement::twisting(slot, vec![beta], AxisTilt { slot }))
}

impl Physics for AxisTilt {
    fn deform<D: Scalar>(&self, theta: &[D], _x: &Drivers<'_>, change: &mut Deformation<D>) {
        let o = D::from(0.0);
        change.twist(self.slot, [o, o, o], [o, theta[0], o]);
    }
}
