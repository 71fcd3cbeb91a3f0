//! Backlash on the side of a motor that sits on the base.
//!
//! # What moves
//! A belt from the base sets the direction of the link in space, so the gap follows how that direction was reached,
//! not how the joint itself moved.
//!
//! # Equation
//! `dq_j = w - u`, u the sum of the two angles (their difference where the axes point against each other) and w the
//! play operator on its path, `w <- max(u - b/2, min(u + b/2, w))`: `-(b/2)` in the direction in which the sum arrived,
//! less after moves shorter than the gap. Narrow and negative widths as in `backlash`. Where no path was recorded:
//! `-(b/2) sgn(s_{j-1} + s_j)`, nothing where the two arrived against each other.
//!
//! # Parameters and units
//! `width` b [rad]. The spec names the joint j that is driven from the base.
//! Shape `seated` [1], 1 unless said: the share that acts while a cavity holds the tip, negative where a hand led the
//! link there and it lags elsewhere.
//!
//! # Signature in the data
//! The residual flips with the direction in which the link turned in space, whatever its own joint did.
//!
//! # Not to be confused with
//! `backlash` of j, and `crossed_backlash` from j-1: it follows whichever of the two moved further.
//!
//! # Source
//! Play operator: Visintin, Differential Models of Hysteresis, 1994, ch. III; layout of the paper's arm.

use super::play::{BEGUN_DEG, led_play_displacement};
use super::prelude::*;

pub(super) const KIND: EffectKind = EffectKind {
    aliases: &["play on the motor side of a belt"],
    summary: "play in a belt from the base: the sum of two joints decides",
    family: Family::LostMotion,
    toggle: Toggle::Direction,
    shapes: &[LED],
    confused_with: &["backlash", "crossed_backlash", "friction_windup"],
    place: effect_placement,
    lookalikes: &[Lookalikes::LostMotion],
    ..EffectKind::PLAIN
};

#[derive(Debug)]
struct BeltBacklash {
    joint: usize,
    sense: f64,
}

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    let joint = context.turning_joint()?;
    let sense = context
        .parallel_to_previous(joint)
        .ok_or("a belt from the base needs an axis parallel to the one before it")?;
    let deg = 1f64.to_radians();
    let width = amplitude("width", Unit::Radian, 0.5 * deg, 8.0 * deg, "width of the gap");
    Ok(Placement::new(vec![width], BeltBacklash { joint, sense }))
}

impl Physics for BeltBacklash {
    fn deform<D: Scalar>(&self, theta: &[D], x: &Drivers<'_>, change: &mut Deformation<D>) {
        let sum = self.sense * x.arrival[self.joint - 1] + x.arrival[self.joint];
        let direction = if sum == 0.0 { 0.0 } else { sum.signum() };
        let memory = x.pair_memory_rad(self.joint, self.sense);
        change.joint(self.joint, led_play_displacement(theta[0], BEGUN_DEG.to_radians(), memory, direction));
    }
}
