//! Two arms whose tips are joined: each is the other's reference, and no camera is needed.
//!
//! ```text
//! tips in one point:      r = tip_1(q_1, p_1) - tip_2(q_2, p_2)              3 rows [m]
//! tips on a rigid link:   r = |tip_1(q_1, p_1) - tip_2(q_2, p_2)| - length   1 row  [m]
//! ```
//!
//! both tips in one world, which is the base of the arm whose base is given (Bennett and Hollerbach 1991: autonomous
//! calibration of single-loop closed kinematic chains; Zhuang and Roth 1996, ch. 9).
//!
//! * the two models side by side, with one parameter vector: [`ClosedChain`], here;
//! * residual, derivative, covariance, and the scale that joint angles alone leave open: `problem`;
//! * where the second base is, before anything is fitted: `start`;
//! * fit, hold-out and closing errors: [`calibrate_closed_chain`].

mod calibration;
mod problem;
mod start;

pub use calibration::{calibrate_closed_chain, closed_chain_nominal};
pub use problem::ClosedChainProblem;

use crate::CalibrateError;
use armcal_core::{DwellId, Observation, Parameter, Role, Unit};
use armcal_model::Model;

/// One arm of a closed chain.
#[derive(Debug, Clone, PartialEq)]
pub struct ChainArm {
    /// Its name, the prefix of its parameters: `right.joint1.theta`.
    pub name: String,
    /// The arm with its base in the common world and its tip.
    pub model: Model,
}

/// How the tips are joined.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Closure {
    /// Both tips are in one point: in one cavity, or a ball in a cup.
    SamePoint,
    /// A rigid link with a ball joint at either end keeps them this far apart [m].
    RigidLink {
        /// Distance of the two points, before the fit [m].
        length_m: f64,
        /// How well that is known.
        knowledge: LengthKnowledge,
    },
}

/// What is known about the length of a link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LengthKnowledge {
    /// It is exact.
    Given,
    /// It was measured with this standard error [m].
    Measured {
        /// Standard error [m].
        sigma_m: f64,
    },
    /// Nobody measured it: it is fitted.
    Estimated,
}

/// Two arms and how they are joined.
///
/// The parameter vector holds the first arm's parameters, the second's, then, for a link, `link.length`.
#[derive(Debug, Clone, PartialEq)]
pub struct ClosedChain {
    arms: [ChainArm; 2],
    closure: Closure,
    parameters: Vec<Parameter>,
}

/// Both arms in one dwell, joined.
#[derive(Debug, Clone, PartialEq)]
pub struct ClosedObservation {
    /// The arms in the order of the chain. What their references say is not used.
    pub arms: [Observation; 2],
    /// How far apart the joined points may be all the same, 1 sigma per axis [m]: clearance, slip, balls out of round.
    pub contact_sigma_m: f64,
}

impl ClosedObservation {
    /// The dwell.
    pub fn dwell(&self) -> DwellId {
        self.arms[0].dwell
    }
}

impl ClosedChain {
    /// Joins two arms.
    ///
    /// # Errors
    /// Two arms of one name, a name that cannot be a prefix, a length that is not positive, two bases that are both
    /// free (nothing would hold the pair in the world).
    pub fn new(arms: [ChainArm; 2], closure: Closure) -> Result<ClosedChain, CalibrateError> {
        let fail = |problem: String| Err(CalibrateError::ClosedChain { problem });
        if arms[0].name == arms[1].name {
            return fail(format!("both arms are named `{}`; give each a name of its own", arms[0].name));
        }
        for arm in &arms {
            if arm.name.is_empty() || arm.name == "link" || arm.name.contains('.') {
                return fail(format!("an arm cannot be named `{}`; use a word such as right", arm.name));
            }
        }
        let free = |arm: &&ChainArm| arm.model.parameters().iter().any(|p| p.free && is_of_base(p));
        if arms.iter().filter(free).count() == 2 {
            let [a, b] = [&arms[0].name, &arms[1].name];
            return fail(format!(
                "the bases of {a} and {b} are both free, so that nothing holds the pair in place; make one of them \
                 pose = \"given\""
            ));
        }
        let prefixed = |arm: &ChainArm| {
            let name = arm.name.clone();
            let own = arm.model.parameters().to_vec();
            own.into_iter().map(move |p| Parameter { name: format!("{name}.{}", p.name), ..p })
        };
        let mut parameters: Vec<Parameter> = arms.iter().flat_map(prefixed).collect();
        parameters.extend(closure.parameter()?);
        Ok(ClosedChain { arms, closure, parameters })
    }

    /// The arms.
    pub fn arms(&self) -> &[ChainArm; 2] {
        &self.arms
    }

    /// How they are joined.
    pub fn closure(&self) -> Closure {
        self.closure
    }

    /// Every parameter, in the order of the parameter vector.
    pub fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// The parameter vector before calibration.
    pub fn nominal(&self) -> Vec<f64> {
        self.parameters.iter().map(|p| p.nominal).collect()
    }

    /// The part of a parameter vector that is one arm's (0 or 1).
    pub fn of_arm<'p>(&self, arm: usize, p: &'p [f64]) -> &'p [f64] {
        let first = self.first(arm);
        &p[first..first + self.arms[arm].model.parameters().len()]
    }

    /// The length of the link at `p` [m]; none for tips in one point.
    pub fn link_length_m(&self, p: &[f64]) -> Option<f64> {
        matches!(self.closure, Closure::RigidLink { .. }).then(|| p[self.parameters.len() - 1])
    }

    /// Index of an arm's first parameter.
    fn first(&self, arm: usize) -> usize {
        if arm == 0 { 0 } else { self.arms[0].model.parameters().len() }
    }
}

impl Closure {
    /// `same point` or `rigid link`.
    pub fn word(self) -> &'static str {
        match self {
            Closure::SamePoint => "same point",
            Closure::RigidLink { .. } => "rigid link",
        }
    }

    fn parameter(self) -> Result<Option<Parameter>, CalibrateError> {
        let Closure::RigidLink { length_m, knowledge } = self else { return Ok(None) };
        let fail = |problem: String| Err(CalibrateError::ClosedChain { problem });
        if !(length_m.is_finite() && length_m > 0.0) {
            return fail(format!(
                "the link is {length_m} m long; give its length in millimetres, above zero"
            ));
        }
        let (free, prior_sigma, role) = match knowledge {
            LengthKnowledge::Given => (false, None, Role::KnownFrame),
            LengthKnowledge::Measured { sigma_m } if sigma_m.is_finite() && sigma_m > 0.0 => {
                (true, Some(sigma_m), Role::KnownFrame)
            }
            LengthKnowledge::Measured { sigma_m } => {
                return fail(format!(
                    "the standard error of the link's length is {sigma_m} m; give one above zero, or call the length given"
                ));
            }
            LengthKnowledge::Estimated => (true, None, Role::EstimatedFrame),
        };
        Ok(Some(Parameter {
            name: "link.length".into(),
            unit: Unit::Metre,
            nominal: length_m,
            lower: 0.0,
            upper: f64::INFINITY,
            prior_sigma,
            assumed: None,
            free,
            role,
            meaning: "distance of the two tips on the link".into(),
        }))
    }
}

/// Whether a parameter of a single arm places its base.
fn is_of_base(p: &Parameter) -> bool {
    p.name.starts_with("base.")
}
