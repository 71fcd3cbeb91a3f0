//! An error twice a turn.
//!
//! # What moves
//! An elliptic ring or pulley, a misaligned coupling, an encoder with two reading heads: the joint runs ahead and
//! behind twice a turn.
//!
//! # Equation
//! `dq = A sin 2q + B cos 2q`.
//!
//! # Parameters and units
//! `sin` A, `cos` B [rad].
//!
//! # Signature in the data
//! A wave twice a turn in one joint, whatever the direction, load and time.
//!
//! # Not to be confused with
//! `eccentricity` and `gear_ratio`, which look the same in a narrow range.
//!
//! # Source
//! Hu et al., Sensors 2020 (harmonic errors of joint modules); Tuttle, MIT TR 1992.

use super::eccentricity::Harmonic;
use super::prelude::*;

pub(super) const KIND: EffectKind = EffectKind {
    aliases: &["elliptic ring", "misaligned coupling"],
    summary: "an error twice a turn of the joint",
    family: Family::Transmission,
    confused_with: &["eccentricity", "gear_ratio", "compliance", "belt_coupling", "axis_tilt"],
    place: effect_placement,
    of_a_make: true,
    lookalikes: &[Lookalikes::Turns],
    ..EffectKind::PLAIN
};

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    let joint = context.turning_joint()?;
    Ok(Placement::new(amplitudes_wave(0.15, 3.0, " 2q"), Harmonic { joint, harmonic: 2.0 }))
}
