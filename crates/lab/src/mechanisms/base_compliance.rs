//! The plate under the arm stands on springs: the arm's weight, hanging out to one side, rocks it.

use super::*;
use nalgebra::UnitQuaternion;

/// `kind = "base_compliance"`. The markers of the base rock with it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BaseCompliance {
    /// Stiffness against rocking about any horizontal axis through the base's origin [N m/rad].
    pub stiffness_nm_rad: f64,
}

impl BaseCompliance {
    /// How far the plate rocks, as a rotation vector in the base frame [rad].
    pub(super) fn rock_rad(&self, now: &RigState<'_>) -> Vector3<f64> {
        let last = now.arm.joint_count() - 1;
        let centres = now.arm.mass_centres_m.iter().enumerate();
        let mut moment: Vector3<f64> = centres
            .map(|(link, centre)| {
                let weight = now.gravity_m_s2 * now.masses_kg[link];
                now.arm.carried(link, centre, now.link_rad).cross(&weight)
            })
            .sum();
        moment += now.arm.carried(last, &now.arm.tip_m, now.link_rad).cross(&(now.gravity_m_s2 * now.tip_kg));
        Vector3::new(moment.x, moment.y, 0.0) / self.stiffness_nm_rad
    }
}

impl Mechanism for BaseCompliance {
    fn move_base(&self, now: &RigState<'_>, world_from_base: &mut Pose) {
        let rock = self.rock_rad(now);
        if rock.norm() > 0.0 {
            *world_from_base *= UnitQuaternion::from_scaled_axis(rock);
        }
    }
}

impl Hidden for BaseCompliance {
    fn check(&self, keys: &Keys) -> Result<(), LabError> {
        keys.stiff("stiffness_nm_rad", self.stiffness_nm_rad)
    }
}
