//! Reading elements of a URDF; every error names the line.

use super::attributes;
use crate::ModelError;
use crate::error::most_similar;
use crate::segment::Body;
use armcal_core::Pose;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use roxmltree::{Document, Node};
use std::path::Path;

/// Parses XML; an error names the line.
pub(crate) fn parse<'x>(xml: &'x str, path: &Path) -> Result<Document<'x>, ModelError> {
    if let Some(line) = attributes::too_many(xml) {
        let (subject, problem) = ("an element".to_owned(), attributes::too_many_problem());
        return Err(ModelError::Urdf { path: path.to_owned(), line, subject, problem });
    }
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

    pub fn links(robot: Node<'a, 'x>) -> impl Iterator<Item = Node<'a, 'x>> {
        robot.children().filter(|c| c.is_element() && c.tag_name().name() == "link")
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

    /// Mass and centre of `<inertial>` of a link; none where it has none, or none that weighs.
    pub fn body(&self, node: Node<'a, 'x>, link: &str) -> Result<Option<Body>, ModelError> {
        let Some(inertial) = child(node, "inertial") else { return Ok(None) };
        let mass = child(inertial, "mass").and_then(|mass| mass.attribute("value"));
        let mass_kg = mass.and_then(|value| value.trim().parse::<f64>().ok()).unwrap_or(0.0);
        let centre_m = self.origin(inertial, &format!("inertial of link \"{link}\""))?.translation.vector;
        Ok((mass_kg.is_finite() && mass_kg > 0.0).then_some(Body { mass_kg, centre_m }))
    }

    pub fn axis(&self, joint: Node<'a, 'x>, subject: &str) -> Result<Vector3<f64>, ModelError> {
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

    pub fn check_link(&self, robot: Node<'a, 'x>, link: &str) -> Result<(), ModelError> {
        let links = || Self::links(robot).filter_map(|link| link.attribute("name"));
        if links().any(|name| name == link) {
            return Ok(());
        }
        let nearest = most_similar(link, links());
        Err(ModelError::UnknownLink { path: self.path.to_owned(), link: link.to_owned(), nearest })
    }

    pub fn required(&self, node: Node<'a, 'x>, subject: &str, name: &str) -> Result<&'a str, ModelError> {
        node.attribute(name)
            .ok_or_else(|| self.error(node, subject.to_owned(), format!("the attribute {name} is missing")))
    }

    pub fn error(&self, node: Node<'a, 'x>, subject: String, problem: String) -> ModelError {
        let line = self.document.text_pos_at(node.range().start).row;
        ModelError::Urdf { path: self.path.to_owned(), line, subject, problem }
    }
}
