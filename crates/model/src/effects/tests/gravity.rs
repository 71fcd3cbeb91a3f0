//! What a torso with two arms weighs, and what hangs on it; every number here is worked out beside the model.

use super::super::{EffectSpec, Session};
use crate::tests::tracked;
use crate::{Chain, Frame, Frames, Marker, Masses, Model, ModelError};
use armcal_core::{FeatureId, Load, Observation, Pose};
use nalgebra::{Point3, Vector3};
use std::path::Path;

const G: f64 = 9.80665;
/// Links with a mass: their centres [m] and masses [kg].
const TORSO: ([f64; 3], f64) = ([0.02, 0.01, 0.2], 8.0);
const RIGHT: ([f64; 3], f64) = ([0.11, 0.0, 0.03], 2.0);
const LEFT: ([f64; 3], f64) = ([0.15, -0.02, 0.0], 1.5);
const LEFT_HAND: FeatureId = FeatureId(1);
const ELBOW: FeatureId = FeatureId(2);

/// A waist that turns about y; on it two arms of a shoulder and a hand 0.3 m further on. `weighing` are the links that the
/// file gives a mass.
fn urdf(weighing: &[&str]) -> String {
    let link = |name: &str, (at, kg): ([f64; 3], f64)| match weighing.contains(&name) {
        true => format!(
            "<link name='{name}'><inertial><origin xyz='{} {} {}'/><mass value='{kg}'/></inertial></link>",
            at[0], at[1], at[2]
        ),
        false => format!("<link name='{name}'/>"),
    };
    let joint = |name: &str, kind: &str, [parent, child]: [&str; 2], at: &str| {
        format!(
            "<joint name='{name}' type='{kind}'><parent link='{parent}'/><child link='{child}'/>\
             <origin xyz='{at}'/><axis xyz='0 1 0'/></joint>"
        )
    };
    [
        "<robot name='two'><link name='base'/><link name='r_hand'/><link name='l_hand'/>".to_owned(),
        link("torso", TORSO) + &link("right", RIGHT) + &link("left", LEFT),
        joint("waist", "revolute", ["base", "torso"], "0 0 0.5"),
        joint("r_shoulder", "revolute", ["torso", "right"], "0 -0.2 0.4"),
        joint("r_wrist", "fixed", ["right", "r_hand"], "0.3 0 0"),
        joint("l_shoulder", "revolute", ["torso", "left"], "0 0.2 0.4"),
        joint("l_wrist", "fixed", ["left", "l_hand"], "0.3 0 0"),
        "</robot>".to_owned(),
    ]
    .concat()
}

fn chain(weighing: &[&str]) -> Chain {
    let path = Path::new("two.urdf");
    Chain::from_urdf_branches(&urdf(weighing), "base", "r_hand", &["l_hand"], path).expect("a robot")
}

/// The tip is the right hand; markers are on the left one and 0.1 m along the right arm.
fn model(chain: Chain) -> Model {
    let at = |x: f64| Pose::translation(x, 0.0, 0.0);
    let marker = |name: &str, link: &str, x| Marker { link: link.into(), frame: Frame::given(name, at(x)) };
    let markers = vec![marker("left_hand", "l_hand", 0.0), marker("elbow", "right", 0.1)];
    Model::new(chain, Frames { markers, ..Frames::of_bare_arm() }).expect("a model")
}

/// Torque on each joint by hand: sum over what it moves of (place - axis) x weight, along y.
fn by_hand_nm(model: &Model, o: &Observation, weights: &[(&str, [f64; 3], f64)]) -> [f64; 3] {
    let frames = model.link_frames(&model.nominal(), &o.joint_rad);
    let place = |link: &str, at: [f64; 3]| {
        let frame = frames.iter().find(|frame| frame.name == link).expect("a link");
        (frame.in_base * Point3::from(at)).coords
    };
    [
        ("torso", vec!["torso", "right", "r_hand", "left", "l_hand"]),
        ("right", vec!["right", "r_hand"]),
        ("left", vec!["left", "l_hand"]),
    ]
    .map(|(own, moved)| {
        let axis = place(own, [0.0; 3]);
        let carried = weights.iter().filter(|(link, ..)| moved.contains(link));
        carried.map(|(link, at, kg)| (place(link, *at) - axis).cross(&(Vector3::z() * -G * *kg)).y).sum()
    })
}

fn torques_nm(model: &Model, o: &Observation) -> Vec<f64> {
    let session = Session::of(std::slice::from_ref(o));
    model.drivers(&session, o).torque().iter().map(|torque| torque.total_nm()).collect()
}

fn assert_near(found: &[f64], expected: &[f64]) {
    let near = found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12 * (1.0 + b.abs()));
    assert!(near && found.len() == expected.len(), "{found:?} is not {expected:?}");
}

const POSES: [[f64; 3]; 3] = [[0.0; 3], [0.4, -1.1, 0.7], [-0.9, 0.3, 2.0]];

