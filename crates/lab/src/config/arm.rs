//! The arm: its nominal geometry, how far the built one deviates, its drives.

use crate::LabError;
use crate::arm::DhRow;
use crate::checks::{check_not_negative, check_positive, value_error};
use serde::{Deserialize, Serialize};

/// The arm as designed, and by how much the built one may differ.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ArmConfig {
    /// Nominal DH rows from base to tip (standard convention, the paper's eq. 9-10).
    pub rows: Vec<DhRow>,
    /// How far the built arm deviates.
    pub deviation: DeviationConfig,
    /// One drive a joint.
    pub drives: Vec<DriveConfig>,
    /// Mass of the tool at the tip [kg]. Default 0.15.
    pub tip_kg: f64,
    /// Where the arm waits before and after the task [deg], motor side.
    pub home_deg: Vec<f64>,
}

/// Half widths of the uniform distributions from which the built arm is drawn, for every entry of every row.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DeviationConfig {
    /// Of `d` and `a` [mm]. Default 5, the paper's bound.
    pub length_mm: f64,
    /// Of `theta` and `alpha` [deg]. Default 2, the paper's bound.
    pub angle_deg: f64,
    /// Of the masses of links and tool [%]. Default 0.
    #[serde(skip_serializing_if = "super::is_default")]
    pub mass_percent: f64,
}

/// Motor, gear, link and controller of one joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DriveConfig {
    /// Inertia about the axis, rotor included [kg m^2].
    pub inertia_kg_m2: f64,
    /// Viscous friction [N m s/rad].
    pub viscous_nms_rad: f64,
    /// Mass of the link, at its middle [kg].
    pub link_kg: f64,
    /// Proportional gain [N m/rad].
    pub kp_nm_rad: f64,
    /// Integral gain [N m/(rad s)].
    pub ki_nm_rad_s: f64,
    /// Derivative gain [N m s/rad].
    pub kd_nms_rad: f64,
    /// Largest torque of the motor at the joint [N m].
    pub max_torque_nm: f64,
}

impl Default for ArmConfig {
    /// The paper's right arm (eq. 11-14).
    fn default() -> ArmConfig {
        let row = |name: &str, joint, theta_deg, d_m, a_m, alpha_deg| DhRow {
            name: name.into(),
            joint,
            theta_deg,
            d_m,
            a_m,
            alpha_deg,
        };
        let drive = |inertia_kg_m2, viscous_nms_rad, link_kg, kp_nm_rad, max_torque_nm| DriveConfig {
            inertia_kg_m2,
            viscous_nms_rad,
            link_kg,
            kp_nm_rad,
            // Integral and derivative in fixed proportion: double real pole near 28 rad/s, 0.2 s reset time.
            ki_nm_rad_s: 5.0 * kp_nm_rad,
            kd_nms_rad: 0.07 * kp_nm_rad,
            max_torque_nm,
        };
        ArmConfig {
            rows: vec![
                row("joint1", true, 0.0, 0.076, 0.0, 90.0),
                row("joint2", true, 90.0, 0.0, 0.4, 0.0),
                row("joint3", true, 0.0, -0.012, 0.0, 90.0),
                row("tool", false, 0.0, 0.3543, 0.0, 90.0),
            ],
            deviation: DeviationConfig::default(),
            drives: vec![
                drive(0.20, 0.8, 1.5, 160.0, 40.0),
                drive(0.30, 1.0, 1.2, 240.0, 40.0),
                drive(0.08, 0.4, 0.6, 64.0, 15.0),
            ],
            tip_kg: 0.15,
            home_deg: vec![0.0, -30.0, 10.0],
        }
    }
}

impl Default for DeviationConfig {
    fn default() -> DeviationConfig {
        DeviationConfig { length_mm: 5.0, angle_deg: 2.0, mass_percent: 0.0 }
    }
}

impl ArmConfig {
    pub(super) fn check(&self) -> Result<(), LabError> {
        check_not_negative("arm.deviation.length_mm", self.deviation.length_mm)?;
        check_not_negative("arm.deviation.angle_deg", self.deviation.angle_deg)?;
        check_not_negative("arm.tip_kg", self.tip_kg)?;
        check_not_negative("arm.deviation.mass_percent", self.deviation.mass_percent)?;
        if self.deviation.mass_percent >= 100.0 {
            return Err(value_error("arm.deviation.mass_percent", "must stay below 100".into()));
        }
        if !self.rows[0].joint {
            return Err(value_error(
                "arm.rows",
                "the first row must be a joint; put a fixed base into `base`".into(),
            ));
        }
        for row in &self.rows {
            if [row.theta_deg, row.d_m, row.a_m, row.alpha_deg].iter().any(|v| !v.is_finite()) {
                return Err(value_error(
                    "arm.rows",
                    format!("row `{}` has a number that is not finite", row.name),
                ));
            }
        }
        for drive in &self.drives {
            check_positive("arm.drives.inertia_kg_m2", drive.inertia_kg_m2)?;
            check_not_negative("arm.drives.viscous_nms_rad", drive.viscous_nms_rad)?;
            check_not_negative("arm.drives.link_kg", drive.link_kg)?;
            check_positive("arm.drives.kp_nm_rad", drive.kp_nm_rad)?;
            check_not_negative("arm.drives.ki_nm_rad_s", drive.ki_nm_rad_s)?;
            check_not_negative("arm.drives.kd_nms_rad", drive.kd_nms_rad)?;
            check_positive("arm.drives.max_torque_nm", drive.max_torque_nm)?;
        }
        Ok(())
    }
}
