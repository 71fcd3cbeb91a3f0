//! What the fit sees: a joint reading and a reference for where the tip was.

use crate::{Against, Arrival, DwellId, FeatureId, Reference};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// What was measured: a feature, and against what; nothing where a sensor saw it or a table held it.
pub type Measured = (FeatureId, Option<Against>);

/// A load at a point of the arm.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Load {
    /// The point it hangs at.
    pub at: FeatureId,
    /// Its mass [kg].
    pub kg: f64,
}

/// One row of the calibration: `measured - predicted` [m] with its covariance and provenance.
///
/// A pose in which several features were measured is as many observations of one dwell, one behind the other: they share the
/// joint readings, and with them the encoders' noise.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Observation {
    /// The dwell it comes from.
    pub dwell: DwellId,
    /// What was measured of the arm.
    #[serde(default, skip_serializing_if = "FeatureId::is_tip")]
    pub feature: FeatureId,
    /// Middle of the dwell [ns], robot clock.
    pub time_ns: i64,
    /// Joint readings [rad].
    pub joint_rad: Vec<f64>,
    /// Standard error of the joint readings [rad].
    pub joint_sigma_rad: Vec<f64>,
    /// Direction of arrival of each joint.
    pub arrival: Vec<Arrival>,
    /// What each joint's encoder went through before it came to rest [rad]: the extrema of its path that still
    /// matter to a hysteresis, oldest first, the reading at rest last; empty for a joint whose past is not
    /// recorded. `None` where nobody worked it out.
    pub path_memory_rad: Option<Vec<Vec<f64>>>,
    /// The same of the sum and of the difference `q_(k+1) + q_k`, `q_(k+1) - q_k` of every two neighbours, for gaps
    /// that lie in a belt which passes a joint. `None` where nobody worked it out.
    pub pair_memory_rad: Option<Vec<[Vec<f64>; 2]>>,
    /// How far each joint's reading is from that of the rest before, in the same recording [rad]; `None` for the first
    /// rest, and where nobody worked it out.
    #[serde(default)]
    pub moved_rad: Option<Vec<f64>>,
    /// Joint velocities [rad/s] of an observation of the moving arm; `None` in a dwell, where they are zero.
    pub joint_velocity_radps: Option<Vec<f64>>,
    /// Measured effort of each joint [N m]; NaN, in JSON `null`, of one without; `None` where no joint has any.
    #[serde(default, deserialize_with = "crate::gaps::deserialize")]
    pub effort_nm: Option<Vec<f64>>,
    /// Temperature [degC], where the recording has it.
    pub temperature_c: Option<f64>,
    /// Load at the tip, of several arms the first one's [kg].
    pub load_kg: f64,
    /// Loads at other points of the arm.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub more_loads: Vec<Load>,
    /// How the true position is known.
    pub reference: Reference,
    /// Covariance of the measured position [m^2]: sensor, cavity tolerance and seat clearance.
    pub covariance_m2: Matrix3<f64>,
}

/// What the kind of its reference says of it: the one place where kinds are told apart, beside the rows that the model makes of them.
impl Observation {
    /// The cavity, if the tip was seated.
    pub fn cavity(&self) -> Option<&str> {
        match &self.reference {
            Reference::Seated { cavity, .. } => Some(cavity),
            _ => None,
        }
    }

    /// Centre of the cavity that the tip was seated in, in the frame of the board [m].
    pub fn in_board_m(&self) -> Option<&Vector3<f64>> {
        match &self.reference {
            Reference::Seated { in_board_m, .. } => Some(in_board_m),
            _ => None,
        }
    }

    /// Where a sensor saw it [m].
    pub fn seen_m(&self) -> Option<&Vector3<f64>> {
        match &self.reference {
            Reference::Tracked { position_m, .. } => Some(position_m),
            _ => None,
        }
    }

