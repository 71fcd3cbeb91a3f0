//! A gear or an encoder disc that does not turn about its centre.
//!
//! # What moves
//! The transmission (or the reading) runs ahead and behind once a turn of the joint.
//!
//! # Equation
//! `dq = A sin q + B cos q`, amplitude about e/r: offset of the centre by the radius of gear or disc.
//!
//! # Parameters and units
//! `sin` A, `cos` B [rad].
//!
//! # Signature in the data
//! A wave once a turn in one joint, whatever the direction, load and time. Within +-15 deg it is a parabola.
//!
//! # Not to be confused with
//! `second_harmonic` and `gear_ratio`, which look the same in a narrow range; `axis_tilt`. Gear and encoder
//! eccentricity themselves are the same to the data.
//!
//! # Source
//! Judd and Knasinski 1990 (IEEE T-RA 6:1); Whitney, Lozinski, Rourke 1986.

use super::prelude::*;

pub(super) const KIND: EffectKind = EffectKind {
    aliases: &["encoder eccentricity", "gear run-out"],
    summary: "a gear or encoder disc off its centre: an error once a turn",
    family: Family::Transmission,
    confused_with: &["second_harmonic", "gear_ratio", "compliance", "belt_coupling", "axis_tilt"],
    place: effect_placement,
    of_a_make: true,
    lookalikes: &[Lookalikes::Turns],
    ..EffectKind::PLAIN
};

/// `harmonic` times a turn.
#[derive(Debug)]
pub(super) struct Harmonic {
    pub joint: usize,
    pub harmonic: f64,
}

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    let joint = context.turning_joint()?;
    Ok(Placement::new(amplitudes_wave(0.4, 8.0, " q"), Harmonic { joint, harmonic: 1.0 }))
}

impl Physics for Harmonic {
    fn deform<D: Scalar>(&self, theta: &[D], x: &Drivers<'_>, change: &mut Deformation<D>) {
        let (sine, cosine) = (self.harmonic * x.joint_rad(self.joint)).sin_cos();
        change.joint(self.joint, theta[0] * sine + theta[1] * cosine);
    }
}
