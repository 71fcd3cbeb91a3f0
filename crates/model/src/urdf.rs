//! The chain between two links of a URDF.
//!
//! Every joint from base to tip is a segment `T(xyz) R(rpy)` followed by its motion. The origin of a
//! moving joint is calibrated: `<joint>.x/.y/.z` [m] and `<joint>.rx/.ry/.rz` [rad], a rotation vector about
//! the origin's own axes, zero at nominal. A fixed joint is a constant: whatever it could correct, the
//! origin of the moving joint before or after it (or base, or tip) corrects already. Its link keeps its
//! frame for drawing. Mass and centre of `<inertial>` of the links on the way say what gravity does to elastic effects.
//! Side branches, and what hangs on them (grippers, mimic joints), are not looked at.

use crate::chain::Source;
use crate::error::nearest;
use crate::rigid::Rigid;
use crate::segment::{Body, Freedom, Geometry, Joint, Motion, Segment};
use crate::{Chain, Deviation, ModelError};
use armcal_core::{Parameter, ParameterKind, Pose, Unit};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use roxmltree::{Document, Node};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Component of a unit vector from which on it is one of the axes (2.5 deg).
const ALONG: f64 = 0.999;

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
    /// name the line: malformed XML, missing links, joints of other types, mimic joints on the path, numbers
    /// that do not parse, a tip that does not descend from the base, no moving joint.
    pub fn from_urdf(xml: &str, base_link: &str, tip_link: &str, path: &Path) -> Result<Chain, ModelError> {
        let document = parse(xml, path)?;
        let reader = Reader { document: &document, path };
        let robot = reader.robot()?;
        let joints = reader.path_between(robot, base_link, tip_link)?;
        let name = robot.attribute("name").unwrap_or("robot").to_owned();
        let mut chain = Chain {
            name,
            segments: Vec::new(),
            end: None,
            parameters: Vec::new(),
            joint_names: Vec::new(),
            joint_limits: Vec::new(),
            source: Source::Urdf(Vec::new()),
        };
        let mut sources = Vec::new();
        for joint in joints {
            sources.push(reader.push(robot, joint, &mut chain)?);
        }
        chain.end = chain.segments.len().checked_sub(1);
        chain.source = Source::Urdf(sources);
        if chain.joint_names.is_empty() {
            return Err(ModelError::NoJoint { path: path.to_owned() });
        }
        Ok(chain)
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

/// What `<limit>` says of a joint that has ends; what cannot be an interval of readings says nothing.
fn limits(joint: Node<'_, '_>) -> Option<[f64; 2]> {
    let limit = child(joint, "limit").filter(|_| joint.attribute("type") != Some("continuous"))?;
    let end = |name| limit.attribute(name)?.trim().parse::<f64>().ok().filter(|x| x.is_finite());
    let (low, high) = (end("lower")?, end("upper")?);
    (low < high).then_some([low, high])
}

/// Parses XML; an error names the line.
pub(crate) fn parse<'x>(xml: &'x str, path: &Path) -> Result<Document<'x>, ModelError> {
    Document::parse(xml).map_err(|cause| ModelError::UrdfXml {
        path: path.to_owned(),
        line: cause.pos().row,
        cause,
    })
}

/// The first child element with this name.
pub(crate) fn child<'a, 'x>(node: Node<'a, 'x>, name: &str) -> Option<Node<'a, 'x>> {
    node.children().find(|c| c.is_element() && c.tag_name().name() == name)
}

/// A document with the path its errors name.
pub(crate) struct Reader<'a, 'x> {
    pub document: &'a Document<'x>,
    pub path: &'a Path,
}

impl<'a, 'x> Reader<'a, 'x> {
    /// The robot element.
    pub fn robot(&self) -> Result<Node<'a, 'x>, ModelError> {
        let root = self.document.root_element();
        if root.tag_name().name() == "robot" {
            return Ok(root);
        }
        let subject = format!("<{}>", root.tag_name().name());
        Err(self.error(root, subject, "a URDF begins with <robot>; expand xacro files first".into()))
    }

    /// The joint elements directly under the robot (transmissions mention joints too).
    pub fn joints(robot: Node<'a, 'x>) -> impl Iterator<Item = Node<'a, 'x>> {
        robot.children().filter(|c| c.is_element() && c.tag_name().name() == "joint")
    }

