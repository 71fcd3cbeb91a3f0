//! The exact Jacobian against central differences and against the geometric Jacobian, on random arms.

use super::*;
use crate::{FixedPlace, Frame, Knowledge, Length};
use armcal_core::{Against, FeatureId};
use nalgebra::{Translation3, UnitQuaternion};
use proptest::prelude::*;

/// A row of a random DH table: joint kind, with Hayati's beta or not, theta, d, a, alpha, beta.
type RandomRow = (u8, bool, [f64; 5]);

fn random_dh() -> impl Strategy<Value = String> {
    let row = (0u8..3, any::<bool>(), prop::array::uniform5(-1.0..1.0f64));
    (any::<bool>(), prop::collection::vec(row, 1..6)).prop_map(|(modified, rows): (bool, Vec<RandomRow>)| {
        let convention = if modified { "modified" } else { "standard" };
        let mut text = format!("name = \"random\"\nconvention = \"{convention}\"\n");
        for (i, (kind, hayati, [theta, d, a, alpha, beta])) in rows.into_iter().enumerate() {
            // The first row moves, so that every random table is a valid chain.
            let joint = ["revolute", "prismatic", "fixed"][usize::from(if i == 0 { kind % 2 } else { kind })];
            text += &format!("[[rows]]\nname = \"j{i}\"\njoint = \"{joint}\"\n");
            text += &format!(
                "theta_deg = {}\nd_mm = {}\na_mm = {}\nalpha_deg = {}\n",
                theta * 180.0,
                d * 500.0,
                a * 500.0,
                alpha * 180.0
            );
            if hayati {
                text += &format!("beta_deg = {}\n", beta * 20.0);
            }
        }
        text
    })
}

fn random_urdf() -> impl Strategy<Value = String> {
    let joint = (0u8..4, prop::array::uniform9(-1.0..1.0f64));
    prop::collection::vec(joint, 1..6).prop_map(|joints| {
        let mut xml = String::from("<robot name=\"random\"><link name=\"l0\"/>");
        for (i, (kind, [x, y, z, r, p, w, ax, ay, az])) in joints.into_iter().enumerate() {
            let kind = if i == 0 { 0 } else { usize::from(kind) };
            let kind = ["revolute", "prismatic", "fixed", "continuous"][kind];
            xml += &format!(
                "<joint name=\"j{i}\" type=\"{kind}\"><parent link=\"l{i}\"/><child link=\"l{}\"/>\
                 <origin xyz=\"{x} {y} {z}\" rpy=\"{} {} {}\"/><axis xyz=\"{ax} {ay} {}\"/></joint>\
                 <link name=\"l{}\"/>",
                i + 1,
                r * 3.1,
                p * 1.5,
                w * 3.1,
                az + 2.0,
                i + 1
            );
        }
        xml + "</robot>"
    })
}

fn random_chain() -> impl Strategy<Value = Chain> {
    prop_oneof![
        random_dh().prop_map(|text| dh(&text)),
        random_urdf().prop_map(|xml| {
            let tip = format!("l{}", xml.matches("<joint").count());
            urdf(&xml, "l0", &tip)
        }),
    ]
}

fn pose(v: [f64; 6]) -> Pose {
    Pose::from_parts(Translation3::new(v[0], v[1], v[2]), UnitQuaternion::from_euler_angles(v[3], v[4], v[5]))
}

fn random_frame(name: &'static str) -> impl Strategy<Value = Frame> {
    (prop::array::uniform6(-1.0..1.0f64), any::<bool>()).prop_map(move |(v, free_rotation)| Frame {
        name: name.into(),
        pose: pose(v),
        knowledge: Knowledge::Estimated,
        free_rotation,
    })
}

/// A model with all frames, a parameter vector off nominal, joint values.
fn random_case() -> impl Strategy<Value = (Model, Vec<f64>, Vec<f64>)> {
    let frames = (random_frame("base"), random_frame("tip"), random_frame("board.one"));
    let off = prop::collection::vec(-0.3..0.3f64, 60);
    (random_chain(), frames, off, prop::collection::vec(-2.0..2.0f64, 6)).prop_map(
        |(chain, (base, tip, board), off, joints)| {
            let model = Model::new(chain, Frames { base, tip, markers: Vec::new(), boards: vec![board] })
                .expect("valid");
            let p: Vec<f64> = model.nominal().iter().zip(&off).map(|(value, off)| value + off).collect();
            let joints = joints[..model.joint_count()].to_vec();
            (model, p, joints)
        },
    )
}

fn rows(model: &Model, p: &[f64], o: &Observation) -> Vec<f64> {
    model.residual(p, o).rows().collect()
}

