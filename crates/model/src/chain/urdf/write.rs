//! Other origins in a URDF: only the numbers that changed are replaced.

use super::branches::by_name;
use super::reader::{Reader, child, parse};
use crate::ModelError;
use armcal_core::Pose;
use nalgebra::{Matrix3, Vector3};
use roxmltree::Node;
use std::ops::Range;
use std::path::Path;

/// A piece of the text to be replaced (an empty range: inserted).
struct Edit {
    at: Range<usize>,
    text: String,
}

/// A URDF with other origins of joints, by their names; `path` is only named in errors.
pub(crate) fn with_origins(xml: &str, path: &Path, origins: &[(&str, Pose)]) -> Result<String, ModelError> {
    let document = parse(xml, path)?;
    let reader = Reader { document: &document, path };
    let robot = reader.robot()?;
    let (joints, mut edits) = (by_name(Reader::joints(robot)), Vec::new());
    for &(name, new) in origins {
        let node = *joints
            .get(name)
            .ok_or_else(|| ModelError::ForeignUrdf { path: path.to_owned(), joint: name.to_owned() })?;
        let old = reader.origin(node, &format!("joint \"{name}\""))?;
        edits.extend(origin_edits(node, &old, &new, xml));
    }
    Ok(apply_edits(xml, edits))
}

/// The edits that turn the origin of a joint from `old` into `new`.
fn origin_edits(joint: Node<'_, '_>, old: &Pose, new: &Pose, xml: &str) -> Vec<Edit> {
    let moved = old.translation.vector != new.translation.vector;
    // Rotation matrices that differ by rounding only are the same numbers in the file.
    let turned = old.rotation.angle_to(&new.rotation) > 1e-15;
    let xyz = moved.then(|| ("xyz", three_numbers(&new.translation.vector)));
    let rpy = turned.then(|| ("rpy", three_numbers(&roll_pitch_yaw_of(new))));
    let changes: Vec<(&str, String)> = xyz.into_iter().chain(rpy).collect();
    if changes.is_empty() {
        return Vec::new();
    }
    let attribute = |(name, value): &(&str, String)| format!(" {name}=\"{value}\"");
    let Some(origin) = child(joint, "origin") else {
        let text: String = changes.iter().map(attribute).collect();
        let at = after_start_tag(joint, xml);
        return vec![Edit { at: at..at, text: format!("<origin{text}/>") }];
    };
    let after_name = origin.range().start + 1 + qualified_name_length(origin, xml);
    changes
        .iter()
        .map(|change| match origin.attribute_node(change.0) {
            Some(present) => Edit { at: present.range_value(), text: change.1.clone() },
            None => Edit { at: after_name..after_name, text: attribute(change) },
        })
        .collect()
}

/// Replaces from the end to the beginning, so that earlier positions stay valid.
fn apply_edits(xml: &str, mut edits: Vec<Edit>) -> String {
    let mut text = xml.to_owned();
    edits.sort_by_key(|edit| edit.at.start);
    for edit in edits.iter().rev() {
        text.replace_range(edit.at.clone(), &edit.text);
    }
    text
}

/// Length of the element's name with its prefix, as it stands after `<`.
fn qualified_name_length(element: Node<'_, '_>, xml: &str) -> usize {
    let after = &xml[element.range().start + 1..element.range().end];
    after.find(|c: char| c.is_whitespace() || c == '/' || c == '>').unwrap_or(after.len())
}

/// Where the content of an element that has children begins.
fn after_start_tag(element: Node<'_, '_>, xml: &str) -> usize {
    element.first_child().map_or(element.range().end, |first| first.range().start).min(xml.len())
}

/// Shortest decimal numbers that read back as the same bits.
pub fn three_numbers(v: &Vector3<f64>) -> String {
    // Adding zero turns -0 into 0.
    format!("{:?} {:?} {:?}", v.x + 0.0, v.y + 0.0, v.z + 0.0)
}

/// Fixed-axis roll, pitch, yaw [rad] of a rotation, as URDF, SDF and ROS read them.
pub fn roll_pitch_yaw_of(pose: &Pose) -> Vector3<f64> {
    roll_pitch_yaw_rad(&pose.rotation.to_rotation_matrix().into_inner())
}

/// Fixed-axis roll, pitch, yaw with `R = Rz(yaw) Ry(pitch) Rx(roll)`, accurate at every pitch: yaw is taken
/// out first, and what is left is read from well-conditioned entries (Shoemake, Graphics Gems IV, 1994).
fn roll_pitch_yaw_rad(r: &Matrix3<f64>) -> Vector3<f64> {
    let yaw = r.m21.atan2(r.m11);
    let (s, c) = yaw.sin_cos();
    let pitch = (-r.m31).atan2(c * r.m11 + s * r.m21);
    let roll = (s * r.m13 - c * r.m23).atan2(c * r.m22 - s * r.m12);
    Vector3::new(roll, pitch, yaw)
}
