//! A joint's own error curve, of no particular shape.
//!
//! # What moves
//! Gear, bearing and encoder of a joint together turn the link by a little more or less than the encoder says, again
//! and again the same at the same angle: eccentric discs, wave generators, uneven lines, a worn zone.
//!
//! # Equation
//! `dq = sum_n a_n sin(n q) + b_n cos(n q)`, n = 1..N turns of the joint: a Fourier series whose amplitudes are expected
//! to fall with n as those of a smooth random curve do (Matern 5/2 with a length of 5 deg).
//!
//! # Parameters and units
//! `sin<n>`, `cos<n>` [rad]; shape `harmonics` N (default 16; features down to about 180/N deg are followed), shape
//! `typical` [rad] the standard deviation expected of the whole curve (default 0.1 deg): where poses are few the curve
//! stays within it. The diagnosis proposes the size that it found.
//!
//! # Signature in the data
//! Errors that look like noise against everything but this joint's angle, and repeat exactly. The curve holds where the
//! joint was in the data; elsewhere it returns to zero.
//!
//! # Not to be confused with
//! A mechanism: this is what is left to say when no shape of the catalogue (`eccentricity`, `second_harmonic`,
//! `periodic`, `gear_ratio`) says it. The diagnosis offers it for an unknown curve over a joint's own angle and never
//! names it as a cause.
//!
//! # Source
//! Rasmussen and Williams, Gaussian Processes for Machine Learning, 2006, eq. 4.15 and 4.17; Hu et al., Sensors 2020.

use super::prelude::*;

pub(super) const KIND: EffectKind = EffectKind {
    aliases: &["encoder error map", "gear error curve"],
    summary: "the joint's own repeatable error curve, a Fourier series over its angle",
    family: Family::Transmission,
    offered: Offered::Never,
    shapes: &[
        Shape {
            name: "harmonics",
            unit: Unit::One,
            default: Some(16.0),
            lower: 1.0,
            upper: 180.0,
            meaning: "number of harmonics of the turn",
            parameter: false,
            values: None,
        },
        Shape {
            name: "typical",
            unit: Unit::Radian,
            default: Some(TYPICAL_RAD),
            lower: 1e-7,
            upper: 0.1,
            meaning: "standard deviation expected of the whole curve",
            parameter: false,
            values: None,
        },
    ],
    confused_with: &["eccentricity", "second_harmonic", "periodic", "gear_ratio"],
    place: effect_placement,
    lookalikes: &[Lookalikes::Turns],
    ..EffectKind::PLAIN
};

/// Standard deviation of the whole curve [rad] where nothing is said: 0.1 deg.
const TYPICAL_RAD: f64 = 0.1 * std::f64::consts::PI / 180.0;
/// Length over which it stays alike [rad].
const LENGTH_RAD: f64 = 5.0 * std::f64::consts::PI / 180.0;

#[derive(Debug)]
struct ErrorCurve {
    joint: usize,
}

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    let joint = context.turning_joint()?;
    let asked = context.shape("harmonics").unwrap_or(16.0);
    let harmonics = asked as usize;
    if harmonics as f64 != asked || !(1..=180).contains(&harmonics) {
        return Err(format!("harmonics = {asked} must be a whole number from 1 to 180"));
    }
    // Spectral density of the Matern 5/2 kernel at n turns, up to a factor.
    let density = |n: f64| (5.0 + (n * LENGTH_RAD).powi(2)).powi(-3);
    let all: f64 = (1..=180).map(|n| density(f64::from(n))).sum();
    let typical_rad = context.shape("typical").unwrap_or(TYPICAL_RAD);
    let share = |n: usize| (density(n as f64) / all).sqrt();
    // What is expected to be small may still turn out large: bounds are no tighter than those of an ordinary curve.
    let widest_rad = typical_rad.max(TYPICAL_RAD);
    let amplitudes = (1..=harmonics)
        .flat_map(|n| ["sin", "cos"].map(|name| (n, name)))
        .map(|(n, name)| {
            let meaning = format!("amplitude of {name} {n}q");
            let (sigma, bound) = (typical_rad * share(n), 50.0 * widest_rad * share(n));
            amplitude(&format!("{name}{n}"), Unit::Radian, sigma, bound, meaning)
        })
        .collect();
    Ok(Placement::new(amplitudes, ErrorCurve { joint }))
}

impl Physics for ErrorCurve {
    fn deform<D: Scalar>(&self, theta: &[D], x: &Drivers<'_>, change: &mut Deformation<D>) {
        let mut sum = D::from(0.0);
        for (amplitude, wave) in theta.iter().zip(fourier_terms(x.joint_rad(self.joint), theta.len())) {
            sum += *amplitude * wave;
        }
        change.joint(self.joint, sum);
    }

    fn per_amplitude(&self, x: &Drivers<'_>, count: usize) -> Option<(usize, Vec<f64>)> {
        Some((self.joint, fourier_terms(x.joint_rad(self.joint), count).collect()))
    }
}

/// `sin q, cos q, sin 2q, cos 2q ..`, the first `count`: each harmonic turned on from the one before.
fn fourier_terms(angle_rad: f64, count: usize) -> impl Iterator<Item = f64> {
    let first = angle_rad.sin_cos();
    let next = move |(sine, cosine): &(f64, f64)| {
        Some((sine * first.1 + cosine * first.0, cosine * first.1 - sine * first.0))
    };
    std::iter::successors(Some(first), next).flat_map(|(sine, cosine)| [sine, cosine]).take(count)
}
