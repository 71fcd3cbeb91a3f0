//! What is asked for: where the tip should be, and under which conditions the arm goes there.

use crate::CompensateError;
use armcal_core::{DwellId, FeatureId, Load, Observation, Reference};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// An arm with fewer joints cannot be given an orientation.
pub const ORIENTING_JOINTS: usize = 6;

/// A place for the tip.
#[derive(Debug, Clone, PartialEq)]
pub struct Target {
    /// Its name, in tables and errors.
    pub name: String,
    /// The place: `Tracked` is a point (and, where it has one, an orientation) in the world as the sensor would see
    /// it, `Seated` a point on the board of [`Conditions::recording`].
    pub place: Reference,
    /// When the tip should pass it [s]; absent: it stops there.
    pub time_s: Option<f64>,
}

impl Target {
    /// A tip position in the world [m], and an orientation where one is wanted.
    pub fn in_world(
        name: impl Into<String>,
        position_m: Vector3<f64>,
        orientation: Option<UnitQuaternion<f64>>,
    ) -> Target {
        let place = Reference::Tracked { position_m, orientation, orientation_sigma_rad: 0.0 };
        Target { name: name.into(), place, time_s: None }
    }

    /// A point on a board, in the board's frame [m].
    pub fn on_board(name: impl Into<String>, in_board_m: Vector3<f64>) -> Target {
        let name = name.into();
        Target { place: Reference::Seated { cavity: name.clone(), in_board_m }, name, time_s: None }
    }

    /// The same at a time [s].
    pub fn at(self, time_s: f64) -> Target {
        Target { time_s: Some(time_s), ..self }
    }

    /// The position, in the frame it is given in [m].
    pub fn position_m(&self) -> Vector3<f64> {
        match &self.place {
            Reference::Tracked { position_m, .. } => *position_m,
            Reference::Seated { in_board_m, .. } => *in_board_m,
            // No target is asked for against another place of the model.
            _ => Vector3::repeat(f64::NAN),
        }
    }

    /// Whether an orientation is asked for too.
    pub fn has_orientation(&self) -> bool {
        matches!(self.place, Reference::Tracked { orientation: Some(_), .. })
    }

    /// Checks numbers, and that the arm has joints enough for what is asked.
    pub(crate) fn check(&self, joints: usize) -> Result<(), CompensateError> {
        let bad = |problem: &str| {
            Err(CompensateError::BadTarget { target: self.name.clone(), problem: problem.to_owned() })
        };
        if !self.position_m().iter().all(|v| v.is_finite()) || self.time_s.is_some_and(|t| !t.is_finite()) {
            return bad("a coordinate or its time is not a finite number; correct the file");
        }
        if let Reference::Tracked { orientation: Some(q), .. } = &self.place
            && !q.coords.iter().all(|v| v.is_finite())
        {
            return bad("its orientation is no rotation; give a quaternion of any length but zero");
        }
        if self.has_orientation() && joints < ORIENTING_JOINTS {
            return bad(&format!(
                "an arm of {joints} joints cannot be given an orientation; leave qx, qy, qz, qw out"
            ));
        }
        Ok(())
    }
}

/// Under which conditions the arm will be driven.
#[derive(Debug, Clone, PartialEq)]
pub struct Conditions {
    /// What is brought to the targets: the tip, the tip of another arm or branch, a marker.
    pub feature: FeatureId,
    /// The recording as in which the arm is, from 0: whose board stands there, and which events have happened.
    pub recording: usize,
    /// The last dwell of that recording: events that begin at a dwell have happened.
    pub dwell: usize,
    /// Time of the first target [ns], on the clock of the recordings: what drifts has drifted until then.
    pub time_ns: i64,
    /// Load at the tip [kg].
    pub load_kg: f64,
    /// Loads at other points of the arm.
    pub more_loads: Vec<Load>,
    /// Temperature [degC]; absent: the mean of the session.
    pub temperature_c: Option<f64>,
}

impl Conditions {
    /// A target as the model sees it, joints still at nothing.
    pub(crate) fn observation(&self, target: &Target, joints: usize) -> Observation {
        let after_ns = (target.time_s.unwrap_or(0.0) * 1e9).round() as i64;
        let dwell = DwellId { recording: self.recording, dwell: self.dwell };
        Observation {
            feature: self.feature,
            time_ns: self.time_ns.saturating_add(after_ns),
            arrival: Vec::new(),
            temperature_c: self.temperature_c,
            load_kg: self.load_kg,
            more_loads: self.more_loads.clone(),
            covariance_m2: Matrix3::identity(),
            ..Observation::bare(dwell, vec![0.0; joints], target.place.clone())
        }
    }
}
