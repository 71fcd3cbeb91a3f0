//! Nothing listed, and yet the tip is off: by a smooth random function of the pose, larger than the noise.
//!
//! A laser tracker scatters by 0.02 mm and no model of an arm is true to 0.2 mm: what is left has no name, only size and
//! smoothness. Here it is a sample of an isotropic Gaussian process over the joint angles with the kernel
//! `exp(-|q - q'|^2 / (2 length^2))`, made of random Fourier features (Rahimi, Recht 2007).

use super::families::{Draw, Family, Made, family};
use crate::config::LabConfig;
use crate::mechanisms::{MechanismConfig, Wave, Waves};
use crate::{LabError, observe};
use armcal_core::Observation;
use nalgebra::Vector3;

/// Every one; the size is that at the dwells about its mean, per axis, over the declared noise there.
pub(super) const FAMILIES: &[Family] = &[
    family("nothing:smooth_3", &[], [3.0, 3.0], "times the declared noise", smooth_displacement),
    family("nothing:smooth_10", &[], [10.0, 10.0], "times the declared noise", smooth_displacement),
];

/// How far the arm has to turn for the displacement to be another one [rad].
const LENGTH_RAD: [f64; 2] = [0.5, 1.5];

/// Enough waves that their sum is nearly normal, few enough to be added up at each step.
const WAVES: usize = 64;

fn smooth_displacement(draw: &mut Draw, config: &mut LabConfig) -> Result<Made, LabError> {
    let seen = observe(config)?.observations;
    let [low, high] = LENGTH_RAD;
    let length_rad = low * (high / low).powf(draw.draw.uniform([0.0, 1.0]));
    let joints = config.joints.names.len();
    let mut wave = || Wave {
        per_rad: (0..joints).map(|_| draw.draw.normal() / length_rad).collect(),
        phase_rad: draw.draw.uniform([0.0, std::f64::consts::TAU]),
        shift_mm: draw.draw.normal3().into(),
    };
    let mut waves = Waves { waves: (0..WAVES).map(|_| wave()).collect() };
    let scale = draw.size * declared_m(&seen) / spread_m(&waves, &seen);
    waves.waves.iter_mut().for_each(|wave| wave.shift_mm = wave.shift_mm.map(|mm| mm * scale));
    let (same, alike) = (Vec::new(), Vec::new());
    let enters = ["tip".to_owned(), "the pose".to_owned()];
    Ok(Made { mechanism: MechanismConfig::Waves(waves), effect: None, same, alike, enters })
}

/// Root mean square of what is declared of the dwells, per axis [m].
pub(super) fn declared_m(seen: &[Observation]) -> f64 {
    (seen.iter().map(|o| o.covariance_m2.trace() / 3.0).sum::<f64>() / seen.len() as f64).sqrt()
}

/// Root mean square of the displacement at the dwells, per axis [m]; about its mean, which is a part of the tool.
pub(super) fn spread_m(waves: &Waves, seen: &[Observation]) -> f64 {
    let shifts: Vec<Vector3<f64>> = seen.iter().map(|o| waves.shift_m(&o.joint_rad)).collect();
    let mean = shifts.iter().sum::<Vector3<f64>>() / shifts.len() as f64;
    let square: f64 = shifts.iter().map(|shift| (shift - mean).norm_squared()).sum();
    (square / (3 * shifts.len()) as f64).sqrt()
}