#[test]
fn a_torso_carries_both_arms_and_what_hangs_on_them() {
    let model = model(chain(&["torso", "right", "left"]));
    assert_eq!(model.chain().joint_names(), ["waist", "r_shoulder", "l_shoulder"]);
    let links = [("torso", TORSO), ("right", RIGHT), ("left", LEFT)].map(|(name, (at, kg))| (name, at, kg));
    for joints in POSES {
        let bare = tracked(&joints, &Pose::identity());
        assert_near(&torques_nm(&model, &bare), &by_hand_nm(&model, &bare, &links));
        let more_loads = vec![Load { at: LEFT_HAND, kg: 1.2 }, Load { at: ELBOW, kg: 0.5 }];
        let loaded = Observation { load_kg: 0.7, more_loads, ..bare };
        let hung = [("r_hand", [0.0; 3], 0.7), ("l_hand", [0.0; 3], 1.2), ("right", [0.1, 0.0, 0.0], 0.5)];
        let all = [&links[..], &hung].concat();
        assert_near(&torques_nm(&model, &loaded), &by_hand_nm(&model, &loaded, &all));
    }
}

#[test]
fn a_load_of_the_left_hand_bends_the_left_shoulder_and_the_waist_only() {
    let model = model(chain(&["torso", "right", "left"]));
    let kg = 1.2;
    let o =
        Observation { more_loads: vec![Load { at: LEFT_HAND, kg }], ..tracked(&POSES[1], &Pose::identity()) };
    let session = Session::of(std::slice::from_ref(&o));
    assert!(session.load);
    let by_hand = by_hand_nm(&model, &o, &[("l_hand", [0.0; 3], kg)]);
    for (joint, expected_nm) in by_hand.iter().enumerate() {
        let spec: EffectSpec = model.effect(&format!("compliance:{}", joint + 1)).expect("a spec");
        let bent = model.with_effects(std::slice::from_ref(&spec), &session).expect("a model");
        let mut p = bent.nominal();
        p[bent.index(&format!("{spec}.compliance_load")).expect("a parameter")] = 1e-3;
        let mut turned = o.clone();
        turned.joint_rad[joint] += 1e-3 * expected_nm;
        for feature in [FeatureId::TIP, LEFT_HAND] {
            let apart = bent.feature_in_world(&p, feature, &o).translation.vector
                - model.feature_in_world(&model.nominal(), feature, &turned).translation.vector;
            assert!(apart.norm() < 1e-12, "joint {joint}: {apart}");
        }
    }
    assert!(by_hand[1] == 0.0 && by_hand[0].abs() > 0.1 && by_hand[2].abs() > 0.1, "{by_hand:?}");
    // A load at a point that the arm does not have is refused, whoever made the observation.
    let more_loads = vec![Load { at: FeatureId(3), kg }];
    assert!(matches!(
        model.check(&[Observation { more_loads, ..o }]),
        Err(ModelError::NoFeature { feature: 3, .. })
    ));
}

#[test]
fn a_link_without_a_mass_is_named_and_weighs_as_was_asked() {
    let o = tracked(&POSES[2], &Pose::identity());
    let partly = chain(&["torso", "right"]);
    assert_eq!(partly.links_without_mass(), ["left"]);
    // Half way along the 0.3 m to its hand.
    let left = ("left", [0.15, 0.0, 0.0], 2.5 * 0.3);
    let (torso, right) = (("torso", TORSO.0, TORSO.1), ("right", RIGHT.0, RIGHT.1));
    // The torso ends at both shoulders.
    let [to_right, to_left] = [-0.2, 0.2].map(|y: f64| ("torso", [0.0, y / 2.0, 0.2], 2.5 * y.hypot(0.4)));
    let uniform = [to_right, to_left, ("right", [0.15, 0.0, 0.0], 2.5 * 0.3), left];
    let path = Path::new("two.urdf");
    for (masses, weights, kept) in [
        (None, &uniform[..], Some(Masses::Uniform)),
        (Some(Masses::Uniform), &uniform, Some(Masses::Uniform)),
        (Some(Masses::Urdf), &[torso, right, left], None),
    ] {
        let model = model(partly.clone().with_masses(masses, path).expect("masses"));
        assert_eq!(model.masses(), kept);
        assert_near(&torques_nm(&model, &o), &by_hand_nm(&model, &o, weights));
    }
    let uniform = partly.with_masses(Some(Masses::Uniform), path).expect("a choice");
    assert!(uniform.links_without_mass().is_empty());
    // A file that gives all or none has nothing to tell, and none is none to ask for.
    assert!(chain(&["torso", "right", "left"]).links_without_mass().is_empty());
    assert!(chain(&[]).links_without_mass().is_empty());
    let said = chain(&[]).with_masses(Some(Masses::Urdf), path).expect_err("no masses").to_string();
    assert!(said.contains("two.urdf") && said.contains("<inertial>"), "{said}");
    // Side by side with an arm that gives none, each has its own.
    let arms = vec![("r".to_owned(), chain(&["torso", "right"])), ("l".to_owned(), chain(&[]))];
    assert_eq!(Chain::joined(arms).expect("two arms").links_without_mass(), ["r.left"]);
}
