//! What drives the effects in one observation: pose, arrival, gravity torque, time, load, temperature.
//!
//! Everything here is worked out at the nominal chain, so that it does not move while the fit does. Links have the
//! masses and centres of their URDF, where it gives all of them; else each weighs 2.5 kg for every metre between its
//! two joints (the last: between joint and tip), evenly spread. Only the proportions matter, because the amplitude of
//! an effect absorbs the scale and a second amplitude the share of the outer links.

use super::session::Session;
use crate::path::Ends;
use crate::rigid::Rigid;
use crate::segment::{Body, Geometry, Motion, Segment};
use armcal_core::Observation;
use nalgebra::Vector3;

/// Mass of a link per length between its joints [kg/m].
const LINK_DENSITY_KGPM: f64 = 2.5;

/// The axis of a joint at the nominal chain, in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct JointAxis {
    /// A point on the axis that the joint itself does not move [m]: the link before it ends here.
    pub origin_m: Vector3<f64>,
    /// Where its own link begins [m]: there too, unless it slides.
    pub start_m: Vector3<f64>,
    /// Unit vector.
    pub axis: Vector3<f64>,
    /// How the joint moves.
    pub motion: Motion,
    /// The slot right before the segment that holds the joint.
    pub slot: usize,
}

/// The nominal arm in one pose.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct NominalPose {
    /// The frame at every slot, in the world.
    pub slots: Vec<Rigid<f64>>,
    /// The joints, in the order of the joint vector.
    pub joints: Vec<JointAxis>,
    /// The tip [m].
    pub tip_m: Vector3<f64>,
    /// What each link weighs, and where in the world.
    links: Vec<Body>,
}

impl NominalPose {
    /// Follows the path `world, base, rows, tip`.
    pub fn of(path: &[Segment], p: &[f64], joint_rad: &[f64]) -> NominalPose {
        let slots = Ends::of(path, p, joint_rad).0;
        let mut joints = Vec::with_capacity(joint_rad.len());
        for (slot, segment) in path.iter().enumerate() {
            let Some(joint) = segment.joint else { continue };
            let (before, after) = (&slots[slot], &slots[slot + 1]);
            let (origin_m, axis) = match &segment.geometry {
                Geometry::ModifiedDh { .. } => {
                    // Rx(alpha) Tx(a) stands before the axis.
                    let a_m = p.get(segment.parameters.start + 2).copied().unwrap_or_default();
                    let origin_m = before.translation_m + before.rotation.column(0) * a_m;
                    (origin_m, after.rotation.column(2).into_owned())
                }
                Geometry::Axis(axis) => (before.translation_m, before.rotation * axis),
                Geometry::StandardDh { .. } | Geometry::Origin { .. } => {
                    (before.translation_m, before.rotation.column(2).into_owned())
                }
            };
            let slid_m = match joint.motion {
                Motion::Revolute => 0.0,
                Motion::Prismatic => joint_rad.get(joint.index).copied().unwrap_or(f64::NAN),
            };
            let start_m = origin_m + axis * slid_m;
            joints.push(JointAxis { origin_m, start_m, axis, motion: joint.motion, slot });
        }
        let tip_m = slots.last().map_or_else(Vector3::zeros, |end| end.translation_m);
        let mut pose = NominalPose { slots, joints, tip_m, links: Vec::new() };
        pose.links = pose.declared(path).unwrap_or_else(|| pose.spread());
        pose
    }

    /// The links as the file of the arm declares them; none where it leaves one without a mass.
    pub fn declared(&self, path: &[Segment]) -> Option<Vec<Body>> {
        let mut links = vec![Body { mass_kg: 0.0, centre_m: Vector3::zeros() }; self.joints.len()];
        for (slot, body) in path.iter().enumerate().filter_map(|(slot, s)| Some((slot, s.body.as_ref()?))) {
            // What the first joint does not move bears no part.
            let Some(k) = self.joints.iter().rposition(|j| j.slot <= slot) else { continue };
            let end = &self.slots[slot + 1];
            let (link, at_m) = (&mut links[k], end.rotation * body.centre_m + end.translation_m);
            let mass_kg = link.mass_kg + body.mass_kg;
            link.centre_m += (at_m - link.centre_m) * (body.mass_kg / mass_kg);
            link.mass_kg = mass_kg;
        }
        links.iter().all(|link| link.mass_kg > 0.0).then_some(links)
    }

    /// Links that weigh as much as they are long.
    fn spread(&self) -> Vec<Body> {
        let link = |k| {
            let (from, to) = self.link_m(k);
            Body { mass_kg: LINK_DENSITY_KGPM * (to - from).norm(), centre_m: (from + to) * 0.5 }
        };
        (0..self.joints.len()).map(link).collect()
    }

    /// Where link `k` (from joint k to the next, or to the tip) begins and ends [m].
    pub fn link_m(&self, k: usize) -> (Vector3<f64>, Vector3<f64>) {
        let end = self.joints.get(k + 1).map_or(self.tip_m, |next| next.origin_m);
        (self.joints[k].start_m, end)
    }

    /// Mass of link `k` [kg].
    pub fn link_mass_kg(&self, k: usize) -> f64 {
        self.links[k].mass_kg
    }

    /// Centre of mass of link `k` [m].
    pub fn link_centre_m(&self, k: usize) -> Vector3<f64> {
        self.links[k].centre_m
    }

