//! Putting an effect in its place on a given arm: what its kind may ask about the arm and the session.

use super::drivers::gravity_in_world;
use super::kind::{EffectContext, Shape};
use crate::error::similar_name_hint;
use crate::segment::Motion;
use armcal_core::{Parameter, Role, Unit};
use nalgebra::Vector3;
use std::f64::consts::PI;

/// A first axis closer to the vertical than this cosine (2.6 deg) is meant to stand upright.
const UPRIGHT_COSINE: f64 = 0.999;
/// Axes closer to parallel than this cosine count as parallel by design.
const PARALLEL_COSINE: f64 = 0.99;

/// The shape of a kind that acts on a whole arm: which one of several.
pub const ARM: Shape = Shape {
    name: "arm",
    unit: Unit::One,
    default: Some(1.0),
    lower: 1.0,
    upper: 64.0,
    meaning: "number of the arm, of several",
    parameter: false,
    values: None,
};

impl EffectContext<'_> {
    /// The joint the spec names.
    pub fn joint(&self) -> Result<usize, String> {
        let joint = self
            .spec
            .target
            .ok_or_else(|| format!("it acts at a joint; say which, such as {}:1", self.kind.name))?;
        if joint < self.zero.joints.len() {
            return Ok(joint);
        }
        Err(format!("there is no joint {}; the arm has {}", joint + 1, self.zero.joints.len()))
    }

    /// The arm the spec names; of one arm, that.
    pub fn arm(&self) -> Result<usize, String> {
        let arms = self.nominal.chain.arms();
        let given = self.spec.shape.iter().find(|(key, _)| key == ARM.name).map(|(_, value)| *value);
        if given.is_none() && arms.len() > 1 {
            let names: Vec<&str> = arms.iter().map(|arm| arm.name.as_str()).collect();
            return Err(format!("say of which arm: arm = 1 to {} ({})", names.len(), names.join(", ")));
        }
        let number = given.unwrap_or(1.0);
        (0..self.zero.bases.len())
            .find(|arm| (*arm + 1) as f64 == number)
            .ok_or_else(|| format!("arm = {number} is not the number of an arm"))
    }

    /// The marker the spec names: its name, and the index of the first of its parameters.
    pub fn marker(&self) -> Result<(&str, usize), String> {
        let markers = self.nominal.features.iter().enumerate().filter(|(_, feature)| feature.link.is_some());
        let first = |k: usize| self.nominal.feature_segment(k).parameters.start;
        let known: Vec<(&str, usize)> = markers.map(|(k, marker)| (marker.name.as_str(), first(k))).collect();
        if known.is_empty() {
            return Err("it acts at a marker, and there are none: declare them under [markers]".to_owned());
        }
        let names = || known.iter().map(|(name, _)| *name);
        let all = names().collect::<Vec<_>>().join(", ");
        let Some(wanted) = &self.spec.marker else {
            return Err(format!(
                "it acts at a marker; say which of {all}, such as {}:{}",
                self.kind.name, known[0].0
            ));
        };
        known.iter().find(|(name, _)| name == wanted).copied().ok_or_else(|| {
            let hint = similar_name_hint(wanted, names());
            format!("there is no marker \"{wanted}\"{hint} The markers are {all}")
        })
    }

    /// The joint the spec names, if it turns.
    pub fn turning_joint(&self) -> Result<usize, String> {
        let joint = self.joint()?;
        match self.motion(joint) {
            Motion::Revolute => Ok(joint),
            Motion::Prismatic => Err(format!("joint {} slides, and this effect is about turns", joint + 1)),
        }
    }

    /// Checks that gravity loads a joint at all: a first axis that stands upright carries no torque.
    pub fn loaded(&self, joint: usize) -> Result<(), String> {
        let gravity = gravity_in_world(self.session, self.zero);
        let along = self.zero.joints[joint].axis.dot(&gravity).abs() / gravity.norm().max(f64::MIN_POSITIVE);
        if !self.zero.is_first(joint) || self.motion(joint) == Motion::Prismatic || along < UPRIGHT_COSINE {
            return Ok(());
        }
        Err(format!("the axis of joint {} stands upright, so gravity does not load it", joint + 1))
    }

    /// Checks that the spec says when: without that, an event is a part of the geometry.
    pub fn event(&self) -> Result<(), String> {
        if self.spec.since.is_some() {
            return Ok(());
        }
        Err(format!("say when: {}@1 in recording 1 only, {}@1.17 from its dwell 17 on", self.spec, self.spec))
    }

    /// Checks that time passes in the session.
    pub fn lasting(&self) -> Result<(), String> {
        if self.session.end_ns > self.session.start_ns {
            return Ok(());
        }
        Err("it grows with time, and all observations are of one moment".to_owned())
    }

    /// The name of a joint.
    pub fn joint_name(&self, joint: usize) -> &str {
        &self.nominal.chain.joint_names[joint]
    }

    /// The largest measured effort of a joint [N m], where every observation has one.
    pub fn largest_effort_nm(&self, joint: usize) -> Result<f64, String> {
        let all = self.session.largest_effort_nm.as_ref();
        let known = all.and_then(|all| all.get(joint).copied()).filter(|largest| largest.is_finite());
        known.ok_or_else(|| format!("not all dwells have a measured effort of `{}`", self.joint_name(joint)))
    }

    /// How a joint moves.
    pub fn motion(&self, joint: usize) -> Motion {
        self.zero.joints[joint].motion
    }

    /// Unit of a joint's reading.
    pub fn joint_unit(&self, joint: usize) -> Unit {
        match self.motion(joint) {
            Motion::Revolute => Unit::Radian,
            Motion::Prismatic => Unit::Metre,
        }
    }

    /// The typical size of a lost motion or step of a joint: the angle where it turns, 1 mm a degree where it slides.
    pub fn joint_size(&self, joint: usize, deg: f64) -> f64 {
        match self.motion(joint) {
            Motion::Revolute => deg.to_radians(),
            Motion::Prismatic => deg * 1e-3,
        }
    }

    /// Whether a joint's axis is parallel to the one before it by design: +1, -1 where they point against
    /// each other, `None` where they are not parallel or one of them slides.
    pub fn parallel_to_previous(&self, joint: usize) -> Option<f64> {
        // A belt from the base passes the joint before it, which has the number before its own.
        let before = self.zero.previous_joint(joint).filter(|before| before + 1 == joint)?;
        let (previous, own) = (&self.zero.joints[before], &self.zero.joints[joint]);
        let cosine = previous.axis.dot(&own.axis);
        let turning = previous.motion == Motion::Revolute && own.motion == Motion::Revolute;
        (turning && cosine.abs() > PARALLEL_COSINE).then(|| cosine.signum())
    }

    /// Gravity torque of the nominal links on a joint with the arm stretched out level [N m] (prismatic: their
    /// weight [N]): the scale of everything that torque drives. Never zero.
    pub fn reference_torque_nm(&self, joint: usize) -> f64 {
        let gravity = self.gravity_mps2();
        let (mut torque_nm, mut weight_n): (f64, f64) = (0.0, 0.0);
        for (k, begins_m) in self.zero.joints[joint].links.clone().zip(self.zero.stretched_m(joint)) {
            let link_n = self.zero.link_mass_kg(k) * gravity;
            torque_nm += link_n * (begins_m + 0.5 * self.zero.length_m(k));
            weight_n += link_n;
        }
        let scale = match self.motion(joint) {
            Motion::Revolute => torque_nm,
            Motion::Prismatic => weight_n,
        };
        scale.max(1e-3)
    }

    /// How far the links of a joint reach, stretched out [m].
    pub fn reach_m(&self, joint: usize) -> f64 {
        let links = self.zero.joints[joint].links.clone();
        let ends = links.zip(self.zero.stretched_m(joint)).map(|(k, from_m)| from_m + self.zero.length_m(k));
        ends.fold(0.0, f64::max)
    }

    /// Size of gravity [m/s^2].
    pub fn gravity_mps2(&self) -> f64 {
        self.session.gravity_in_base_mps2.unwrap_or(self.session.gravity_in_world_mps2).norm()
    }

    /// A shape: as the spec says, or its default.
    pub fn shape(&self, name: &str) -> Option<f64> {
        let given = self.spec.shape.iter().find(|(key, _)| key == name).map(|(_, value)| *value);
        given.or_else(|| self.kind.shapes.iter().find(|shape| shape.name == name)?.default)
    }

    /// Middle of where the tip was seen or seated, in the world [m].
    pub fn volume_centre_m(&self) -> Vector3<f64> {
        let seated = || {
            let points: Vec<Vector3<f64>> = self
                .session
                .board_centres_m
                .iter()
                .filter_map(|(recording, in_board)| {
                    let board = self.nominal.board_in_world(*recording)?;
                    Some((board * nalgebra::Point3::from(*in_board)).coords)
                })
                .collect();
            (!points.is_empty()).then(|| points.iter().sum::<Vector3<f64>>() / points.len() as f64)
        };
        self.session.volume_centre_m.or_else(seated).unwrap_or_else(Vector3::zeros)
    }
}

