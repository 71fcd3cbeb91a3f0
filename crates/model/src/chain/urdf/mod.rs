//! The arm between links of a URDF.
//!
//! Every joint from base to tip is a segment `T(xyz) R(rpy)` followed by its motion. The origin of a
//! moving joint is calibrated: `<joint>.x/.y/.z` [m] and `<joint>.rx/.ry/.rz` [rad], a rotation vector about
//! the origin's own axes, zero at nominal. A fixed joint is a constant: whatever it could correct, the
//! origin of the moving joint before or after it (or base, or tip) corrects already. Its link keeps its
//! frame for drawing. A joint that mimics another has no reading of its own: it follows that one, whose joint is then part of
//! the model wherever it is. Mass and centre of `<inertial>` of the links on the way, and of all that hangs on them, say what
//! gravity does to elastic effects. Where more than the tip is measured, the ways to all of it are kept ([`branches`]).

mod attributes;
mod branches;
mod reader;
mod write;

pub use attributes::check_xml;
use branches::{Branches, Kept};
use reader::{Reader, child, parse};
pub(crate) use write::with_origins;
pub use write::{roll_pitch_yaw_of, three_numbers};

use super::{ALONG, Chain, Source};
use crate::rigid::Rigid;
use crate::segment::{Body, Freedom, Geometry, Joint, Motion, Segment};
use crate::tree::SegmentId;
use crate::{Deviation, ModelError};
use armcal_core::{Parameter, ParameterKind, Pose, Unit};
use nalgebra::Vector3;
use roxmltree::Node;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// What writing a joint back needs to know.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct UrdfJoint {
    pub name: String,
    /// Index of the segment that is its origin.
    pub segment: usize,
    pub moves: bool,
}

impl Chain {
    /// Reads the chain from `base_link` to `tip_link`; `path` is only named in errors.
    ///
    /// Bounds and prior of the joint origins are the defaults of [`Deviation`]; see
    /// [`Chain::with_deviation`]. Revolute, continuous, prismatic and fixed joints may be on the path. Errors
    /// name the line: malformed XML, missing links, joints of other types, joints that mimic one that has no
    /// reading, numbers that do not parse, a tip that does not descend from the base, no moving joint.
    pub fn from_urdf(xml: &str, base_link: &str, tip_link: &str, path: &Path) -> Result<Chain, ModelError> {
        Chain::from_urdf_branches(xml, base_link, tip_link, &[], path)
    }

    /// The same with the branches that lead to more links than the tip's.
    pub fn from_urdf_branches(
        xml: &str,
        base_link: &str,
        tip_link: &str,
        more_links: &[&str],
        path: &Path,
    ) -> Result<Chain, ModelError> {
        let document = parse(xml, path)?;
        let reader = Reader { document: &document, path };
        let robot = reader.robot()?;
        let branches = Branches::of(&reader, robot);
        let ends: Vec<&str> = [tip_link].iter().chain(more_links).copied().collect();
        let kept = branches.to(base_link, &ends)?;
        let name = robot.attribute("name").unwrap_or("robot").to_owned();
        let mut built = Built::default();
        let links: BTreeSet<&str> = kept.iter().map(|k| k.link).collect();
        for joint in &kept {
            built.push(&reader, &branches, joint)?;
            let end = built.ends[joint.link];
            if let Some(beside) = branches.hanging(joint.link, &links) {
                built.segments[end].body.get_or_insert(Body::NONE).add(&beside);
            }
        }
        if built.joint_names.is_empty() {
            return Err(ModelError::NoJoint { path: path.to_owned() });
        }
        let end = built.ends.get(tip_link).copied();
        Ok(built.chain(name, end))
    }

    /// The same chain with bounds and priors that were declared for all its parameters.
    ///
    /// Errors when an entry is not a positive number; `path` is the file that is named then.
    pub fn with_deviation(mut self, deviation: &Deviation, path: &Path) -> Result<Chain, ModelError> {
        deviation.check(path)?;
        for p in &mut self.parameters {
            let free = p.free;
            *p = deviation.parameter(p.name.clone(), p.unit, p.nominal, p.meaning.clone());
            p.free = free;
        }
        Ok(self)
    }
}

/// How a joint of this type moves; none of one that does not, or in a way that is not known.
fn motion_of(form: &str) -> Option<Motion> {
    match form {
        "revolute" | "continuous" => Some(Motion::Revolute),
        "prismatic" => Some(Motion::Prismatic),
        _ => None,
    }
}

/// What `<limit>` says of a joint that has ends; what cannot be an interval of readings says nothing.
fn read_limits(joint: Node<'_, '_>) -> Option<[f64; 2]> {
    let limit = child(joint, "limit").filter(|_| joint.attribute("type") != Some("continuous"))?;
    let end = |name| limit.attribute(name)?.trim().parse::<f64>().ok().filter(|x| x.is_finite());
    let (low, high) = (end("lower")?, end("upper")?);
    (low < high).then_some([low, high])
}

