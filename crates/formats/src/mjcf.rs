//! MuJoCo's MJCF: nested bodies, each `T(pos) R(quat)` in its parent, joints in their frames, tip and markers as sites
//! (<https://mujoco.readthedocs.io/en/stable/XMLreference.html>).

use crate::element::Element;
use crate::names::with_unique_names;
use armcal_core::Pose;
use armcal_model::{Motion, Moving, Skeleton, three_numbers};

/// The arm as MJCF, its base fixed at the origin of the world.
pub fn mjcf(skeleton: &Skeleton) -> String {
    let skeleton = with_unique_names(skeleton, false);
    // Bodies that move need a mass; what they weigh is not known here.
    let compiler = Element::new("compiler")
        .with("angle", "radian")
        .with("autolimits", "true")
        .with("boundmass", "0.001")
        .with("boundinertia", "1e-06");
    let root = Element::new("body").with("name", &skeleton.root).holding(child_elements(&skeleton, None));
    let world = Element::new("worldbody").holding([root]);
    let follow: Vec<Element> = follower_constraints(&skeleton).collect();
    let equality = (!follow.is_empty()).then(|| Element::new("equality").holding(follow));
    let comments =
        ["Kinematics alone: masses are MuJoCo's least (boundmass, boundinertia), and there are no meshes."
            .into()];
    let model =
        Element::new("mujoco").with("model", &skeleton.name).holding([compiler, world]).holding(equality);
    model.document("mjcf/1", &comments)
}

/// What hangs on the link of a joint, or on the root.
fn child_elements(skeleton: &Skeleton, joint: Option<usize>) -> Vec<Element> {
    let places = skeleton.places.iter().filter(|place| place.on == joint);
    let site = |name: &str, at: &Pose| with_pose(Element::new("site").with("name", name), at);
    let mut inside: Vec<Element> = places.map(|place| site(&place.name, &place.at)).collect();
    for (at, bone) in skeleton.joints.iter().enumerate().filter(|(_, bone)| bone.parent == joint) {
        let body = with_pose(Element::new("body").with("name", &bone.link), &bone.origin);
        let hinge = bone.moves.iter().map(|moving| joint_element(&bone.name, moving));
        inside.push(body.holding(hinge).holding(child_elements(skeleton, Some(at))));
    }
    inside
}

fn with_pose(element: Element, at: &Pose) -> Element {
    let q = at.rotation.coords;
    let quat = [q.w, q.x, q.y, q.z].map(|v| format!("{:?}", v + 0.0)).join(" ");
    element.with("pos", three_numbers(&at.translation.vector)).with("quat", quat)
}

fn joint_element(name: &str, moving: &Moving) -> Element {
    let kind = if moving.motion == Motion::Prismatic { "slide" } else { "hinge" };
    let joint =
        Element::new("joint").with("name", name).with("type", kind).with("axis", three_numbers(&moving.axis));
    match moving.limits {
        Some([low, high]) => joint.with("range", format!("{low:?} {high:?}")),
        None => joint,
    }
}

/// Joints that follow another one, as equality constraints.
fn follower_constraints(skeleton: &Skeleton) -> impl Iterator<Item = Element> {
    skeleton.joints.iter().filter_map(|bone| {
        let moving = bone.moves.as_ref()?;
        let [ratio, offset] = moving.follows?;
        let leads = |m: &Moving| m.follows.is_none() && m.reading == moving.reading;
        let leader = skeleton.joints.iter().find(|bone| bone.moves.as_ref().is_some_and(leads))?;
        let follower = Element::new("joint").with("joint1", &bone.name).with("joint2", &leader.name);
        Some(follower.with("polycoef", format!("{offset:?} {ratio:?} 0 0 0")))
    })
}
