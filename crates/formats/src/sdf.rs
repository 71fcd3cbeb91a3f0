//! SDFormat 1.7: links in the frames of their joints, joints placed in the links that carry them, tip and markers as frames
//! (<http://sdformat.org/spec?ver=1.7>, `//pose/@relative_to`).

use crate::element::Element;
use crate::names::{link_name, with_unique_names};
use crate::{Format, FormatError};
use armcal_core::Pose;
use armcal_model::{Bone, Motion, Moving, Skeleton, roll_pitch_yaw_of, three_numbers};

/// The arm as SDF, its base fixed at the origin of the world.
///
/// # Errors
/// An arm with joints that follow others, which version 1.7 has no way to say.
pub fn sdf(skeleton: &Skeleton) -> Result<String, FormatError> {
    let follows = |bone: &&Bone| bone.moves.as_ref().is_some_and(|moving| moving.follows.is_some());
    if let Some(bone) = skeleton.joints.iter().find(follows) {
        let problem = format!("joint `{}` follows another one; urdf and mjcf can say that", bone.name);
        return Err(FormatError::CannotHold { format: Format::Sdf, problem });
    }
    let skeleton = with_unique_names(skeleton, true);
    let mut inside = vec![
        Element::new("link").with("name", &skeleton.root),
        joint_between(&format!("{}_on_world", skeleton.root), "fixed", ["world", &skeleton.root]),
    ];
    for bone in &skeleton.joints {
        let in_joint = pose_element(&Pose::identity()).with("relative_to", &bone.name);
        inside.push(Element::new("link").with("name", &bone.link).holding([in_joint]));
        inside.push(joint_element(&skeleton, bone));
    }
    for place in &skeleton.places {
        let frame = Element::new("frame").with("name", &place.name);
        let on = link_name(&skeleton, place.on);
        inside.push(frame.with("attached_to", on).holding([pose_element(&place.at).with("relative_to", on)]));
    }
    let model = Element::new("model").with("name", &skeleton.name).holding(inside);
    let comments =
        ["Kinematics alone: every link weighs what SDFormat assumes, and there are no meshes.".into()];
    Ok(Element::new("sdf").with("version", "1.7").holding([model]).document("sdf/1", &comments))
}

fn pose_element(pose: &Pose) -> Element {
    let (xyz, rpy) = (three_numbers(&pose.translation.vector), three_numbers(&roll_pitch_yaw_of(pose)));
    Element::new("pose").text(format!("{xyz} {rpy}"))
}

fn joint_between(name: &str, kind: &str, [parent, child]: [&str; 2]) -> Element {
    let ends = [Element::new("parent").text(parent), Element::new("child").text(child)];
    Element::new("joint").with("name", name).with("type", kind).holding(ends)
}

fn joint_element(skeleton: &Skeleton, bone: &Bone) -> Element {
    let kind = match &bone.moves {
        None => "fixed",
        Some(Moving { motion: Motion::Prismatic, .. }) => "prismatic",
        Some(_) => "revolute",
    };
    let parent = link_name(skeleton, bone.parent);
    let at = pose_element(&bone.origin).with("relative_to", parent);
    let element = joint_between(&bone.name, kind, [parent, &bone.link]).holding([at]);
    let Some(moving) = &bone.moves else { return element };
    let limits = moving.limits.into_iter().flat_map(|ends| ["lower", "upper"].into_iter().zip(ends));
    let limits = limits.map(|(name, end)| Element::new(name).text(format!("{end:?}")));
    let axis = [Element::new("xyz").text(three_numbers(&moving.axis)), Element::new("limit").holding(limits)];
    element.holding([Element::new("axis").holding(axis)])
}