    /// Moment about `pivot` of the weights of the links from `first` on [N m].
    pub fn moment_nm(&self, pivot: &Vector3<f64>, first: usize, gravity: &Vector3<f64>) -> Vector3<f64> {
        let weight = |k| (self.link_centre_m(k) - pivot).cross(gravity) * self.link_mass_kg(k);
        (first..self.joints.len()).map(weight).sum()
    }

    /// Generalised force on a joint of the weights of the links from `first` on, positive towards +q [N m]
    /// (prismatic: [N]).
    fn torque_nm(&self, joint: usize, first: usize, gravity: &Vector3<f64>) -> f64 {
        let j = &self.joints[joint];
        match j.motion {
            Motion::Revolute => j.axis.dot(&self.moment_nm(&j.origin_m, first, gravity)),
            Motion::Prismatic => {
                let mass: f64 = (first..self.joints.len()).map(|k| self.link_mass_kg(k)).sum();
                j.axis.dot(gravity) * mass
            }
        }
    }

    /// Generalised force on a joint of one kilogram at the tip.
    fn tip_torque_nm(&self, joint: usize, gravity: &Vector3<f64>) -> f64 {
        let j = &self.joints[joint];
        match j.motion {
            Motion::Revolute => j.axis.dot(&(self.tip_m - j.origin_m).cross(gravity)),
            Motion::Prismatic => j.axis.dot(gravity),
        }
    }
}

/// Gravity torque on one joint at the nominal chain, split so that unknown masses can be told apart.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Torque {
    /// Of all links with their default masses [N m] (prismatic: [N]). Positive pushes towards +q.
    pub links_nm: f64,
    /// The part of it that the links beyond the joint's own cause.
    pub outer_nm: f64,
    /// Of the load at the tip.
    pub load_nm: f64,
}

impl Torque {
    /// Links and load together [N m].
    pub fn total_nm(&self) -> f64 {
        self.links_nm + self.load_nm
    }
}

/// Everything that may drive an effect in one observation.
#[derive(Debug, Clone, PartialEq)]
pub struct Drivers<'o> {
    /// The observation itself: readings, effort, load, temperature, reference.
    pub observation: &'o Observation,
    /// Direction of arrival of each joint: +1, -1, or 0 where it is not known.
    pub arrival: Vec<f64>,
    /// Gravity torque on each joint.
    pub torque: Vec<Torque>,
    /// Time since the start of the session [s].
    pub time_s: f64,
    /// The same as a fraction of the session, 0 to 1.
    pub session_fraction: f64,
    /// Temperature above the session's mean [K]; 0 where it is not known.
    pub warming_k: f64,
    /// Gravity in the world [m/s^2].
    pub gravity_mps2: Vector3<f64>,
    pub(crate) pose: NominalPose,
    /// Where the board was measured in the world [m], in the recording of a seated tip.
    pub(crate) board_m: Option<Vector3<f64>>,
}

impl<'o> Drivers<'o> {
    pub(crate) fn of(
        session: &Session,
        pose: NominalPose,
        board_m: Option<Vector3<f64>>,
        o: &'o Observation,
    ) -> Drivers<'o> {
        let gravity = gravity_in_world(session, &pose);
        let torque = (0..pose.joints.len())
            .map(|j| Torque {
                links_nm: pose.torque_nm(j, j, &gravity),
                outer_nm: pose.torque_nm(j, j + 1, &gravity),
                load_nm: pose.tip_torque_nm(j, &gravity) * o.load_kg,
            })
            .collect();
        let time_s = (o.time_ns - session.start_ns) as f64 * 1e-9;
        let duration_s = session.duration_s();
        let warming = o.temperature_c.zip(session.reference_temperature_c).map(|(now, mean)| now - mean);
        Drivers {
            observation: o,
            arrival: (0..pose.joints.len())
                .map(|j| o.arrival.get(j).map_or(0.0, |arrival| arrival.sign()))
                .collect(),
            torque,
            time_s,
            session_fraction: if duration_s > 0.0 { time_s / duration_s } else { 0.0 },
            warming_k: warming.unwrap_or(0.0),
            gravity_mps2: gravity,
            pose,
            board_m,
        }
    }

    /// Reading of a joint [rad] (prismatic: [m]); NaN where the observation has none.
    pub fn joint_rad(&self, joint: usize) -> f64 {
        self.observation.joint_rad.get(joint).copied().unwrap_or(f64::NAN)
    }

    /// Where the base was measured in the world [m].
    pub(crate) fn base_m(&self) -> Vector3<f64> {
        self.pose.slots.get(BASE).map_or_else(Vector3::zeros, |base| base.translation_m)
    }

    /// How far the joint's reading is from that of the rest before [rad] (prismatic: [m]); 0 where that is not known.
    pub fn moved_rad(&self, joint: usize) -> f64 {
        self.observation.moved_rad.as_ref().and_then(|all| all.get(joint)).copied().unwrap_or(0.0)
    }

    /// Generalised force on a joint of one kilogram at the tip [N m] (prismatic: [N]).
    pub(crate) fn kilogram_nm(&self, joint: usize) -> f64 {
        self.pose.tip_torque_nm(joint, &self.gravity_mps2)
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

/// The slot behind the base segment: the base frame itself.
pub(crate) const BASE: usize = 1;

pub(crate) fn gravity_in_world(session: &Session, pose: &NominalPose) -> Vector3<f64> {
    match (session.gravity_in_base_mps2, pose.slots.get(BASE)) {
        (Some(in_base), Some(base)) => base.rotation * in_base,
        _ => session.gravity_in_world_mps2,
    }
}
