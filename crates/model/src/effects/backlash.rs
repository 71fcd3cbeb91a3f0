//! Backlash of a joint, or Coulomb wind-up.
//!
//! # What moves
//! The link lags behind the encoder by half a gap: which flank touches depends on where the joint came from. A
//! drive of finite stiffness wound up by dry friction does the same, with `b = 2 F_c / K`.
//!
//! # Equation
//! `dq = -(b/2) s`, `s = +1` where the joint arrived moving towards +q. Where the recording shows the path of the
//! encoder, the play operator on it, `w <- max(q - b/2, min(q + b/2, w))`, `dq = w - q`, which is also right when
//! the last move was shorter than the gap. At b = 0, where a fit begins and a servo's overshoot would decide, its derivative is
//! the slope up to a gap of 0.3 deg. Negative b: `dq = -(b/2) s` with s the direction of the encoder's last move, however
//! small, because a link that leads pushes the encoder from the flank it touches.
//!
//! # Parameters and units
//! `width` b [rad] (sliding joint: [m]). Signed: negative where the link leads, as in an arm guided by hand; never where
//! `seated` says that a hand led it into the cavities only.
//! Shape `seated` [1], 1 unless said: the share that acts while a cavity holds the tip, negative where a hand led the
//! link there and it lags elsewhere. Where it is between -1 and 1, nothing holds the joint on a flank there: it rests
//! anywhere in its gap, with variance `(b/2)^2 (1 - seated^2) / 3`: at 0 that of an even spread over the gap. Nothing
//! predicts it; it is part of the noise of these dwells.
//! Shape `rest` [1], 0 unless said: the part r of its gap in which the joint rests anywhere in every dwell, whoever holds
//! the arm, with variance `(r b/2)^2 / 3`: a gap that neither load nor friction closes.
//!
//! # Signature in the data
//! The residual flips sign with the direction of arrival, at the same pose; it does not depend on load.
//!
//! # Not to be confused with
//! `friction_windup`, which grows with load; `gravity_backlash`, where gravity holds one flank; `crossed_backlash`,
//! where the direction of another joint counts. Backlash and Coulomb wind-up themselves are the same to position
//! data; motor current, or a rest test with the motor off, separates them.
//!
//! # Source
//! Slamani, Nubiola, Bonev 2012 (Industrial Robot 39:4); play operator: Visintin, Differential Models of
//! Hysteresis, 1994, ch. III.

use super::play::{BEGUN_DEG, led_play_displacement};
use super::prelude::*;

pub(super) const KIND: EffectKind = EffectKind {
    aliases: &["Coulomb wind-up"],
    summary: "play between encoder and link: the tip depends on the direction of arrival",
    family: Family::LostMotion,
    toggle: Toggle::Direction,
    shapes: &[LED, REST],
    confused_with: &["friction_windup", "gravity_backlash", "crossed_backlash", "belt_backlash"],
    place: effect_placement,
    of_a_make: true,
    lookalikes: &[Lookalikes::LostMotion],
    ..EffectKind::PLAIN
};

#[derive(Debug)]
struct Backlash {
    joint: usize,
    begun: f64,
}

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    let joint = context.joint()?;
    let (typical, bound) = (context.joint_size(joint, 0.5), context.joint_size(joint, 8.0));
    let width = amplitude("width", context.joint_unit(joint), typical, bound, "width of the gap");
    let begun = context.joint_size(joint, BEGUN_DEG);
    Ok(Placement::new(vec![width], Backlash { joint, begun }))
}

impl Physics for Backlash {
    fn deform<D: Scalar>(&self, theta: &[D], x: &Drivers<'_>, change: &mut Deformation<D>) {
        let memory = x.path_memory_rad(self.joint);
        change.joint(self.joint, led_play_displacement(theta[0], self.begun, memory, x.arrival[self.joint]));
    }

    fn gap(&self, theta: &[f64]) -> Option<(usize, f64)> {
        Some((self.joint, theta[0]))
    }
}
