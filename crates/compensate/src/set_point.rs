//! A set-point, and what it reaches.

use crate::Target;
use armcal_core::Arrival;

/// What a row of the output is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A target.
    Target,
    /// A point on the way to the target that follows, from which every joint moves in a known direction.
    Approach,
}

/// What the calibrated model predicts for a target.
#[derive(Debug, Clone, PartialEq)]
pub struct Reached {
    /// Error of the tip at the nominal set-point [m].
    pub before_m: f64,
    /// The same at the corrected one [m].
    pub after_m: f64,
    /// Error of the orientation at both [rad], where one was asked for.
    pub turn_rad: Option<[f64; 2]>,
}

/// A set-point.
#[derive(Debug, Clone, PartialEq)]
pub struct SetPoint {
    /// The target.
    pub target: Target,
    /// Whether this is the target or the way to it.
    pub kind: Kind,
    /// What a controller with the nominal model commands [rad] (sliding: [m]).
    pub nominal_rad: Vec<f64>,
    /// What brings the tip there [rad] (sliding: [m]).
    pub joint_rad: Vec<f64>,
    /// Direction in which each joint arrives at the corrected set-point.
    pub arrival: Vec<Arrival>,
    /// Joints that are on their way through their gap here, as they turn back on a path: their links wait.
    pub in_gap: Vec<usize>,
    /// What both reach; `None` for an approach.
    pub reached: Option<Reached>,
    /// What the user should know.
    pub warnings: Vec<String>,
}