    /// How a sensor saw it turned, and the standard error of that about each axis [rad].
    pub fn seen_orientation(&self) -> Option<(&UnitQuaternion<f64>, f64)> {
        match &self.reference {
            Reference::Tracked { orientation, orientation_sigma_rad, .. } => {
                Some((orientation.as_ref()?, *orientation_sigma_rad))
            }
            _ => None,
        }
    }

    /// The place of the model that it was measured against; none of what a sensor saw, or of a cavity.
    pub fn against(&self) -> Option<Against> {
        match self.reference {
            Reference::Joined { to } | Reference::Number { to, .. } => Some(to),
            Reference::Seated { .. } | Reference::Tracked { .. } => None,
        }
    }

    /// Which of the model's lengths a number counts from.
    pub fn length(&self) -> Option<usize> {
        match self.reference {
            Reference::Number { length, .. } => length,
            _ => None,
        }
    }

    /// Whether one number was measured, a distance or a height, and not a position.
    pub fn is_scalar(&self) -> bool {
        matches!(self.reference, Reference::Number { .. })
    }

    /// What was measured, in words, and its coordinates or the one number [m]; none of what is only joined.
    pub fn measured_values(&self) -> (&'static str, &[f64]) {
        match &self.reference {
            Reference::Seated { in_board_m, .. } => ("the position of the cavity", in_board_m.as_slice()),
            Reference::Tracked { position_m, .. } => ("the measured position", position_m.as_slice()),
            Reference::Number { reading_m, .. } => ("the reading", std::slice::from_ref(reading_m)),
            Reference::Joined { .. } => ("nothing", &[]),
        }
    }
}

impl Observation {
    /// A joint reading [rad] and where the tip was; both exact, and nothing else known about the dwell.
    pub fn bare(dwell: DwellId, joint_rad: Vec<f64>, reference: Reference) -> Observation {
        Observation {
            dwell,
            feature: FeatureId::TIP,
            time_ns: 0,
            joint_sigma_rad: vec![0.0; joint_rad.len()],
            arrival: vec![Arrival::Unknown; joint_rad.len()],
            joint_rad,
            path_memory_rad: None,
            pair_memory_rad: None,
            moved_rad: None,
            joint_velocity_radps: None,
            effort_nm: None,
            temperature_c: None,
            load_kg: 0.0,
            more_loads: Vec::new(),
            reference,
            covariance_m2: Matrix3::zeros(),
        }
    }

    /// Measured effort of one joint [N m], where it has one.
    pub fn effort_of(&self, joint: usize) -> Option<f64> {
        self.effort_nm.as_ref()?.get(joint).copied().filter(|effort| effort.is_finite())
    }

    /// All loads, that of the tip first.
    pub fn loads(&self) -> impl Iterator<Item = Load> {
        std::iter::once(Load { at: FeatureId::TIP, kg: self.load_kg }).chain(self.more_loads.iter().copied())
    }

    /// All loads together [kg].
    pub fn all_loads_kg(&self) -> f64 {
        self.more_loads.iter().fold(self.load_kg, |sum, load| sum + load.kg)
    }

    /// What was measured; a dwell has one observation of each.
    pub fn what(&self) -> Measured {
        (self.feature, self.against())
    }

    /// Whether a sensor saw where it was.
    pub fn is_tracked(&self) -> bool {
        self.seen_m().is_some()
    }

    /// Rows of position: one of a distance or a height, three otherwise.
    pub fn position_rows(&self) -> usize {
        if self.is_scalar() { 1 } else { 3 }
    }

    /// Whether two points of the arms are each other's reference.
    pub fn is_joined(&self) -> bool {
        matches!(self.against(), Some(Against::Feature(_)))
    }
}

/// A dwell that does not take part in the fit. It stays visible in every output.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rejection {
    /// The dwell.
    pub dwell: DwellId,
    /// Why, in a sentence that says what was seen and what would be needed.
    pub why: String,
}