    fn links(robot: Node<'a, 'x>) -> impl Iterator<Item = Node<'a, 'x>> {
        robot.children().filter(|c| c.is_element() && c.tag_name().name() == "link")
    }

    /// The joints from base to tip, in this order.
    fn path_between(
        &self,
        robot: Node<'a, 'x>,
        base: &str,
        tip: &str,
    ) -> Result<Vec<Node<'a, 'x>>, ModelError> {
        self.check_link(robot, base)?;
        self.check_link(robot, tip)?;
        let mut above: BTreeMap<&str, Node<'a, 'x>> = BTreeMap::new();
        let mut twice = BTreeSet::new();
        for joint in Self::joints(robot) {
            // A joint without a child is an error only if the path needs it, and then it is not found.
            let Some(child) = child(joint, "child").and_then(|c| c.attribute("link")) else { continue };
            if above.insert(child, joint).is_some() {
                twice.insert(child);
            }
        }
        let (mut joints, mut ancestors, mut link) = (Vec::new(), Vec::new(), tip);
        while link != base {
            let Some(&joint) = above.get(link) else {
                let ancestors = if ancestors.is_empty() { "none".to_owned() } else { ancestors.join(", ") };
                let (base, tip) = (base.to_owned(), tip.to_owned());
                return Err(ModelError::NoPath { path: self.path.to_owned(), base, tip, ancestors });
            };
            let name = self.required(joint, "joint", "name")?;
            if twice.contains(link) {
                let problem = format!("the link \"{link}\" has more than one parent joint");
                return Err(self.error(joint, format!("joint \"{name}\""), problem));
            }
            if joints.len() > above.len() {
                let problem = "the joints from base to tip form a loop; a chain is needed".to_owned();
                return Err(self.error(joint, format!("joint \"{name}\""), problem));
            }
            let parent = child(joint, "parent").ok_or_else(|| {
                self.error(joint, format!("joint \"{name}\""), "it has no <parent link=\"...\"/>".into())
            })?;
            link = self.required(parent, &format!("parent of joint \"{name}\""), "link")?;
            ancestors.push(link);
            joints.push(joint);
        }
        joints.reverse();
        Ok(joints)
    }

    fn push(
        &self,
        robot: Node<'a, 'x>,
        joint: Node<'a, 'x>,
        chain: &mut Chain,
    ) -> Result<UrdfJoint, ModelError> {
        let name = self.required(joint, "joint", "name")?;
        let subject = format!("joint \"{name}\"");
        let motion = match self.required(joint, &subject, "type")? {
            "revolute" | "continuous" => Some(Motion::Revolute),
            "prismatic" => Some(Motion::Prismatic),
            "fixed" => None,
            other => {
                let problem = format!(
                    "type \"{other}\" cannot be on the chain; it may hold revolute, continuous, prismatic and fixed joints"
                );
                return Err(self.error(joint, subject, problem));
            }
        };
        if motion.is_some() && child(joint, "mimic").is_some() {
            let problem =
                "it mimics another joint, so it has no reading of its own; choose a tip link before it";
            return Err(self.error(joint, subject, problem.into()));
        }
        let nominal = self.origin(joint, &subject)?;
        let link = child(joint, "child").and_then(|c| c.attribute("link")).unwrap_or(name);
        let source =
            UrdfJoint { name: name.to_owned(), segment: chain.segments.len(), moves: motion.is_some() };
        let first = chain.parameters.len();
        let Some(motion) = motion else {
            let parent = chain.segments.len().checked_sub(1);
            chain.segments.push(Segment {
                parent,
                frame: Some(link.to_owned()),
                geometry: Geometry::Origin { nominal: Rigid::from(&nominal), freedom: Freedom::Constant },
                joint: None,
                parameters: first..first,
                body: self.body(robot, link)?,
            });
            return Ok(source);
        };
        let axis = self.axis(joint, &subject)?;
        chain.parameters.extend(origin_parameters(name, &nominal, (motion, &axis)));
        let end = chain.parameters.len();
        let parent = chain.segments.len().checked_sub(1);
        chain.segments.push(Segment {
            parent,
            frame: None,
            geometry: Geometry::Origin { nominal: Rigid::from(&nominal), freedom: Freedom::Full },
            joint: None,
            parameters: first..end,
            body: None,
        });
        chain.segments.push(Segment {
            parent: chain.segments.len().checked_sub(1),
            frame: Some(link.to_owned()),
            geometry: Geometry::Axis(axis),
            joint: Some(Joint::read(chain.joint_names.len(), motion)),
            parameters: end..end,
            body: self.body(robot, link)?,
        });
        chain.joint_names.push(name.to_owned());
        chain.joint_limits.push(limits(joint));
        Ok(source)
    }

