//! Writing a calibrated chain back into its URDF: only the numbers that changed are replaced.

use super::branches::by_name;
use super::reader::{Reader, child, parse};
use crate::chain::Source;
use crate::{Model, ModelError};
use armcal_core::{Code, FeatureId, Pose, Severity, Stage, Warning};
use nalgebra::{Matrix3, Vector3};
use roxmltree::Node;
use std::ops::Range;
use std::path::Path;

/// A piece of the text to be replaced (an empty range: inserted).
struct Edit {
    at: Range<usize>,
    text: String,
}

/// Origins by the names of their joints, and what of the calibration is in none of them.
pub type CalibratedOrigins<'m> = (Vec<(&'m str, Pose)>, Vec<Warning>);

impl Model {
    /// The URDF of an arm with the calibrated origins of its moving joints; every other byte stays as it was.
    ///
    /// `xml` is the file its chain was read from, `path` its name for errors, `p` the parameter vector. Only
    /// `xyz` or `rpy` attributes whose value changed are replaced. If the tip frame is calibrated (any of its
    /// parameters is free) it is written into the fixed joint that carries the tip link; where that joint
    /// moves there is no such place, which a warning says. Errors when the chain did not come from a URDF,
    /// when `xml` is not that URDF, or when `p` has the wrong length.
    pub fn to_urdf(
        &self,
        arm: usize,
        xml: &str,
        path: &Path,
        p: &[f64],
    ) -> Result<(String, Vec<Warning>), ModelError> {
        let tip = self.feature_parameters(FeatureId(arm)).any(|index| self.parameters()[index].free);
        self.to_urdf_with(arm, tip, xml, path, p)
    }

    /// [`Model::to_urdf`], said from outside whether the tip frame was calibrated: a model that was read back does not know.
    pub fn to_urdf_with(
        &self,
        arm: usize,
        tip: bool,
        xml: &str,
        path: &Path,
        p: &[f64],
    ) -> Result<(String, Vec<Warning>), ModelError> {
        let (origins, warnings) = self.calibrated_origins(arm, tip, p)?;
        let document = parse(xml, path)?;
        let reader = Reader { document: &document, path };
        let robot = reader.robot()?;
        let (joints, mut edits) = (by_name(Reader::joints(robot)), Vec::new());
        for (name, new) in origins {
            let node = *joints
                .get(name)
                .ok_or_else(|| ModelError::ForeignUrdf { path: path.to_owned(), joint: name.to_owned() })?;
            let old = reader.origin(node, &format!("joint \"{name}\""))?;
            edits.extend(origin_edits(node, &old, &new, xml));
        }
        Ok((apply_edits(xml, edits), warnings))
    }

    /// The origins that calibration changes, by the names of their joints in the URDF: of every moving joint and, with `tip`, of
    /// the fixed joint that carries the tip link. Errors as [`Model::to_urdf`].
    pub fn calibrated_origins(
        &self,
        arm: usize,
        tip: bool,
        p: &[f64],
    ) -> Result<CalibratedOrigins<'_>, ModelError> {
        let (chain, own) = self.chain().arm(arm);
        let Source::Urdf(joints) = &chain.source else {
            return Err(ModelError::WrongFormat { model: chain.name.clone(), format: "URDF" });
        };
        if p.len() != self.parameters().len() {
            return Err(ModelError::ParameterCount { actual: p.len(), expected: self.parameters().len() });
        }
        let (mut origins, mut warnings) = (Vec::new(), Vec::new());
        for joint in joints {
            // A moving joint is two segments: its origin and its motion.
            let carries_tip = tip && chain.end == Some(joint.segment + usize::from(joint.moves));
            if carries_tip && joint.moves {
                warnings.push(tip_not_written(&joint.name));
            }
            if !joint.moves && !carries_tip {
                continue;
            }
            let mut origin = Pose::from(&chain.segments[joint.segment].transform(&p[own.clone()], &[]));
            if carries_tip && !joint.moves {
                origin *= self.feature_in_link(p, FeatureId(arm));
            }
            origins.push((joint.name.as_str(), origin));
        }
        Ok((origins, warnings))
    }
}

fn tip_not_written(joint: &str) -> Warning {
    Warning::new(
        Severity::Notice,
        Stage::Output,
        Code::TipNotInUrdf,
        "tip",
        format!(
            "the tip link hangs on the moving joint \"{joint}\", so the calibrated tip frame is not in the URDF; \
             add a fixed joint with a tip link and name that as tip_link"
        ),
    )
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
