//! All that nobody lists, together: the tip is off by a smooth function of where the whole arm is.

use super::*;

/// `kind = "waves"`: a sum of waves over the joint angles, each with a direction of its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Waves {
    /// The waves.
    pub waves: Vec<Wave>,
}

/// One wave: `shift_mm cos(per_rad . q + phase_rad)`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wave {
    /// How fast its phase grows with each joint's angle [rad/rad].
    pub per_rad: Vec<f64>,
    /// Phase at joint zero [rad].
    pub phase_rad: f64,
    /// Shift of the tip at its crest, in the axes of the last link [mm].
    pub shift_mm: [f64; 3],
}

impl Waves {
    /// How far the tip is off, in the axes of the last link [m].
    pub fn shift_m(&self, link_rad: &[f64]) -> Vector3<f64> {
        let crest = |wave: &Wave| {
            let phase: f64 = wave.per_rad.iter().zip(link_rad).map(|(per_rad, q)| per_rad * q).sum();
            Vector3::from(wave.shift_mm) * (1e-3 * (phase + wave.phase_rad).cos())
        };
        self.waves.iter().map(crest).sum()
    }
}

impl Mechanism for Waves {
    fn reshape_arm(&self, now: &RigState<'_>, arm: &mut AxisArm) {
        arm.tip_m += self.shift_m(now.link_rad);
    }
}

impl Hidden for Waves {
    fn check(&self, keys: &Keys) -> Result<(), LabError> {
        for wave in &self.waves {
            if wave.per_rad.len() != keys.joints {
                let why =
                    format!("must have one number a joint, {}, has {}", keys.joints, wave.per_rad.len());
                return Err(keys.wrong("waves.per_rad", why));
            }
            wave.per_rad.iter().try_for_each(|v| keys.within("waves.per_rad", *v, [-100.0, 100.0]))?;
            keys.finite("waves.phase_rad", wave.phase_rad)?;
            wave.shift_mm.iter().try_for_each(|v| keys.within("waves.shift_mm", *v, [-100.0, 100.0]))?;
        }
        Ok(())
    }
}
