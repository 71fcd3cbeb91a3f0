//! A link that bends under what it carries.
//!
//! # What moves
//! The link is a beam clamped at its joint; the weight of what follows, and its moment, push its end down and turn
//! it.
//!
//! # Equation
//! Euler-Bernoulli cantilever of length a: `w = (F a^3/3 + M a^2/2)/EI`, `phi = (F a^2/2 + M a)/EI`, F and M the
//! parts across the link; 3/8 of its own weight counts as hanging at its end.
//!
//! # Parameters and units
//! `sag` w [m] of the link held out level with the nominal masses beyond it; `sag_outer` the correction for the
//! moment of the outer links; `sag_load` under a load of 1 kg.
//! Shape `seated` [1], 1 unless said: the share that acts while a cavity holds the tip; 0 where the hand carries the
//! arm there.
//!
//! # Signature in the data
//! The tip sinks with the lever of gravity, and the links beyond it tilt.
//!
//! # Not to be confused with
//! `compliance` of its joint, which is close to it in most poses. Of the last link: the same as `compliance` of the
//! last joint, and left to that.
//!
//! # Source
//! Gere and Timoshenko, Mechanics of Materials, app. G; Klimchik et al., arXiv 1211.5739.

use super::frame_shift::pivot_translation_m;
use super::prelude::*;

pub(super) const KIND: EffectKind = EffectKind {
    summary: "a link bends under what it carries",
    family: Family::Elasticity,
    toggle: Toggle::Load,
    shapes: &[SEATED],
    never_negative: &["sag", "sag_load"],
    confused_with: &["compliance", "belt_compliance", "base_compliance", "hardening_compliance"],
    place: effect_placement,
    lookalikes: &[Lookalikes::Springs],
    ..EffectKind::PLAIN
};

/// Shorter links do not bend by an amount worth an entry.
const SHORTEST_M: f64 = 0.05;
/// Share of its own weight that a cantilever carries at its end.
const OWN_SHARE: f64 = 3.0 / 8.0;

#[derive(Debug)]
struct LinkBending {
    /// The joint of the link, and the one at its end.
    link: usize,
    next: usize,
    shares: TorqueTerms,
    /// Inverse of EI for a sag of 1 m under the nominal masses, and under 1 kg at the tip.
    per_sag: f64,
    per_load_sag: f64,
}

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    let link = context.joint()?;
    let zero = context.zero;
    if zero.outer(link).is_empty() {
        return Err("bending of the last link is the same as compliance of its joint; use that".to_owned());
    }
    let (next, (from, to)) = zero
        .next_joint(link)
        .zip(zero.beam_m(zero.joints[link].links.start))
        .ok_or("its link branches, and each branch bends it in its own way; use compliance of its joint")?;
    let length_m = (to - from).norm();
    if length_m < SHORTEST_M {
        return Err(format!("its link is only {:.0} mm long", length_m * 1e3));
    }
    let gravity = context.gravity_mps2();
    let outer_kg: f64 = zero.outer(link).map(|k| zero.link_mass_kg(k)).sum();
    let own_kg = zero.link_mass_kg(zero.joints[link].links.start);
    let force_n = (outer_kg + OWN_SHARE * own_kg) * gravity;
    let sag =
        |force_n: f64, moment_nm: f64| force_n * length_m.powi(3) / 3.0 + moment_nm * length_m.powi(2) / 2.0;
    let shares = TorqueTerms::of(context, link);
    let amplitudes = shares.amplitudes("sag", Unit::Metre, 1.2e-3, 0.03, "sag of the link held out level");
    let per_sag = 1.0 / sag(force_n, context.reference_torque_nm(next));
    let per_load_sag = 1.0 / sag(gravity, gravity * context.reach_m(next));
    let slot = Slot::Before(zero.joints[next].segment);
    Ok(Placement::twisting(slot, amplitudes, LinkBending { link, next, shares, per_sag, per_load_sag }))
}

impl Physics for LinkBending {
    fn deform<D: Scalar>(&self, theta: &[D], x: &Drivers<'_>, change: &mut Deformation<D>) {
        let pose = x.pose();
        let own = pose.joints[self.link].links.start;
        // Where it was placed, it has one end.
        let Some((from, end)) = pose.beam_m(own) else { return };
        let beam = end - from;
        let gravity = x.gravity_mps2();
        let outer_kg: f64 = pose.outer(self.link).map(|k| pose.link_mass_kg(k)).sum();
        let links_n = gravity * (outer_kg + OWN_SHARE * pose.link_mass_kg(own));
        let links_nm = pose.moment_nm(&end, pose.outer(self.link), gravity);
        // What hangs on the beam itself bends it less than it bends what holds it.
        let loads = |of: &dyn Fn(&Vector3<f64>, f64) -> Vector3<f64>| {
            pose.over_loads(x.observation, &pose.outer(self.link), of)
        };
        let load_n = loads(&|_, kg| gravity * kg);
        let load_nm = loads(&|at_m, kg| (at_m - end).cross(&(gravity * kg)));
        let links = cantilever_deflection(&beam, &links_n, &links_nm).map(|v| v * self.per_sag);
        let outer = cantilever_deflection(&beam, &Vector3::zeros(), &links_nm).map(|v| v * self.per_sag);
        let load = cantilever_deflection(&beam, &load_n, &load_nm).map(|v| v * self.per_load_sag);
        let joint = &pose.joints[self.next];
        let slot = &joint.before;
        let part = |k: usize, axis: usize| {
            let axis = slot.rotation.column(axis);
            self.shares.sum(theta, axis.dot(&links[k]), axis.dot(&outer[k]), axis.dot(&load[k]))
        };
        let turn = [part(1, 0), part(1, 1), part(1, 2)];
        let pivot_m = slot.rotation.tr_mul(&(end - slot.translation_m));
        let back = pivot_translation_m(&pivot_m.map(D::from), turn);
        change.twist(
            Slot::Before(joint.segment),
            [part(0, 0) + back[0], part(0, 1) + back[1], part(0, 2) + back[2]],
            turn,
        );
    }
}

/// Deflection and slope at the end of a clamped beam under a force and a moment there, for EI = 1.
fn cantilever_deflection(
    beam_m: &Vector3<f64>,
    force_n: &Vector3<f64>,
    moment_nm: &Vector3<f64>,
) -> [Vector3<f64>; 2] {
    let a = beam_m.norm();
    // The nominal link never has length zero here; a degenerate pose gives no bending.
    let Some(e) = beam_m.try_normalize(1e-9) else { return [Vector3::zeros(); 2] };
    let force = force_n - e * e.dot(force_n);
    let moment = moment_nm - e * e.dot(moment_nm);
    let deflection = force * (a.powi(3) / 3.0) + moment.cross(&e) * (a * a / 2.0);
    let slope = e.cross(&force) * (a * a / 2.0) + moment * a;
    [deflection, slope]
}