/// An amplitude: zero before the fit, free within `bound` around it.
pub fn amplitude(
    quantity: &str,
    unit: Unit,
    prior_sigma: f64,
    bound: f64,
    meaning: impl Into<String>,
) -> Parameter {
    Parameter {
        lower: -bound,
        upper: bound,
        prior_sigma: Some(prior_sigma),
        free: true,
        ..Parameter::fixed(quantity.to_owned(), unit, 0.0, Role::Effect, meaning.into())
    }
}

/// An amplitude of an event: what it is told by is its usual size, and nothing keeps it from being many times that.
pub fn of_event(amplitude: Parameter) -> Parameter {
    let usual = amplitude.prior_sigma;
    Parameter { usual, prior_sigma: usual.map(|usual| EVENT_SIGMA * usual), ..amplitude }
}

/// Two amplitudes of a wave over a joint's angle [deg]; `angle` is what its sine and cosine are of.
pub fn amplitudes_wave(typical_deg: f64, bound_deg: f64, angle: &str) -> Vec<Parameter> {
    let of = |function: &str| {
        let meaning = format!("amplitude of {function}{angle}");
        amplitude(
            function,
            Unit::Radian,
            typical_deg * 1f64.to_radians(),
            bound_deg * 1f64.to_radians(),
            meaning,
        )
    };
    vec![of("sin"), of("cos")]
}

