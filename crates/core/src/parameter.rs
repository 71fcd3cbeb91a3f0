//! A number the fit may change.

use crate::Unit;
use serde::Serialize;

/// One parameter of the model: name, unit, bounds, prior, meaning. No magic indices.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Parameter {
    /// Unique name, `<part>.<quantity>`: `joint2.theta`, `base.yaw`, `board.roll.x`.
    pub name: String,
    /// SI unit of the value.
    pub unit: Unit,
    /// Value before calibration; also the centre of the prior.
    pub nominal: f64,
    /// Smallest value allowed; `-inf` when unbounded.
    pub lower: f64,
    /// Largest value allowed; `+inf` when unbounded.
    pub upper: f64,
    /// Standard deviation of what is known about it before the data; `None` means nothing is.
    pub prior_sigma: Option<f64>,
    /// The size that it usually has, where that is less than its prior says: what happens is small as a rule, and any size now and
    /// then.
    #[serde(skip)]
    pub usual: Option<f64>,
    /// Where nobody declared bounds and prior: what it is one of. A fit may then learn how far those of a kind are from
    /// nominal; `prior_sigma` is the most that it may be.
    #[serde(skip)]
    pub assumed: Option<ParameterKind>,
    /// Whether the fit may change it.
    pub free: bool,
    /// Whether it places a frame (base, tip point, board) rather than describing the robot.
    /// Frames that nobody could know are fitted before the nominal error is judged.
    pub role: Role,
    /// What it means, in words.
    pub meaning: String,
}

impl Parameter {
    /// One that the fit leaves where it is, without bounds.
    pub fn fixed(name: String, unit: Unit, nominal: f64, role: Role, meaning: String) -> Parameter {
        Parameter {
            name,
            unit,
            nominal,
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
            prior_sigma: None,
            usual: None,
            assumed: None,
            free: false,
            role,
            meaning,
        }
    }
}

/// What robot parameters are built and adjusted like.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ParameterKind {
    /// A length between joints: machined.
    Length,
    /// An angle between axes: machined.
    Angle,
    /// The zero of a joint: set by whoever mounted the encoder.
    JointZero,
}

impl ParameterKind {
    /// In words, many of them.
    pub fn words(self) -> &'static str {
        match self {
            ParameterKind::Length => "lengths",
            ParameterKind::Angle => "angles between axes",
            ParameterKind::JointZero => "joint zeros",
        }
    }
}

/// What a parameter belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// Robot geometry: a DH entry or a URDF joint origin.
    Robot,
    /// A frame whose pose was not known beforehand and is estimated with the data.
    EstimatedFrame,
    /// A frame whose pose was measured or given; free only within its prior, or fixed.
    KnownFrame,
    /// A physical effect beyond geometry.
    Effect,
}
