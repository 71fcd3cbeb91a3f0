//! The frames around the robot: base, tip, boards. Their poses are parameters like any other.

use crate::ModelError;
use crate::rigid::Rigid;
use crate::segment::{Freedom, Geometry, Segment};
use armcal_core::{Parameter, Pose, Role, Unit};

/// Prior of an estimated frame's position [m]: wide enough to say nothing, finite so that a direction
/// the data do not see stays where it was.
const ESTIMATED_SIGMA_M: f64 = 0.5;
/// Prior of an estimated frame's rotation [rad].
const ESTIMATED_SIGMA_RAD: f64 = 0.5;

/// What is known about a frame before the fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Knowledge {
    /// Its pose is given: its parameters are fixed.
    Given,
    /// Its pose was measured: its parameters are free within this prior.
    Measured {
        /// Standard error of each coordinate [m].
        sigma_m: f64,
        /// Standard error about each axis [rad].
        sigma_rad: f64,
    },
    /// Nobody knows: its parameters are free (prior 0.5 m, 0.5 rad about the starting pose).
    Estimated,
}

/// A frame with its six (or three) parameters.
///
/// `<name>.x/.y/.z` [m] are its position in the frame it is expressed in; `<name>.rx/.ry/.rz` [rad] a
/// rotation vector about its own axes, zero at nominal: `R = R_nominal Exp(r)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Prefix of its parameters: `base`, `tip`, `board.<recording name>`.
    pub name: String,
    /// Pose before the fit.
    pub pose: Pose,
    /// How well that is known.
    pub knowledge: Knowledge,
    /// Whether its rotation is a parameter too; not so for a tip that only its position is seen of.
    pub free_rotation: bool,
}

/// All frames of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct Frames {
    /// world_from_base.
    pub base: Frame,
    /// last link_from_tip.
    pub tip: Frame,
    /// What else is measured of the arm, by the links it is on.
    pub markers: Vec<Marker>,
    /// world_from_board, one a recording: index = `DwellId.recording`. Empty without boards.
    pub boards: Vec<Frame>,
}

/// The frames of one arm of several.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmFrames {
    /// world_from_base.
    pub base: Frame,
    /// last link_from_tip.
    pub tip: Frame,
}

/// A marker on a link of the arm.
#[derive(Debug, Clone, PartialEq)]
pub struct Marker {
    /// The link of a URDF, or the row of a DH table, that it is on.
    pub link: String,
    /// link_from_marker.
    pub frame: Frame,
}

impl Frames {
    /// The arm alone: base at the world's origin, tip at the last link, no boards, all given.
    pub fn of_bare_arm() -> Frames {
        Frames {
            base: Frame::given("base", Pose::identity()),
            tip: Frame::given("tip", Pose::identity()),
            markers: Vec::new(),
            boards: Vec::new(),
        }
    }
}

impl Frame {
    /// A frame of which nothing is in doubt.
    pub fn given(name: impl Into<String>, pose: Pose) -> Frame {
        Frame { name: name.into(), pose, knowledge: Knowledge::Given, free_rotation: true }
    }

    /// A frame to be estimated from a starting pose.
    pub fn estimated(name: impl Into<String>, pose: Pose) -> Frame {
        Frame { knowledge: Knowledge::Estimated, ..Frame::given(name, pose) }
    }

    /// The segment of this frame and its parameters, which start at index `first`.
    pub(crate) fn segment(&self, first: usize) -> Result<(Segment, Vec<Parameter>), ModelError> {
        self.segment_with(if self.free_rotation { Freedom::Full } else { Freedom::Position }, first)
    }

    /// The same with parameters for other parts of its pose.
    pub(crate) fn segment_with(
        &self,
        freedom: Freedom,
        first: usize,
    ) -> Result<(Segment, Vec<Parameter>), ModelError> {
        self.check()?;
        let nominal = Rigid::from(&self.pose);
        let parameters = self.parameters(freedom);
        let segment = Segment {
            parent: None,
            frame: Some(self.name.clone()),
            geometry: Geometry::Origin { nominal, freedom },
            joint: None,
            parameters: first..first + parameters.len(),
            body: None,
        };
        Ok((segment, parameters))
    }

    fn parameters(&self, freedom: Freedom) -> Vec<Parameter> {
        let (free, sigma_m, sigma_rad, role) = match self.knowledge {
            Knowledge::Given => (false, None, None, Role::KnownFrame),
            Knowledge::Measured { sigma_m, sigma_rad } => {
                (true, Some(sigma_m), Some(sigma_rad), Role::KnownFrame)
            }
            Knowledge::Estimated => {
                (true, Some(ESTIMATED_SIGMA_M), Some(ESTIMATED_SIGMA_RAD), Role::EstimatedFrame)
            }
        };
        let parameter =
            |(quantity, unit, nominal, prior_sigma, meaning): (&str, _, f64, Option<f64>, String)| {
                Parameter {
                    // A measurement without error leaves nothing to fit.
                    free: free && prior_sigma != Some(0.0),
                    prior_sigma: prior_sigma.filter(|sigma| *sigma > 0.0),
                    ..Parameter::fixed(format!("{}.{quantity}", self.name), unit, nominal, role, meaning)
                }
            };
        let at = self.pose.translation.vector;
        let along = |axis| format!("position of {} along {axis}", self.name);
        let about = |axis| format!("rotation of {} about its own {axis}", self.name);
        let turned = |quantity, axis| parameter((quantity, Unit::Radian, 0.0, sigma_rad, about(axis)));
        if freedom == Freedom::Plane {
            let meaning = format!("offset of {} along its normal", self.name);
            let offset = parameter(("z", Unit::Metre, 0.0, sigma_m, meaning));
            return vec![offset, turned("rx", "x"), turned("ry", "y")];
        }
        let mut parameters = vec![
            parameter(("x", Unit::Metre, at.x, sigma_m, along("x"))),
            parameter(("y", Unit::Metre, at.y, sigma_m, along("y"))),
            parameter(("z", Unit::Metre, at.z, sigma_m, along("z"))),
        ];
        if freedom == Freedom::Full {
            parameters.extend([turned("rx", "x"), turned("ry", "y"), turned("rz", "z")]);
        }
        parameters
    }

    fn check(&self) -> Result<(), ModelError> {
        let bad = |problem| Err(ModelError::BadFrame { frame: self.name.clone(), problem });
        if self.name.is_empty() {
            return bad("it has no name");
        }
        if !self.pose.to_homogeneous().iter().all(|x| x.is_finite()) {
            return bad("its pose is not finite");
        }
        match self.knowledge {
            Knowledge::Measured { sigma_m, sigma_rad }
                if !(sigma_m >= 0.0 && sigma_rad >= 0.0 && sigma_m.is_finite() && sigma_rad.is_finite()) =>
            {
                bad("the standard errors of its pose must be finite and not negative")
            }
            _ => Ok(()),
        }
    }
}
