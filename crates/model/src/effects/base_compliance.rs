//! A base that rocks.
//!
//! # What moves
//! The foot, the plate under it or the table tilts under the overturning moment of the arm.
//!
//! # Equation
//! `w = c M`, M the moment of all weights about the origin of the base; the arm turns by w about the point (0, 0, h) of
//! the base: its foot, or the bearing of the first joint.
//!
//! # Parameters and units
//! `compliance` c [rad/(N m)] of the links with their default masses, `compliance_outer` the correction for the share
//! of the outer links, `compliance_load` under the load; shape `height` h [m], 0 unless said. Prior: 0.3 deg with the
//! nominal arm stretched out.
//! Shape `seated` [1], 1 unless said: the share that acts while a cavity holds the tip; 0 where the hand carries the
//! arm there.
//!
//! # Signature in the data
//! The tip sinks towards where the arm reaches out, as with a compliant shoulder whose pivot lies lower.
//!
//! # Not to be confused with
//! `compliance` of the shoulder: they differ only by the height of the pivot; a marker on the base separates them.
//!
//! # Source
//! Notes of the project; ISO 9283 asks for a rigid mounting.

use super::frame_shift::pivot_translation_m;
use super::prelude::*;

pub(super) const KIND: EffectKind = EffectKind {
    summary: "the base rocks under the weight of the arm",
    family: Family::Elasticity,
    toggle: Toggle::Load,
    target: Target::Whole,
    shapes: &[
        Shape {
            name: "height",
            unit: Unit::Metre,
            default: Some(0.0),
            lower: -2.0,
            upper: 5.0,
            meaning: "height of the pivot above the origin of the base",
            parameter: true,
            values: Some(pivot_heights_m),
        },
        SEATED,
        ARM,
    ],
    never_negative: &["compliance", "compliance_load"],
    confused_with: &["compliance", "belt_compliance", "link_bending", "hardening_compliance"],
    place: effect_placement,
    told_by: "put a marker on the robot's base: it moves only if the base gives way",
    ..EffectKind::PLAIN
};

/// Links from this one on count as outer.
const OUTER: usize = 2;

#[derive(Debug)]
struct BaseCompliance {
    arm: usize,
    shares: TorqueTerms,
}

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    let arm = context.arm()?;
    let joints = context.zero.joints_of(arm);
    let shares = TorqueTerms::of(context, joints.start + OUTER.min(joints.len()) - 1);
    let largest = joints.map(|joint| context.reference_torque_nm(joint)).fold(1e-3, f64::max);
    let per_deg = 1f64.to_radians() / largest;
    let unit = Unit::RadianPerNewtonMetre;
    let amplitudes =
        shares.amplitudes("compliance", unit, 0.3 * per_deg, 6.0 * per_deg, "tilt per overturning moment");
    Ok(Placement::twisting(Slot::Behind(arm), amplitudes, BaseCompliance { arm, shares }))
}

/// Between the foot and the axis of the second joint.
fn pivot_heights_m(context: &EffectContext<'_>, _observations: &[Observation]) -> Vec<f64> {
    let Ok(arm) = context.arm() else { return Vec::new() };
    let Some(second) = context.zero.joints_of(arm).nth(1) else { return Vec::new() };
    let (second, base) = (&context.zero.joints[second], &context.zero.bases[arm]);
    let height_m = base.rotation.column(2).dot(&(second.origin_m - base.translation_m));
    [0.5, 1.0].iter().map(|part| part * height_m).filter(|height| *height > 0.0).collect()
}

impl Physics for BaseCompliance {
    fn deform<D: Scalar>(&self, theta: &[D], x: &Drivers<'_>, change: &mut Deformation<D>) {
        let base = &x.pose().bases[self.arm];
        let (gravity, all) = (x.gravity_mps2(), x.pose().links_of(self.arm));
        let links = x.pose().moment_nm(&base.translation_m, all.clone(), gravity);
        let outer =
            x.pose().moment_nm(&base.translation_m, (all.start + OUTER).min(all.end)..all.end, gravity);
        let load = x
            .pose()
            .over_loads(x.observation, &all, |at_m, kg| (at_m - base.translation_m).cross(gravity) * kg);
        let turn = [0, 1, 2].map(|k| {
            let axis = base.rotation.column(k);
            self.shares.sum(theta, axis.dot(&links), axis.dot(&outer), axis.dot(&load))
        });
        let pivot_m = Vector3::new(D::from(0.0), D::from(0.0), theta[self.shares.count()]);
        change.twist(Slot::Behind(self.arm), pivot_translation_m(&pivot_m, turn), turn);
    }
}