/// Largest difference between the Jacobian and central differences of the residual.
fn worst_difference(model: &Model, p: &[f64], o: &Observation) -> f64 {
    let (residual, jacobian) = model.residual_with_jacobian(p, o);
    assert_eq!(residual, model.residual(p, o));
    assert_eq!(jacobian.shape(), (residual.len(), p.len()));
    let step = 1e-5;
    let mut worst = 0.0f64;
    for column in 0..p.len() {
        let at = |offset: f64| {
            let mut moved = p.to_vec();
            moved[column] += offset;
            rows(model, &moved, o)
        };
        for (row, (up, down)) in at(step).iter().zip(at(-step)).enumerate() {
            worst = worst.max((jacobian[(row, column)] - (up - down) / (2.0 * step)).abs());
        }
    }
    worst
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn tracked_poses_agree_with_central_differences(
        (model, p, joints) in random_case(),
        miss in prop::array::uniform3(-1.4..1.4f64),
        size in prop_oneof![Just(0.0), Just(1e-4), Just(1.0)],
    ) {
        // A measured orientation up to 140 deg away from the predicted one, on both sides of the series.
        let predicted = model.base_in_world(&p) * model.tip_in_base(&p, &joints);
        let miss = UnitQuaternion::from_scaled_axis(Vector3::from(miss) * size);
        let seen = Pose::from_parts(Translation3::new(0.1, 0.2, 0.3), miss * predicted.rotation);
        prop_assert!(worst_difference(&model, &p, &tracked(&joints, &seen)) < 1e-7);
    }

    #[test]
    fn a_carried_point_agrees_with_the_tip_and_with_central_differences(
        (model, p, joints) in random_case(),
        point_m in prop::array::uniform3(-0.3..0.3f64),
    ) {
        let expected = |p: &[f64], point_m: Vector3<f64>| {
            model.tip_in_base(p, &joints).transform_point(&point_m.into()).coords
        };
        let point_m = Vector3::from(point_m);
        let carried = model.carried_point(&p, FeatureId::TIP, point_m, &|_| true);
        let found = carried.motions(&joints);
        prop_assert!((carried.at_m(&joints) - expected(&p, point_m)).norm() < 1e-12);
        prop_assert!((found.at_m - expected(&p, point_m)).norm() < 1e-12);
        let step = 1e-5;
        for (index, by_m) in found.parameters {
            let at = |by: f64| {
                let mut moved = p.clone();
                moved[index] += by;
                expected(&moved, point_m)
            };
            prop_assert!((by_m - (at(step) - at(-step)) / (2.0 * step)).norm() < 1e-7);
        }
        for (k, axis) in found.axes.column_iter().enumerate() {
            let along = Vector3::ith(k, 1.0);
            prop_assert!((axis - (expected(&p, point_m + along) - expected(&p, point_m))).norm() < 1e-12);
        }
    }

    #[test]
    fn seated_tips_agree_with_central_differences((model, p, joints) in random_case()) {
        let o = seated(&joints, Vector3::new(0.08, -0.03, 0.01));
        prop_assert!(worst_difference(&model, &p, &o) < 1e-7);
    }

    #[test]
    fn what_is_measured_against_places_agrees_with_central_differences(
        (model, p, joints) in random_case(),
        (point, plane) in (random_frame("post"), random_frame("plate")),
        off in prop::collection::vec(-0.3..0.3f64, 7),
    ) {
        let places = [(point, false), (plane, true)].map(|(frame, is_plane)| FixedPlace { frame, is_plane });
        let bar = Length { name: "bar".into(), length_m: 0.4, knowledge: Knowledge::Estimated };
        let model = model.against(&places, &[bar]).expect("new names");
        let more = model.nominal().into_iter().skip(p.len()).zip(&off).map(|(value, off)| value + off);
        let p: Vec<f64> = p.into_iter().chain(more).collect();
        prop_assert_eq!(p.len(), model.parameters().len());
        let post = Against::Fixed(0);
        for reference in [
            Reference::Joined { to: post },
            Reference::distance(post, 0, 0.03),
            Reference::height(1, -0.02),
        ] {
            let o = Observation { reference, ..seated(&joints, Vector3::zeros()) };
            model.check(std::slice::from_ref(&o)).expect("all of it is there");
            // Far from a distance of zero, where a distance has no slope.
            let gap_m = model.place_in_world(&p, 0).translation.vector - model.predicted_tip_in_world(&p, &o);
            prop_assume!(gap_m.norm() > 0.05);
            prop_assert!(worst_difference(&model, &p, &o) < 1e-7);
        }
    }

    /// z x (tip - o) for a revolute joint, z for a prismatic one: Siciliano et al. 2009, eq. 3.30.
    #[test]
    fn joints_move_the_tip_like_the_geometric_jacobian(text in random_dh(), q in prop::collection::vec(-2.0..2.0f64, 6)) {
        let model = bare(dh(&text));
        prop_assume!(text.contains("standard"));
        let (p, q) = (model.nominal(), &q[..model.joint_count()]);
        let frames = model.link_frames(&p, q);
        let tip = frames[frames.len() - 1].in_base.translation.vector;
        let jacobian = model.joint_jacobian(&p, &seated(q, Vector3::zeros()));
        let kinds = text.lines().filter_map(|line| line.strip_prefix("joint = "));
        let mut column = 0;
        for (row, kind) in kinds.enumerate() {
            // Standard DH: the joint of a row turns about the z of the frame before it.
            let before = &frames[row].in_base;
            let z = before.rotation * Vector3::z();
            let expected = match kind {
                "\"revolute\"" => z.cross(&(tip - before.translation.vector)),
                "\"prismatic\"" => z,
                _ => continue,
            };
            prop_assert!((jacobian.column(column) - expected).norm() < 1e-13);
            column += 1;
        }
    }
}

#[test]
fn urdf_joints_move_the_tip_like_the_geometric_jacobian() {
    let model = bare(urdf(oracles::MIXED, "base", "hand"));
    let (p, q) = (model.nominal(), [0.7, 0.25, -1.3]);
    let frames = model.link_frames(&p, &q);
    let tip = frames[frames.len() - 1].in_base.translation.vector;
    let jacobian = model.joint_jacobian(&p, &seated(&q, Vector3::zeros()));
    let turn = &frames[1].in_base;
    let about = turn.rotation * Vector3::new(0.0, 0.6, 0.8);
    assert!((jacobian.column(0) - about.cross(&(tip - turn.translation.vector))).norm() < 1e-14);
    let along = frames[2].in_base.rotation * Vector3::new(0.6, 0.0, 0.8);
    assert!((jacobian.column(1) - along).norm() < 1e-14);
    // The tip lies on the wrist's axis.
    assert!(jacobian.column(2).norm() < 1e-14);
}
