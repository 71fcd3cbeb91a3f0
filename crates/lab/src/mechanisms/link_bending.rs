//! A link that sags: a slender beam held by its own joint, loaded by its weight and by what hangs beyond it.
//!
//! The beam is cut into slices; each bends by its moment over its stiffness, and the slopes add up to the end.

use super::*;
use crate::screw::{Line, rotate_vector};

/// Slices of the beam.
const SLICES: usize = 48;

/// `kind = "link_bending"`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LinkBending {
    /// The link: the one that joint carries.
    pub link: usize,
    /// Bending stiffness `E I` of its section, the same all round [N m^2].
    pub stiffness_nm2: f64,
}

/// How the end of the beam moves: shift [m] and turn [rad].
pub(super) struct Sag {
    pub(super) shift_m: Vector3<f64>,
    pub(super) turn_rad: Vector3<f64>,
}

impl LinkBending {
    /// Force and moment that the rest of the arm puts on the end of the link, in the link's zero position.
    fn end_load(&self, now: &RigState<'_>, arm: &AxisArm, pull: &Vector3<f64>) -> [Vector3<f64>; 2] {
        let link = self.link - 1;
        let end = arm.axes[link].point_m + arm.link_m(link);
        let mut load = [Vector3::zeros(); 2];
        let mut hang = |carrier: usize, point: Vector3<f64>, mass_kg: f64| {
            let turned = |p, j: usize| arm.axes[j].turn_point(&p, now.link_rad[j]);
            let at = (link + 1..=carrier).rev().fold(point, turned);
            let force = pull * mass_kg;
            load[0] += force;
            load[1] += (at - end).cross(&force);
        };
        for beyond in link + 1..arm.joint_count() {
            hang(beyond, arm.mass_centres_m[beyond], now.masses_kg[beyond]);
        }
        hang(arm.joint_count() - 1, arm.tip_m, now.tip_kg);
        load
    }

    pub(super) fn sag(&self, now: &RigState<'_>, arm: &AxisArm) -> Sag {
        let link = self.link - 1;
        let pull = (0..=link)
            .fold(*now.gravity_m_s2, |v, j| rotate_vector(&arm.axes[j].direction, &v, -now.link_rad[j]));
        let [force, moment] = self.end_load(now, arm, &pull);
        let beam = arm.link_m(link);
        let (length, along) = (beam.norm(), beam.normalize());
        let weight = pull * (now.masses_kg[link] / length);
        let slice = length / SLICES as f64;
        let mut sag = Sag { shift_m: Vector3::zeros(), turn_rad: Vector3::zeros() };
        for i in 0..SLICES {
            let to_end = length - (i as f64 + 0.5) * slice;
            let bending = moment + along.cross(&(force * to_end + weight * (to_end * to_end / 2.0)));
            let bent = (bending - along * along.dot(&bending)) * (slice / self.stiffness_nm2);
            sag.shift_m += (sag.turn_rad + bent / 2.0).cross(&along) * slice;
            sag.turn_rad += bent;
        }
        sag
    }
}

impl Mechanism for LinkBending {
    fn reshape_arm(&self, now: &RigState<'_>, arm: &mut AxisArm) {
        let link = self.link - 1;
        let sag = self.sag(now, arm);
        let angle = sag.turn_rad.norm();
        if angle == 0.0 {
            return;
        }
        let end = arm.axes[link].point_m + arm.link_m(link);
        arm.turn_beyond(link, &Line { point_m: end, direction: sag.turn_rad / angle }, angle);
        arm.shift_beyond(link, &sag.shift_m);
    }
}

impl Hidden for LinkBending {
    fn check(&self, keys: &Keys) -> Result<(), LabError> {
        keys.joint("link", self.link)?;
        keys.stiff("stiffness_nm2", self.stiffness_nm2)
    }
}
