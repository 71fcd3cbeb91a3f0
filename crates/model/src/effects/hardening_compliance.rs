//! A joint whose spring is not linear.
//!
//! # What moves
//! As in `compliance`, but soft under small torque and stiffer under large (or the other way round), as harmonic
//! drives are.
//!
//! # Equation
//! `dq = c tau + a (tau/T)^3 + b (tau/T)^5`, T the gravity torque of the nominal arm stretched out: the spring
//! `tau = k x + h x^3` turned round, as far as a series follows it.
//!
//! # Parameters and units
//! `compliance`, `compliance_outer`, `compliance_load` [rad/(N m)] as in `compliance`; `cubic` a [rad], negative
//! where the joint hardens; `quintic` b [rad], which then turns back.
//! Shape `seated` [1], 1 unless said: the share that acts while a cavity holds the tip; 0 where the hand carries the
//! arm there.
//!
//! # Signature in the data
//! A sag whose growth with the lever of gravity bends over.
//!
//! # Not to be confused with
//! `compliance`, its special case a = b = 0; `gravity_backlash`, the extreme soft zone.
//!
//! # Source
//! Adv. Mech. Eng. 2015, 10.1177/1687814015590289 (piecewise linear joint compliance).

use super::prelude::*;

pub(super) const KIND: EffectKind = EffectKind {
    summary: "a joint yields to gravity like a spring that is not linear",
    family: Family::Elasticity,
    toggle: Toggle::Load,
    shapes: &[SEATED],
    confused_with: &["compliance", "gravity_backlash"],
    place: effect_placement,
    lookalikes: &[Lookalikes::Springs],
    ..EffectKind::PLAIN
};

#[derive(Debug)]
struct HardeningCompliance {
    joint: usize,
    shares: TorqueTerms,
    /// Index of the cubic amplitude; the quintic one follows.
    cubic: usize,
    per_torque: f64,
}

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    let joint = context.turning_joint()?;
    context.loaded(joint)?;
    let shares = TorqueTerms::of(context, joint);
    let deg = 1f64.to_radians();
    let per_torque = 1.0 / context.reference_torque_nm(joint);
    let (typical, bound) = (0.4 * deg * per_torque, 8.0 * deg * per_torque);
    let mut amplitudes = shares.amplitudes(
        "compliance",
        Unit::RadianPerNewtonMetre,
        typical,
        bound,
        "angle per gravity torque",
    );
    let cubic = amplitudes.len();
    let meaning = "cubic part of the angle with the nominal arm stretched out";
    amplitudes.push(amplitude("cubic", Unit::Radian, 0.2 * deg, 8.0 * deg, meaning));
    let meaning = "part of the angle of fifth power with the nominal arm stretched out";
    amplitudes.push(amplitude("quintic", Unit::Radian, 0.1 * deg, 8.0 * deg, meaning));
    Ok(Placement::new(amplitudes, HardeningCompliance { joint, shares, cubic, per_torque }))
}

impl Physics for HardeningCompliance {
    fn deform<D: Scalar>(&self, theta: &[D], x: &Drivers<'_>, change: &mut Deformation<D>) {
        let torque = &x.torque()[self.joint];
        let relative = torque.total_nm() * self.per_torque;
        let bent = theta[self.cubic] * relative.powi(3) + theta[self.cubic + 1] * relative.powi(5);
        change.joint(self.joint, self.shares.torque(theta, torque) + bent);
    }
}