/// Usual sizes of an event that its prior has as a standard deviation.
const EVENT_SIGMA: f64 = 10.0;
/// How far an event usually shifts and turns something, and how far at most: what was remounted, or changed, may be anywhere in
/// reach.
const KNOCK: [f64; 2] = [1.2e-3, 0.12 * PI / 180.0];
const REMOUNTED: [f64; 2] = [1.0, PI];

/// The shift of an event along x, y, z.
pub fn shift_xyz(meaning: &str) -> Vec<Parameter> {
    amplitudes_xyz("", Unit::Metre, KNOCK[0], REMOUNTED[0], meaning).into_iter().map(of_event).collect()
}

/// The turn of an event about x, y, z.
pub fn turn_xyz(meaning: &str) -> Vec<Parameter> {
    amplitudes_xyz("r", Unit::Radian, KNOCK[1], REMOUNTED[1], meaning).into_iter().map(of_event).collect()
}

/// Three amplitudes along or about x, y, z.
pub fn amplitudes_xyz(
    prefix: &str,
    unit: Unit,
    prior_sigma: f64,
    bound: f64,
    meaning: &str,
) -> Vec<Parameter> {
    ["x", "y", "z"]
        .into_iter()
        .map(|axis| {
            amplitude(&format!("{prefix}{axis}"), unit, prior_sigma, bound, format!("{meaning} {axis}"))
        })
        .collect()
}