/// A chain that is being read.
#[derive(Default)]
struct Built<'a> {
    segments: Vec<Segment>,
    parameters: Vec<Parameter>,
    joint_names: Vec<String>,
    joint_limits: Vec<Option<[f64; 2]>>,
    sources: Vec<UrdfJoint>,
    /// The segment that ends at each link.
    ends: BTreeMap<&'a str, SegmentId>,
    /// Joints that follow another: their segment, and whose reading.
    following: Vec<(SegmentId, &'a str)>,
}

impl<'a> Built<'a> {
    fn push(
        &mut self,
        reader: &Reader<'a, '_>,
        branches: &Branches<'a, '_>,
        kept: &Kept<'a, '_>,
    ) -> Result<(), ModelError> {
        let Kept { joint, parent, link } = *kept;
        let name = reader.required(joint, "joint", "name")?;
        let subject = format!("joint \"{name}\"");
        let form = reader.required(joint, &subject, "type")?;
        let motion = motion_of(form);
        if motion.is_none() && form != "fixed" {
            let problem = format!(
                "type \"{form}\" cannot be on the chain; it may hold revolute, continuous, prismatic and fixed joints"
            );
            return Err(reader.error(joint, subject, problem));
        }
        let nominal = reader.origin(joint, &subject)?;
        let body = branches.body(link)?;
        self.sources.push(UrdfJoint {
            name: name.to_owned(),
            segment: self.segments.len(),
            moves: motion.is_some(),
        });
        let parent = self.ends.get(parent).copied();
        let frame = Some(link.to_owned());
        let first = self.parameters.len();
        let origin = |freedom| Geometry::Origin { nominal: Rigid::from(&nominal), freedom };
        let Some(motion) = motion else {
            let geometry = origin(Freedom::Constant);
            self.add(Segment { parent, frame, geometry, joint: None, parameters: first..first, body });
            self.ends.insert(link, self.segments.len() - 1);
            return Ok(());
        };
        let axis = reader.axis(joint, &subject)?;
        self.parameters.extend(origin_parameters(name, &nominal, (motion, &axis)));
        let end = self.parameters.len();
        let geometry = origin(Freedom::Full);
        let parent = self.add(Segment {
            parent,
            frame: None,
            geometry,
            joint: None,
            parameters: first..end,
            body: None,
        });
        let joint = match branches.followed(joint)? {
            None => {
                self.joint_names.push(name.to_owned());
                self.joint_limits.push(read_limits(kept.joint));
                Joint::read(self.joint_names.len() - 1, motion)
            }
            Some((leader, mimic)) => {
                self.following.push((self.segments.len(), leader));
                // Whose reading that is, is known when all joints are.
                Joint { index: 0, motion, mimic: Some(mimic) }
            }
        };
        let (geometry, parameters) = (Geometry::Axis(axis), end..end);
        let moved =
            self.add(Segment { parent: Some(parent), frame, geometry, joint: Some(joint), parameters, body });
        self.ends.insert(link, moved);
        Ok(())
    }

    fn add(&mut self, segment: Segment) -> SegmentId {
        self.segments.push(segment);
        self.segments.len() - 1
    }

    fn chain(mut self, name: String, end: Option<SegmentId>) -> Chain {
        // The first of a name, as everywhere.
        let names = self.joint_names.iter().enumerate().rev();
        let places: BTreeMap<&str, usize> = names.map(|(index, name)| (name.as_str(), index)).collect();
        for (segment, leader) in &self.following {
            if let (Some(joint), Some(index)) = (&mut self.segments[*segment].joint, places.get(leader)) {
                joint.index = *index;
            }
        }
        Chain {
            name,
            segments: self.segments,
            end,
            parameters: self.parameters,
            joint_names: self.joint_names,
            joint_limits: self.joint_limits,
            source: Source::Urdf(self.sources),
            masses: None,
        }
    }
}

fn origin_parameters(
    joint: &str,
    nominal: &Pose,
    (motion, axis): (Motion, &Vector3<f64>),
) -> impl Iterator<Item = Parameter> {
    let deviation = Deviation::default();
    // A turn of the origin about the axis of the joint is its zero.
    let zero = |k: usize| match (motion, axis[k].abs() > ALONG) {
        (Motion::Revolute, true) => ParameterKind::JointZero,
        _ => ParameterKind::Angle,
    };
    let length = ParameterKind::Length;
    let at = nominal.translation.vector;
    [
        ("x", Unit::Metre, at.x, "origin along the parent's x", length),
        ("y", Unit::Metre, at.y, "origin along the parent's y", length),
        ("z", Unit::Metre, at.z, "origin along the parent's z", length),
        ("rx", Unit::Radian, 0.0, "rotation of the origin about its own x", zero(0)),
        ("ry", Unit::Radian, 0.0, "rotation of the origin about its own y", zero(1)),
        ("rz", Unit::Radian, 0.0, "rotation of the origin about its own z", zero(2)),
    ]
    .map(|(quantity, unit, nominal, meaning, kind)| {
        let parameter =
            deviation.parameter(format!("{joint}.{quantity}"), unit, nominal, format!("{joint}: {meaning}"));
        Parameter { assumed: Some(kind), ..parameter }
    })
    .into_iter()
}
