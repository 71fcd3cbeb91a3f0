//! An arm, or several side by side: segments, joints, parameters.

mod arms;
mod dh_toml;
mod masses;
mod urdf;

use crate::ModelError;
use crate::error::most_similar;
use crate::segment::{Geometry, Motion, Segment};
use crate::tree::{SegmentId, Tree};
use armcal_core::{Parameter, Unit};
use nalgebra::Vector3;

pub use arms::Arm;
pub use dh_toml::DhRow;
use dh_toml::DhTable;
pub use masses::Masses;
use urdf::UrdfJoint;
pub(crate) use urdf::with_origins;
pub use urdf::{check_xml, roll_pitch_yaw_of, three_numbers};

/// Component of a unit vector from which on it is one of the axes (2.5 deg).
const ALONG: f64 = 0.999;

/// A serial arm from base to last link, read from a DH table or a URDF.
///
/// Its parameters come first in the parameter vector of a [`crate::Model`], in the order of the segments.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    pub(crate) name: String,
    /// Parents before their children; those without a parent hang on the base.
    pub(crate) segments: Vec<Segment>,
    /// The one that carries the tip; none where the base does.
    pub(crate) end: Option<SegmentId>,
    pub(crate) parameters: Vec<Parameter>,
    pub(crate) joint_names: Vec<String>,
    pub(crate) joint_limits: Vec<Option<[f64; 2]>>,
    pub(crate) source: Source,
    /// Where the masses of its links come from, where that has been said.
    pub(crate) masses: Option<Masses>,
}

/// What the chain was read from, as far as writing it back needs it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Source {
    /// A DH table.
    Dh(DhTable),
    /// The joints of a URDF from base to tip, fixed ones included.
    Urdf(Vec<UrdfJoint>),
    /// Chains of their own, side by side.
    Arms(Vec<Arm>),
}

impl Chain {
    /// Name of the robot, as its file gives it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The moving joints from base to tip: the order of every joint vector.
    pub fn joint_names(&self) -> &[String] {
        &self.joint_names
    }

    /// Lowest and highest reading that a joint can have [rad] (sliding: [m]): as its file says, but at least what was
    /// `recorded` of it; infinite where no file says.
    pub fn joint_limits(&self, joint: usize, recorded: [f64; 2]) -> [f64; 2] {
        let [low, high] =
            self.joint_limits.get(joint).copied().flatten().unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
        [low.min(recorded[0]), high.max(recorded[1])]
    }

    /// Whether it is more than one line of joints.
    pub fn is_branched(&self) -> bool {
        self.segments.iter().enumerate().any(|(id, segment)| segment.parent != id.checked_sub(1))
    }

    /// Unit of a joint's reading: radian, or metre where it slides.
    pub fn joint_unit(&self, joint: usize) -> Unit {
        let own = |s: &Segment| s.joint.filter(|j| j.index == joint && j.mimic.is_none());
        let slides = |s: &Segment| own(s).is_some_and(|j| j.motion == Motion::Prismatic);
        if self.segments.iter().any(slides) { Unit::Metre } else { Unit::Radian }
    }

    /// The axis of a joint of a URDF, in the frame of its origin; none of a DH row.
    pub fn joint_axis(&self, joint: usize) -> Option<Vector3<f64>> {
        self.segments.iter().find_map(|s| s.axis_of(joint).copied())
    }

    /// The same arm with another axis of a joint of its URDF.
    pub fn with_joint_axis(mut self, joint: usize, axis: Vector3<f64>) -> Chain {
        for segment in &mut self.segments {
            if segment.axis_of(joint).is_some() {
                segment.geometry = Geometry::Axis(axis);
            }
        }
        self
    }

    /// The parameter that is the zero of a joint, and the sign with which it adds to the reading; none where no one parameter is.
    pub fn joint_zero(&self, joint: usize) -> Option<(&Parameter, f64)> {
        let name = self.joint_names.get(joint)?;
        let of = |quantity: &str| self.parameters.iter().find(|p| p.name == format!("{name}.{quantity}"));
        let Some(axis) = self.joint_axis(joint) else { return Some((of("theta")?, 1.0)) };
        let along = (0..3).find(|k| axis[*k].abs() > ALONG)?;
        Some((of(["rx", "ry", "rz"][along])?, axis[along].signum()))
    }

    /// The geometric parameters, in the order of the chain.
    pub fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// The number of bases that it needs: one an arm with a file of its own.
    pub fn bases(&self) -> usize {
        self.arms().len().max(1)
    }

    /// The tree of this arm on its base; of several, each on its own.
    pub(crate) fn on(&self, bases: Vec<Segment>) -> Tree {
        let count = bases.len();
        let base_of = |at: usize| self.arms().iter().position(|arm| arm.segments.contains(&at)).unwrap_or(0);
        let hung = |(at, segment): (usize, Segment)| {
            let parent = segment.parent.map_or_else(|| base_of(at), |parent| parent + count);
            Segment { parent: Some(parent), ..segment }
        };
        let mut segments = bases;
        segments.extend(self.weighed().into_iter().enumerate().map(hung));
        Tree(segments)
    }

    /// Where, in that tree, the link of each arm's tip ends.
    pub(crate) fn ends(&self) -> Vec<SegmentId> {
        let bases = self.bases();
        if self.arms().is_empty() {
            return vec![self.end.map_or(0, |end| end + bases)];
        }
        let end =
            |(base, arm): (usize, &Arm)| arm.chain.end.map_or(base, |end| arm.segments.start + end + bases);
        self.arms().iter().enumerate().map(end).collect()
    }

    /// Where, in that tree, a link or row ends.
    ///
    /// Errors when there is none of this name, naming the nearest.
    pub(crate) fn end_of(&self, link: &str) -> Result<SegmentId, ModelError> {
        let named = |segment: &Segment| segment.frame.as_deref() == Some(link);
        let end = self.segments.iter().position(named).map(|at| at + self.bases());
        end.ok_or_else(|| {
            let links = self.segments.iter().filter_map(|segment| segment.frame.as_deref());
            ModelError::NoSuchLink { link: link.to_owned(), nearest: most_similar(link, links) }
        })
    }

    /// Whether the chain came from a URDF and can be written back into one.
    pub fn is_urdf(&self) -> bool {
        matches!(self.source, Source::Urdf(_))
    }
}
