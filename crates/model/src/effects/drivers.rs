//! What drives the effects in one observation: pose, arrival, gravity torque, time, load, temperature.
//!
//! Everything here is worked out at the nominal arm, so that it does not move while the fit does.

use super::nominal_arm::NominalArm;
use super::nominal_pose::NominalPose;
use super::session::Session;
use armcal_core::{Load, Observation};
use nalgebra::Vector3;
use std::sync::OnceLock;

/// Gravity torque on one joint at the nominal chain, split so that unknown masses can be told apart.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Torque {
    /// Of all links with their default masses [N m] (prismatic: [N]). Positive pushes towards +q.
    pub links_nm: f64,
    /// The part of it that the links beyond the joint's own cause.
    pub outer_nm: f64,
    /// Of the loads that hang on what it moves.
    pub load_nm: f64,
}

impl Torque {
    /// Links and load together [N m].
    pub fn total_nm(&self) -> f64 {
        self.links_nm + self.load_nm
    }
}

/// Everything that may drive an effect in one observation. What takes following the nominal arm is worked out when it is first
/// asked for.
#[derive(Debug, Clone)]
pub struct Drivers<'o> {
    /// The observation itself: readings, effort, load, temperature, reference.
    pub observation: &'o Observation,
    /// Direction of arrival of each joint: +1, -1, or 0 where it is not known.
    pub arrival: Vec<f64>,
    /// Time since the start of the session [s].
    pub time_s: f64,
    /// The same as a fraction of the session, 0 to 1.
    pub session_fraction: f64,
    /// Temperature above the session's mean [K]; 0 where it is not known.
    pub warming_k: f64,
    nominal: NominalArm<'o>,
    session: &'o Session,
    posed: OnceLock<Posed>,
}

/// The nominal arm in the pose of an observation, and what weighs on it.
#[derive(Debug, Clone)]
struct Posed {
    arm: NominalPose,
    torque: Vec<Torque>,
    gravity_mps2: Vector3<f64>,
}

impl<'o> Drivers<'o> {
    pub(crate) fn of(nominal: NominalArm<'o>, session: &'o Session, o: &'o Observation) -> Drivers<'o> {
        let time_s = (o.time_ns - session.start_ns) as f64 * 1e-9;
        let duration_s = session.duration_s();
        let warming = o.temperature_c.zip(session.reference_temperature_c).map(|(now, mean)| now - mean);
        Drivers {
            observation: o,
            arrival: (0..nominal.chain.joint_names.len())
                .map(|j| o.arrival.get(j).map_or(0.0, |arrival| arrival.sign()))
                .collect(),
            time_s,
            session_fraction: if duration_s > 0.0 { time_s / duration_s } else { 0.0 },
            warming_k: warming.unwrap_or(0.0),
            nominal,
            session,
            posed: OnceLock::new(),
        }
    }

    fn posed(&self) -> &Posed {
        self.posed.get_or_init(|| {
            let o = self.observation;
            let arm = self.nominal.pose(&o.joint_rad);
            let gravity = gravity_in_world(self.session, &arm);
            let torque = (0..arm.joints.len())
                .map(|j| Torque {
                    links_nm: arm.torque_nm(j, false, &gravity),
                    outer_nm: arm.torque_nm(j, true, &gravity),
                    load_nm: load_nm(&arm, j, &gravity, o),
                })
                .collect();
            Posed { arm, torque, gravity_mps2: gravity }
        })
    }

    /// Gravity torque on each joint.
    pub fn torque(&self) -> &[Torque] {
        &self.posed().torque
    }

    /// Gravity in the world [m/s^2].
    pub fn gravity_mps2(&self) -> &Vector3<f64> {
        &self.posed().gravity_mps2
    }

    /// The nominal arm.
    pub(crate) fn pose(&self) -> &NominalPose {
        &self.posed().arm
    }

    /// Where the board was measured in the world [m], in the recording of a seated tip.
    pub(crate) fn board_m(&self) -> Option<Vector3<f64>> {
        let o = self.observation;
        let seated = o.cavity().is_some();
        let board = seated.then(|| self.nominal.board_in_world(o.dwell.recording)).flatten();
        board.map(|board| board.translation.vector)
    }

    /// Reading of a joint [rad] (prismatic: [m]); NaN where the observation has none.
    pub fn joint_rad(&self, joint: usize) -> f64 {
        self.observation.joint_rad.get(joint).copied().unwrap_or(f64::NAN)
    }

    /// Where the base was measured in the world [m].
    pub(crate) fn base_m(&self) -> Vector3<f64> {
        self.pose().bases[0].translation_m
    }

    /// How far the joint's reading is from that of the rest before [rad] (prismatic: [m]); 0 where that is not known.
    pub fn moved_rad(&self, joint: usize) -> f64 {
        self.observation.moved_rad.as_ref().and_then(|all| all.get(joint)).copied().unwrap_or(0.0)
    }

    /// Generalised force on a joint of one kilogram at the tip of its arm [N m] (prismatic: [N]).
    pub(crate) fn kilogram_nm(&self, joint: usize) -> f64 {
        self.pose().kilogram_nm(joint, self.pose().tip_of(joint), self.gravity_mps2())
    }

    /// What the joint's encoder went through before it came to rest; empty where that is not known.
    pub fn path_memory_rad(&self, joint: usize) -> &'o [f64] {
        self.observation.path_memory_rad.as_ref().and_then(|all| all.get(joint)).map_or(&[], Vec::as_slice)
    }

    /// The same of a joint's angle plus (`sense` negative: minus) that of the joint before it.
    pub fn pair_memory_rad(&self, joint: usize, sense: f64) -> &'o [f64] {
        let pairs = self.observation.pair_memory_rad.as_ref();
        let pair = joint.checked_sub(1).and_then(|before| pairs?.get(before));
        pair.map_or(&[], |[sum, difference]| if sense < 0.0 { difference } else { sum })
    }
}

/// Generalised force of all loads on a joint.
fn load_nm(pose: &NominalPose, joint: usize, gravity: &Vector3<f64>, o: &Observation) -> f64 {
    let of = |load: Load| pose.kilogram_nm(joint, load.at, gravity) * load.kg;
    o.loads().map(of).reduce(|sum, one| sum + one).unwrap_or(0.0)
}

pub(crate) fn gravity_in_world(session: &Session, pose: &NominalPose) -> Vector3<f64> {
    match session.gravity_in_base_mps2 {
        Some(in_base) => pose.bases[0].rotation * in_base,
        None => session.gravity_in_world_mps2,
    }
}