    /// The pose of `<origin>`; what is left out is zero, as the URDF specification says.
    pub fn origin(&self, joint: Node<'a, 'x>, subject: &str) -> Result<Pose, ModelError> {
        let Some(origin) = child(joint, "origin") else { return Ok(Pose::identity()) };
        let xyz = self.vector(origin, subject, "xyz")?.unwrap_or_else(Vector3::zeros);
        let rpy = self.vector(origin, subject, "rpy")?.unwrap_or_else(Vector3::zeros);
        Ok(Isometry3::from_parts(
            Translation3::from(xyz),
            UnitQuaternion::from_euler_angles(rpy.x, rpy.y, rpy.z),
        ))
    }

    /// Mass and centre of `<inertial>`; none where a link has none, or none that weighs.
    fn body(&self, robot: Node<'a, 'x>, link: &str) -> Result<Option<Body>, ModelError> {
        let Some(node) = Self::links(robot).find(|node| node.attribute("name") == Some(link)) else {
            return Ok(None);
        };
        let Some(inertial) = child(node, "inertial") else { return Ok(None) };
        let mass = child(inertial, "mass").and_then(|mass| mass.attribute("value"));
        let mass_kg = mass.and_then(|value| value.trim().parse::<f64>().ok()).unwrap_or(0.0);
        let centre_m = self.origin(inertial, &format!("inertial of link \"{link}\""))?.translation.vector;
        Ok((mass_kg.is_finite() && mass_kg > 0.0).then_some(Body { mass_kg, centre_m }))
    }

    fn axis(&self, joint: Node<'a, 'x>, subject: &str) -> Result<Vector3<f64>, ModelError> {
        let Some(axis) = child(joint, "axis") else { return Ok(Vector3::x()) };
        let xyz = self.vector(axis, subject, "xyz")?.unwrap_or_else(Vector3::x);
        xyz.try_normalize(1e-9).ok_or_else(|| {
            self.error(
                axis,
                subject.to_owned(),
                "its axis has no direction; give three numbers that are not all zero".into(),
            )
        })
    }

    fn vector(
        &self,
        node: Node<'a, 'x>,
        subject: &str,
        name: &str,
    ) -> Result<Option<Vector3<f64>>, ModelError> {
        let Some(text) = node.attribute(name) else { return Ok(None) };
        let numbers: Vec<f64> = text
            .split_whitespace()
            .filter_map(|word| word.parse().ok())
            .filter(|x: &f64| x.is_finite())
            .collect();
        match (numbers.as_slice(), text.split_whitespace().count()) {
            (&[x, y, z], 3) => Ok(Some(Vector3::new(x, y, z))),
            _ => {
                let problem = format!("{name} = \"{text}\" is not three finite numbers");
                Err(self.error(node, subject.to_owned(), problem))
            }
        }
    }

    fn check_link(&self, robot: Node<'a, 'x>, link: &str) -> Result<(), ModelError> {
        let links = || Self::links(robot).filter_map(|link| link.attribute("name"));
        if links().any(|name| name == link) {
            return Ok(());
        }
        let nearest = nearest(link, links());
        Err(ModelError::UnknownLink { path: self.path.to_owned(), link: link.to_owned(), nearest })
    }

    fn required(&self, node: Node<'a, 'x>, subject: &str, name: &str) -> Result<&'a str, ModelError> {
        node.attribute(name)
            .ok_or_else(|| self.error(node, subject.to_owned(), format!("the attribute {name} is missing")))
    }

    fn error(&self, node: Node<'a, 'x>, subject: String, problem: String) -> ModelError {
        let line = self.document.text_pos_at(node.range().start).row;
        ModelError::Urdf { path: self.path.to_owned(), line, subject, problem }
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
