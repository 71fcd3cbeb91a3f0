//! Forms of arms against the model that they came from; the files themselves are read by others in `tests/written_formats.rs`.

use crate::dh::DhRows;
use crate::ur::{UrKinematics, hash_in, yaml_number};
use crate::zeros::JointZeros;
use crate::{Format, FormatError, sdf, xacro};
use armcal_core::{DwellId, FeatureId, Observation, Pose, Reference};
use armcal_model::{Chain, DhRow, Frame, Frames, Marker, Model, Motion, Skeleton};
use nalgebra::{Rotation3, Translation3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use std::f64::consts::FRAC_PI_2;
use std::path::Path;

const UR10: &str = include_str!("../../../pipelines/models/ur10.toml");
const RIGHT_ARM: &str = include_str!("../../../pipelines/models/right_arm.toml");
const PANDA: &str = include_str!("../../model/src/tests/panda.urdf");

/// Every kind of joint, and one that follows another.
const MIXED: &str = r#"<robot name="mixed">
  <link name="base"/><link name="carriage"/><link name="slide"/><link name="bracket"/><link name="hand"/><link name="jaw"/>
  <joint name="turn" type="continuous"><parent link="base"/><child link="carriage"/>
    <origin xyz="0.1 -0.2 0.3" rpy="0.1 0.2 0.3"/><axis xyz="0 0.6 0.8"/></joint>
  <joint name="slide" type="prismatic"><parent link="carriage"/><child link="slide"/>
    <origin xyz="0 0 0.5"/><axis xyz="0.6 0 0.8"/></joint>
  <joint name="mount" type="fixed"><parent link="slide"/><child link="bracket"/>
    <origin rpy="1.5707963267948966 0 -0.7"/></joint>
  <joint name="wrist" type="revolute"><parent link="bracket"/><child link="hand"/><limit lower="-1" upper="2" effort="1" velocity="1"/></joint>
  <joint name="jaw" type="revolute"><parent link="hand"/><child link="jaw"/><origin xyz="0.1 0 0"/>
    <mimic joint="turn" multiplier="-0.5" offset="0.25"/></joint>
</robot>"#;

fn pose(x: f64, y: f64, z: f64, turn: [f64; 3]) -> Pose {
    Pose::from_parts(Translation3::new(x, y, z), UnitQuaternion::from_euler_angles(turn[0], turn[1], turn[2]))
}

/// The arm with a tip and, on a link, a marker.
fn model(chain: Chain, marked: Option<&str>) -> Model {
    let on = |link: &str| Marker {
        link: link.to_owned(),
        frame: Frame::given("elbow", pose(0.02, -0.1, 0.03, [0.3, 0.1, -2.0])),
    };
    let tip = Frame::given("tip", pose(0.01, 0.02, 0.15, [0.2, -0.4, 1.0]));
    let frames = Frames { tip, markers: marked.map(on).into_iter().collect(), ..Frames::of_bare_arm() };
    Model::new(chain, frames).expect("a model")
}

fn dh(text: &str) -> Chain {
    Chain::from_dh_toml(text, Path::new("arm.toml")).expect("a table")
}

fn urdf(text: &str, base: &str, tip: &str, more: &[&str]) -> Chain {
    Chain::from_urdf_branches(text, base, tip, more, Path::new("arm.urdf")).expect("a URDF")
}

/// The parameters moved by up to so much, as the numbers `by` say.
fn moved(model: &Model, by: &[f64], most: f64) -> Vec<f64> {
    model.nominal().iter().zip(by.iter().cycle()).map(|(v, by)| v + most * by).collect()
}

fn arms() -> Vec<(Model, &'static str)> {
    let modified = UR10.replace("convention = \"standard\"", "convention = \"modified\"");
    let fixed = RIGHT_ARM.to_owned()
        + "\n[[rows]]\nname = \"flange\"\njoint = \"fixed\"\ntheta_deg = 20\nd_mm = 30\na_mm = 40\nalpha_deg = 50\n";
    vec![
        (model(dh(UR10), Some("elbow_joint")), "base"),
        (model(dh(&modified), Some("elbow_joint")), "base"),
        (model(dh(&fixed), Some("joint2")), "base"),
        (
            model(urdf(PANDA, "panda_link0", "ball_link", &["panda_link4"]), Some("panda_link4")),
            "panda_link0",
        ),
        (model(urdf(MIXED, "base", "jaw", &["slide"]), Some("slide")), "base"),
    ]
}

fn apart(a: &Pose, b: &Pose) -> f64 {
    (a.to_homogeneous() - b.to_homogeneous()).amax()
}

/// `Rz(theta) Tz(d) Tx(a) Rx(alpha)` of every row, by elementary matrices.
fn by_rows(rows: &[DhRow], readings: &[f64]) -> Pose {
    let mut readings = readings.iter();
    rows.iter().fold(Pose::identity(), |before, row| {
        let q = row.motion.and_then(|_| readings.next()).copied().unwrap_or(0.0);
        let (turn, shift) = if row.motion == Some(Motion::Prismatic) { (0.0, q) } else { (q, 0.0) };
        let about = |axis, rad| {
            Pose::from_parts(Translation3::identity(), Rotation3::from_axis_angle(&axis, rad).into())
        };
        let along = |x, z| Pose::translation(x, 0.0, z);
        before
            * about(Vector3::z_axis(), row.theta_rad + turn)
            * along(row.a_m, row.d_m + shift)
            * about(Vector3::x_axis(), row.alpha_rad)
    })
}

proptest! {
    #[test]
    fn a_skeleton_moves_as_the_model(
        by in prop::collection::vec(-1.0..1.0f64, 7), readings in prop::collection::vec(-2.5..2.5f64, 7),
    ) {
        for (model, root) in arms() {
            let (p, readings) = (moved(&model, &by, 0.05), &readings[..model.joint_count()]);
            let skeleton = model.skeleton(0, &p, root);
            for place in &skeleton.places {
                let off = apart(
                    &skeleton.place_in_base(place, readings),
                    &model.feature_in_base(&p, place.feature, readings),
                );
                prop_assert!(off < 1e-13, "{} of {}: {off:e}", place.name, skeleton.name);
            }
        }
    }

    #[test]
    fn the_form_of_a_ur_is_the_arm(
        by in prop::collection::vec(-1.0..1.0f64, 7), readings in prop::collection::vec(-3.0..3.0f64, 6),
    ) {
        let model = model(dh(UR10), None);
        let p = moved(&model, &by, 0.01);
        let skeleton = model.skeleton(0, &p, "base");
        let form = UrKinematics::of(&skeleton, &skeleton.places[0], true).expect("a UR");
        let turned = |before: Pose, (origin, q): (&Pose, &f64)| before * origin * Pose::rotation(Vector3::z() * *q);
        let tool0 = form.origins.iter().zip(&readings).fold(Pose::identity(), turned);
        let off = apart(&(tool0 * form.tip_in_tool0), &model.tip_in_base(&p, &readings));
        prop_assert!(off < 1e-12, "{off:e}");
    }

    #[test]
    fn rows_by_common_normals_are_the_arm(
        by in prop::collection::vec(-1.0..1.0f64, 7), readings in prop::collection::vec(-2.5..2.5f64, 7),
    ) {
        let slide = MIXED.replace("<mimic joint=\"turn\" multiplier=\"-0.5\" offset=\"0.25\"/>", "");
        let cases = [
            (model(dh(UR10), None), "base"),
            (model(urdf(PANDA, "panda_link0", "ball_link", &[]), None), "panda_link0"),
            (model(urdf(&slide, "base", "jaw", &[]), None), "base"),
        ];
        for (model, root) in cases {
            let (p, readings) = (moved(&model, &by, 0.01), &readings[..model.joint_count()]);
            let skeleton = model.skeleton(0, &p, root);
            let rows = DhRows::of(&skeleton, &skeleton.places[0], None).expect("rows");
            let end = model.feature_in_link(&p, FeatureId::TIP);
            let off = apart(&(by_rows(&rows.rows, readings) * end), &model.tip_in_base(&p, readings));
            // Axes that are nearly parallel cost digits, as many as their normal is far away.
            prop_assert!(off < 1e-13 * (1.0 + rows.longest_m() * 100.0), "{off:e} at {} m", rows.longest_m());
        }
    }
}

/// The default kinematics of a UR10 in ur_description, which are those of its DH table.
#[test]
fn a_nominal_ur10_has_the_origins_of_its_description() {
    let nominal = Model::new(dh(UR10), Frames::of_bare_arm()).expect("a model");
    let skeleton = nominal.skeleton(0, &nominal.nominal(), "base");
    let form = UrKinematics::of(&skeleton, &skeleton.places[0], true).expect("a UR");
    let published = [
        pose(0.0, 0.0, 0.1273, [0.0; 3]),
        pose(0.0, 0.0, 0.0, [FRAC_PI_2, 0.0, 0.0]),
        pose(-0.612, 0.0, 0.0, [0.0; 3]),
        pose(-0.5723, 0.0, 0.163941, [0.0; 3]),
        pose(0.0, -0.1157, 0.0, [FRAC_PI_2, 0.0, 0.0]),
        pose(0.0, 0.0922, 0.0, [FRAC_PI_2, std::f64::consts::PI, std::f64::consts::PI]),
    ];
    for (own, published) in form.origins.iter().zip(&published) {
        assert!(apart(own, published) < 1e-12, "{own} {published}");
    }
    assert!(apart(&form.tip_in_tool0, &Pose::identity()) < 1e-12);
}

fn tip_of(skeleton: &Skeleton) -> &armcal_model::Place {
    &skeleton.places[0]
}

#[test]
fn what_a_format_cannot_hold_is_refused_by_name() {
    let refused = |result: Result<(), FormatError>, says: &str| {
        let words = result.expect_err("refused").to_string();
        assert!(words.contains(says), "{words}");
    };
    let skeletons: Vec<Skeleton> = arms().iter().map(|(m, root)| m.skeleton(0, &m.nominal(), root)).collect();
    let as_ur = |k: usize, by_rows| UrKinematics::of(&skeletons[k], tip_of(&skeletons[k]), by_rows).map(drop);
    refused(as_ur(2, true), "3 joints lead to its tip, and a UR has six");
    refused(as_ur(3, false), "7 joints lead to its tip");
    refused(as_ur(4, false), "joint `slide` slides");
    // The numbers of a standard table read by the other convention: six joints, but no UR.
    refused(
        as_ur(1, true),
        "joint `shoulder_pan_joint` would be its shoulder, and lies 90 deg from where a UR has it",
    );
    refused(sdf::sdf(&skeletons[4]).map(drop), "as sdf: joint `jaw` follows another one");
    refused(DhRows::of(&skeletons[4], tip_of(&skeletons[4]), None).map(drop), "as dh-csv: joint `jaw`");
}

#[test]
fn a_hash_is_taken_as_it_is_or_not_at_all() {
    let file = |line: &str| format!("kinematics:\n  shoulder:\n    x: 0\n{line}");
    for line in ["  hash: calib_123\n", "  hash: \"calib_123\"  # of the arm\n", "  hash:   'calib_123'"] {
        assert_eq!(hash_in(&file(line)).expect("a hash"), "calib_123");
    }
    for line in
        ["", "  hash:\n", "  hash: a\n  hash: b\n", "  hash: calib 1\n", "  hash: a\u{7}\n", "  # hash: a\n"]
    {
        let words = hash_in(&file(line)).expect_err("no hash").to_string();
        assert!(words.contains("hash") && words.contains("ur_calibration"), "{words}");
    }
}

#[test]
fn numbers_stay_numbers_in_yaml_of_any_version() {
    for (value, text) in
        [(1e-17, "1.0e-17"), (-2.5e-11, "-2.5e-11"), (-0.0, "0.0"), (3.0, "3.0"), (0.1273, "0.1273")]
    {
        assert_eq!(yaml_number(value), text);
    }
}

#[test]
fn a_root_that_is_called_world_is_not_the_world_of_a_simulator() {
    let model = model(dh(RIGHT_ARM), None);
    let text = sdf::sdf(&model.skeleton(0, &model.nominal(), "world")).expect("an arm");
    assert!(
        text.contains("<link name=\"world_link\"/>") && text.contains("<parent>world</parent>"),
        "{text}"
    );
}

#[test]
fn names_of_joints_cannot_leave_their_table() {
    let text = xacro::xacro(&[("a'}${1+1}\\b", Pose::identity())]);
    assert!(text.contains(r"'a\x27\x7d\x24\x7b1+1\x7d\x5cb'"), "{text}");
}

/// Only zeros are wrong: they come back, whatever the frames could do instead.
#[test]
fn planted_zeros_are_found_and_frames_take_what_they_can() {
    let model = model(dh(UR10), None);
    let planted = [0.0, 0.01, -0.02, 0.015, -0.004, 0.0];
    let observations: Vec<(Observation, Vector3<f64>)> = (0..60)
        .map(|k| {
            let q: Vec<f64> =
                (0..6).map(|j| 1.5 * (0.7 * f64::from(k * (j + 2)) + f64::from(j)).sin()).collect();
            let truly: Vec<f64> = q.iter().zip(&planted).map(|(q, zero)| q + zero).collect();
            let at = model.tip_in_base(&model.nominal(), &truly).translation.vector;
            (
                Observation::bare(
                    DwellId { recording: 0, dwell: 0 },
                    q,
                    Reference::position(Vector3::zeros()),
                ),
                at,
            )
        })
        .collect();
    let joints: Vec<usize> = (0..6).collect();
    let frames: Vec<usize> = model.base_parameters(0).collect();
    let zeros = JointZeros::fit(&model, &model.nominal(), (&joints, &frames), &observations);
    for (own, planted) in zeros.offset.iter().zip(&planted) {
        assert!((own - planted).abs() < 1e-9, "{:?}", zeros.offset);
    }
    for (o, at) in &observations {
        assert!((zeros.tip_in_world(&model, o) - at).norm() < 1e-9);
    }
    let text = zeros.yaml(&model.skeleton(0, &model.nominal(), "base"));
    assert!(text.contains("  \"shoulder_lift_joint\": 0.0"), "{text}");
    assert_eq!(Format::named("joint-zeros"), Some(Format::JointZeros));
}
