//! A drive wound up by friction that grows with its load.
//!
//! # What moves
//! The gear drags in proportion to the torque it carries, and its compliance winds up by that drag, against the
//! direction of arrival.
//!
//! # Equation
//! `dq = -c |tau| s`, `c = mu / K`: the drive sticks until the shaft is wound up by `c |tau|`, and slips then. Where the
//! recording shows the path of the encoder, the play operator on it with the width `2 c |tau|` of the pose at rest.
//! Narrow and negative widths as in `backlash`.
//!
//! # Parameters and units
//! `windup` c [rad/(N m)] of the links with their default masses; `windup_outer` the correction for the share of
//! the outer links; `windup_load` under the load. Prior: 0.4 deg with the nominal arm stretched out.
//! Shape `seated` [1], 1 unless said: the share that acts while a cavity holds the tip, negative where a hand led the
//! link there and it lags elsewhere.
//!
//! # Signature in the data
//! The residual flips with the direction of arrival, most where the arm is stretched out or loaded.
//!
//! # Not to be confused with
//! `backlash`, which does not depend on load: where |tau| hardly varies, the two look alike; repeat with a load.
//!
//! # Source
//! Armstrong-Helouvry, Dupont, Canudas de Wit 1994 (Automatica 30:7): stick and slip;
//! Visintin, Differential Models of Hysteresis, 1994, ch. III: the play operator.

use super::play::{BEGUN_DEG, led_play_displacement};
use super::prelude::*;

pub(super) const KIND: EffectKind = EffectKind {
    summary: "a drive wound up by friction that grows with load",
    family: Family::LostMotion,
    toggle: Toggle::Direction,
    shapes: &[LED],
    confused_with: &["backlash"],
    place: effect_placement,
    of_a_make: true,
    lookalikes: &[Lookalikes::LostMotion],
    ..EffectKind::PLAIN
};

#[derive(Debug)]
struct FrictionWindup {
    joint: usize,
    shares: TorqueTerms,
}

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    let joint = context.turning_joint()?;
    context.loaded(joint)?;
    let shares = TorqueTerms::of(context, joint);
    let per_deg = 1f64.to_radians() / context.reference_torque_nm(joint);
    let unit = Unit::RadianPerNewtonMetre;
    let meaning = "wind-up per gravity torque against the direction of arrival";
    let amplitudes = shares.amplitudes("windup", unit, 0.4 * per_deg, 8.0 * per_deg, meaning);
    Ok(Placement::new(amplitudes, FrictionWindup { joint, shares }))
}

impl Physics for FrictionWindup {
    fn deform<D: Scalar>(&self, theta: &[D], x: &Drivers<'_>, change: &mut Deformation<D>) {
        let torque = &x.torque()[self.joint];
        let links = torque.links_nm.abs();
        let outer = torque.outer_nm * torque.links_nm.signum();
        let load = torque.total_nm().abs() - links;
        let windup = self.shares.sum(theta, links, outer, load);
        let (memory, arrival) = (x.path_memory_rad(self.joint), x.arrival[self.joint]);
        change
            .joint(self.joint, led_play_displacement(windup * 2.0, BEGUN_DEG.to_radians(), memory, arrival));
    }
}
