//! A joint that was read before it, or its reading, had settled.
//!
//! # What moves
//! The reading is not that of the joint at rest: a set-point that the joint is still approaching, an encoder behind a slow
//! filter, a stale message of the way there. What is missing is a share of the last move.
//!
//! # Equation
//! `dq = -c (q - q')`, q' the reading of the rest before, in the same recording; 0 in its first rest. A joint that
//! approaches its set-point exponentially, read a time t after it was sent there, has `c = exp(-t / T)`. A reading that
//! the same filter delays has `c` below zero: with `a` of the last move missing in it, `c = -a / (1 - a)`.
//!
//! # Parameters and units
//! `share` c [1] of the last move: above zero where the joint lags behind its reading, below where the reading lags.
//! Shape `seated` [1], 1 unless said: the share that acts while a cavity holds the tip; 0 where it is waited for there.
//!
//! # Signature in the data
//! The residual flips with the direction of arrival and grows with how far the joint came; two visits to one pose from
//! near and from far differ, from the same side too.
//!
//! # Not to be confused with
//! `backlash`, `friction_windup`: they know the side, not the way; where all moves are of one length they look alike. A
//! longer rest before the reading makes this one vanish, and those stay.
//!
//! # Source
//! First-order lag: Astrom, Murray, Feedback Systems, 2nd ed. 2021, sec. 6.3.

use super::prelude::*;

pub(super) const KIND: EffectKind = EffectKind {
    aliases: &["filtered or stale encoder", "set-point read before the arm arrived"],
    summary: "read before the joint, or its reading, had settled: a share of the last move is missing",
    family: Family::Timing,
    toggle: Toggle::Approach,
    shapes: &[SEATED],
    confused_with: &["backlash", "friction_windup"],
    place: effect_placement,
    look_at: "Read the joints later, when arm and readings have settled: look at waiting times, filters and whether set-points are recorded.",
    told_by: "wait longer before the joints are read, or come to the same poses from near and from far",
    ..EffectKind::PLAIN
};

/// Typical share of a move that is missing.
const TYPICAL: f64 = 0.02;

#[derive(Debug)]
struct UnsettledReading {
    joint: usize,
}

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    let joint = context.joint()?;
    if !context.session.moved {
        return Err("no observation says where the joints rested before".to_owned());
    }
    let share =
        amplitude("share", Unit::One, TYPICAL, 1.0, "share of the last move that the joint is behind");
    Ok(Placement::new(vec![share], UnsettledReading { joint }))
}

impl Physics for UnsettledReading {
    fn deform<D: Scalar>(&self, theta: &[D], x: &Drivers<'_>, change: &mut Deformation<D>) {
        change.joint(self.joint, theta[0] * -x.moved_rad(self.joint));
    }
}
