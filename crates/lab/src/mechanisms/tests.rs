//! The physics of each mechanism.

mod lost_motion;
mod shapes;
mod sizes;
mod springs;

use super::*;
use crate::arm::AxisArm;
use crate::config::ArmConfig;
use armcal_core::Pose;
use nalgebra::Vector3;

const DOWN: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);

/// A moment of the paper's arm, of which a test sets what it is about.
struct Rest {
    arm: AxisArm,
    masses_kg: Vec<f64>,
    link_rad: Vec<f64>,
    gravity_nm: Vec<f64>,
    session_s: f64,
    recording: usize,
    motors_lead: bool,
}

impl Rest {
    fn at(link_rad: [f64; 3]) -> Rest {
        let (arm, masses_kg) = (AxisArm::from_rows(&ArmConfig::default().rows), vec![1.5, 1.2, 0.6]);
        let gravity_nm = arm.gravity_torque(&link_rad, &DOWN, &masses_kg, 0.65);
        Rest {
            arm,
            masses_kg,
            link_rad: link_rad.to_vec(),
            gravity_nm,
            session_s: 0.0,
            recording: 0,
            motors_lead: false,
        }
    }

    fn now(&self) -> RigState<'_> {
        RigState {
            time_s: self.session_s,
            session_s: self.session_s,
            recording: self.recording,
            warmer_k: 10.0,
            motors_lead: self.motors_lead,
            arm: &self.arm,
            masses_kg: &self.masses_kg,
            tip_kg: 0.65,
            gravity_m_s2: &DOWN,
            link_rad: &self.link_rad,
            gravity_nm: &self.gravity_nm,
        }
    }

    fn potential_j(&self, q: &[f64]) -> f64 {
        let link = |l: usize| self.masses_kg[l] * self.arm.carried(l, &self.arm.mass_centres_m[l], q).z;
        9.81 * ((0..3).map(link).sum::<f64>() + 0.65 * self.arm.tip(q).z)
    }
}

fn mechanism(text: &str) -> Box<dyn Mechanism> {
    toml::from_str::<MechanismConfig>(text).unwrap().mechanism()
}

fn link(m: &mut dyn Mechanism, rest: &Rest, motor: [f64; 3]) -> Vec<f64> {
    let mut q = motor.to_vec();
    m.motor_to_link(&rest.now(), &mut q);
    q
}

fn motor(m: &mut dyn Mechanism, rest: &Rest, link: [f64; 3]) -> Vec<f64> {
    let mut q = link.to_vec();
    m.link_to_motor(&rest.now(), &mut q);
    q
}
