//! URDF of an arm that came from a DH table. One that came from a URDF gets its own back: [`armcal_model::Model::to_urdf_with`].
//!
//! `origin`: `T(xyz) Rz(yaw) Ry(pitch) Rx(roll)`, then the joint about or along `axis`
//! (<http://wiki.ros.org/urdf/XML/joint>). Tip and markers are links on fixed joints.

use crate::element::Element;
use crate::names::{link_name, with_unique_names};
use armcal_core::Pose;
use armcal_model::{Bone, Motion, Moving, Skeleton, roll_pitch_yaw_of, three_numbers};

/// The arm as URDF.
pub fn urdf(skeleton: &Skeleton) -> String {
    let skeleton = with_unique_names(skeleton, false);
    let mut inside = vec![Element::new("link").with("name", &skeleton.root)];
    for bone in &skeleton.joints {
        inside.push(Element::new("link").with("name", &bone.link));
        inside.push(joint_element(&skeleton, bone));
    }
    for place in &skeleton.places {
        let name = format!("{}_on_{}", place.name, link_name(&skeleton, place.on));
        let parts = joint_parts(link_name(&skeleton, place.on), &place.name, &place.at);
        inside.push(Element::new("link").with("name", &place.name));
        inside.push(Element::new("joint").with("name", name).with("type", "fixed").holding(parts));
    }
    let comments =
        ["Kinematics alone: masses, meshes, and the limits of effort and velocity (0 below) are not in it."
            .into()];
    Element::new("robot")
        .with("name", &skeleton.name)
        .holding(inside)
        .document("calibrated-model/1", &comments)
}

/// The pose as `<origin>`.
pub(crate) fn origin_element(pose: &Pose) -> Element {
    let (xyz, rpy) = (three_numbers(&pose.translation.vector), three_numbers(&roll_pitch_yaw_of(pose)));
    Element::new("origin").with("xyz", xyz).with("rpy", rpy)
}

fn joint_parts(parent: &str, child: &str, at: &Pose) -> [Element; 3] {
    [
        Element::new("parent").with("link", parent),
        Element::new("child").with("link", child),
        origin_element(at),
    ]
}

fn joint_element(skeleton: &Skeleton, bone: &Bone) -> Element {
    let kind = match &bone.moves {
        None => "fixed",
        Some(Moving { motion: Motion::Prismatic, .. }) => "prismatic",
        Some(Moving { limits: None, .. }) => "continuous",
        Some(_) => "revolute",
    };
    let element = Element::new("joint").with("name", &bone.name).with("type", kind);
    let element = element.holding(joint_parts(link_name(skeleton, bone.parent), &bone.link, &bone.origin));
    let Some(moving) = &bone.moves else { return element };
    let limit = Element::new("limit");
    let limit = match (moving.limits, kind) {
        (Some([low, high]), _) => {
            Some(limit.with("lower", format!("{low:?}")).with("upper", format!("{high:?}")))
        }
        // A joint that slides has limits, whatever they are.
        (None, "prismatic") => Some(limit.with("lower", "-1e3").with("upper", "1e3")),
        _ => None,
    };
    let limit = limit.map(|limit| limit.with("effort", "0").with("velocity", "0"));
    element.holding([Element::new("axis").with("xyz", three_numbers(&moving.axis))]).holding(limit)
}
