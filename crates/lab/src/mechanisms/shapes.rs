//! Shapes of transmission error: rings, pinions, ratios, damage, buffers.

use super::gear::Lead;
use super::*;

/// `kind = "second_harmonic"`: a ring pressed oval reads ahead twice a turn.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SecondHarmonic {
    /// The joint.
    pub joint: usize,
    /// Largest error [deg].
    pub amplitude_deg: f64,
    /// Direction of the long axis [deg].
    #[serde(default)]
    pub phase_deg: f64,
}

/// `kind = "tooth_runout"`: a pinion, or its tooth, that comes round many times a turn of the joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ToothRunout {
    /// The joint.
    pub joint: usize,
    /// Largest error [deg].
    pub amplitude_deg: f64,
    /// Times a turn of the joint.
    pub per_turn: f64,
    /// Phase [deg].
    #[serde(default)]
    pub phase_deg: f64,
}

/// `kind = "gear_ratio"`: the motor turns more, or less, for a turn of the joint than the drawing says.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GearRatio {
    /// The joint.
    pub joint: usize,
    /// By how much the link turns further than the reading [%].
    pub error_percent: f64,
}

/// `kind = "damaged_teeth"`: the gear is raised in one region.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DamagedTeeth {
    /// The joint.
    pub joint: usize,
    /// Error in the middle of the region [deg].
    pub height_deg: f64,
    /// Where that is [deg].
    pub centre_deg: f64,
    /// Distance from there to its edge [deg].
    pub span_deg: f64,
}

/// `kind = "sawtooth"`: each tooth runs ahead and falls back.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sawtooth {
    /// The joint.
    pub joint: usize,
    /// Largest error [deg].
    pub amplitude_deg: f64,
    /// Teeth a turn of the joint.
    pub per_turn: f64,
}

/// `kind = "soft_stop"`: beyond an angle the link leans on a rubber buffer, and the gear gives.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SoftStop {
    /// The joint.
    pub joint: usize,
    /// Where the buffer begins [deg]; it fills the side away from 0.
    pub from_deg: f64,
    /// How much the link falls behind for what the motor goes on [%].
    pub give_percent: f64,
}

impl Lead for SecondHarmonic {
    fn joint(&self) -> usize {
        self.joint
    }

    /// A point of an ellipse with axes `1 + k` and `1 - k` is seen from its centre ahead of its own parameter by
    /// `atan(k sin 2t / (1 + k cos 2t))`: a second harmonic with a small fourth.
    fn lead_rad(&self, link_rad: f64) -> f64 {
        let oval = self.amplitude_deg.to_radians();
        let (sin, cos) = (2.0 * (link_rad - self.phase_deg.to_radians())).sin_cos();
        (oval * sin).atan2(1.0 + oval * cos)
    }
}

impl Lead for ToothRunout {
    fn joint(&self) -> usize {
        self.joint
    }

    fn lead_rad(&self, link_rad: f64) -> f64 {
        self.amplitude_deg.to_radians() * (self.per_turn * link_rad + self.phase_deg.to_radians()).sin()
    }
}

impl Lead for GearRatio {
    fn joint(&self) -> usize {
        self.joint
    }

    fn lead_rad(&self, link_rad: f64) -> f64 {
        let error = self.error_percent / 100.0;
        -link_rad * error / (1.0 + error)
    }
}

impl Lead for DamagedTeeth {
    fn joint(&self) -> usize {
        self.joint
    }

    fn lead_rad(&self, link_rad: f64) -> f64 {
        let from_centre = (link_rad.to_degrees() - self.centre_deg) / self.span_deg;
        if from_centre.abs() >= 1.0 {
            return 0.0;
        }
        let raised = (1.0 + (std::f64::consts::PI * from_centre).cos()) / 2.0;
        self.height_deg.to_radians() * raised
    }
}

impl Lead for Sawtooth {
    fn joint(&self) -> usize {
        self.joint
    }

    fn lead_rad(&self, link_rad: f64) -> f64 {
        let tooth = (self.per_turn * link_rad / std::f64::consts::TAU).rem_euclid(1.0);
        // The fall back takes a tenth of a tooth: a step would leave motor angles without a link angle.
        let height = if tooth < 0.9 { tooth / 0.9 } else { (1.0 - tooth) / 0.1 };
        self.amplitude_deg.to_radians() * (2.0 * height - 1.0)
    }
}

impl Lead for SoftStop {
    fn joint(&self) -> usize {
        self.joint
    }

    fn lead_rad(&self, link_rad: f64) -> f64 {
        let side = if self.from_deg < 0.0 { -1.0 } else { 1.0 };
        let beyond = (side * (link_rad - self.from_deg.to_radians())).max(0.0);
        side * beyond * self.give_percent / 100.0
    }
}

macro_rules! geared {
    ($name:ident, $($key:ident in [$low:expr, $high:expr]),*) => {
        impl Hidden for $name {
            fn check(&self, keys: &Keys) -> Result<(), LabError> {
                keys.joint("joint", self.joint)?;
                $(keys.within(stringify!($key), self.$key, [$low, $high])?;)*
                Ok(())
            }
        }
    };
}

geared!(SecondHarmonic, amplitude_deg in [0.0, 10.0], phase_deg in [-360.0, 360.0]);
geared!(ToothRunout, amplitude_deg in [0.0, 10.0], per_turn in [1.0, 1e4], phase_deg in [-360.0, 360.0]);
geared!(GearRatio, error_percent in [-50.0, 50.0]);
geared!(DamagedTeeth, height_deg in [-10.0, 10.0], centre_deg in [-360.0, 360.0], span_deg in [0.1, 360.0]);
geared!(Sawtooth, amplitude_deg in [0.0, 10.0], per_turn in [1.0, 1e3]);
geared!(SoftStop, from_deg in [-360.0, 360.0], give_percent in [0.0, 50.0]);
