//! The drives of one arm of a pair: what the encoders read while a hand leads the links.

use super::{BuiltArm, PairArmConfig};
use crate::{Mechanism, RigState};
use nalgebra::Vector3;

/// Gravity in the world [m/s^2].
const GRAVITY_M_S2: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);

/// The gears, belts and encoders of one arm through one recording; the moments must come in order of time.
pub(super) struct Drives<'a> {
    config: &'a PairArmConfig,
    built: &'a BuiltArm,
    recording: usize,
    mechanisms: Vec<Box<dyn Mechanism>>,
}

impl<'a> Drives<'a> {
    pub fn new(config: &'a PairArmConfig, built: &'a BuiltArm, recording: usize) -> Drives<'a> {
        let mechanisms = config.mechanisms.iter().map(|m| m.mechanism()).collect();
        Drives { config, built, recording, mechanisms }
    }

    /// What the encoders see of links at these angles [rad], before they count.
    pub fn reading(&mut self, time_s: f64, link_rad: &[f64]) -> Vec<f64> {
        if self.mechanisms.is_empty() {
            return link_rad.to_vec();
        }
        let (built, own) = (self.built, self.config);
        let gravity_m_s2 = built.world_from_base.rotation.inverse() * GRAVITY_M_S2;
        let masses_kg = vec![own.link_kg; link_rad.len()];
        let gravity_nm = built.arm.gravity_torque(link_rad, &gravity_m_s2, &masses_kg, 0.0);
        // Recordings begin a quarter of an hour apart.
        let session_s = time_s + 900.0 * self.recording as f64;
        let now = RigState {
            time_s,
            session_s,
            recording: self.recording,
            warmer_k: 0.0,
            motors_lead: false,
            arm: &built.arm,
            masses_kg: &masses_kg,
            tip_kg: 0.0,
            gravity_m_s2: &gravity_m_s2,
            link_rad,
            gravity_nm: &gravity_nm,
        };
        let mut motor_rad = link_rad.to_vec();
        self.mechanisms.iter_mut().for_each(|m| m.link_to_motor(&now, &mut motor_rad));
        let mut reading_rad = motor_rad.clone();
        self.mechanisms.iter().for_each(|m| m.distort_encoder(&now, &mut reading_rad));
        reading_rad
    }
}
