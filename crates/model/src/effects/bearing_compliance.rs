//! The bearing of a joint that tilts under load.
//!
//! # What moves
//! The moment across the axis of the joint, which its drive does not carry, tilts the links beyond it in their bearing.
//!
//! # Equation
//! `w = c (M - u (u . M))`, M the moment about the joint of all weights beyond it, u its axis; the links from the joint
//! on turn by w about it.
//!
//! # Parameters and units
//! `tilt` c [rad/(N m)] of the links with their default masses; `tilt_outer` the correction for the share of the outer
//! links; `tilt_load` under the load. Prior: 0.3 deg with the nominal arm stretched out.
//!
//! # Signature in the data
//! The links tilt across the axis of the joint, in directions that its own reading cannot correct, most where they reach
//! out sideways.
//!
//! # Not to be confused with
//! `compliance` of the joint, which turns about its axis; `base_compliance`, which is what the bearing of the first
//! joint does, at the height of that joint, and to which that joint is left.
//!
//! # Source
//! Tilting stiffness of bearings: Harris and Kotzalas, Rolling Bearing Analysis; configuration-dependent joint tilting:
//! Patel, thesis, Univ. Adelaide 2017.

use super::frame_shift::pivot_translation_m;
use super::prelude::*;

pub(super) const KIND: EffectKind = EffectKind {
    summary: "the bearing of a joint tilts under the moment across its axis",
    family: Family::Elasticity,
    toggle: Toggle::Load,
    never_negative: &["tilt", "tilt_load"],
    confused_with: &["compliance", "base_compliance", "arm_compliance", "link_bending"],
    place: effect_placement,
    of_a_make: true,
    ..EffectKind::PLAIN
};

#[derive(Debug)]
struct BearingCompliance {
    joint: usize,
    shares: TorqueTerms,
}

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    let joint = context.turning_joint()?;
    if joint == 0 {
        return Err("the bearing of the first joint is base_compliance at its height; use that".to_owned());
    }
    let shares = TorqueTerms::of(context, joint);
    let per_deg = 1f64.to_radians() / context.reference_torque_nm(joint);
    let unit = Unit::RadianPerNewtonMetre;
    let meaning = "tilt per moment across the axis";
    let amplitudes = shares.amplitudes("tilt", unit, 0.3 * per_deg, 6.0 * per_deg, meaning);
    let slot = Slot::Before(context.zero.joints[joint].segment);
    Ok(Placement::twisting(slot, amplitudes, BearingCompliance { joint, shares }))
}

impl Physics for BearingCompliance {
    fn deform<D: Scalar>(&self, theta: &[D], x: &Drivers<'_>, change: &mut Deformation<D>) {
        let (pose, gravity) = (x.pose(), x.gravity_mps2());
        let joint = &pose.joints[self.joint];
        let across = |moment: Vector3<f64>| moment - joint.axis * joint.axis.dot(&moment);
        let links = across(pose.moment_nm(&joint.origin_m, joint.links.clone(), gravity));
        let outer = across(pose.moment_nm(&joint.origin_m, pose.outer(self.joint), gravity));
        let load =
            across(pose.over_loads(x.observation, &joint.links, |at_m, kg| {
                (at_m - joint.origin_m).cross(gravity) * kg
            }));
        let slot = &joint.before;
        let turn = [0, 1, 2].map(|k| {
            let axis = slot.rotation.column(k);
            self.shares.sum(theta, axis.dot(&links), axis.dot(&outer), axis.dot(&load))
        });
        let pivot_m = slot.rotation.tr_mul(&(joint.origin_m - slot.translation_m));
        change.twist(Slot::Before(joint.segment), pivot_translation_m(&pivot_m.map(D::from), turn), turn);
    }
}
