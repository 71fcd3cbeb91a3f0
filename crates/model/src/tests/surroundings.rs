//! Frames, residuals and overrides.

use super::*;
use crate::{FixedPlace, Frame, Knowledge, Length, ModelError};
use armcal_core::{Against, Role, Unit};
use nalgebra::UnitQuaternion;

fn pose(x: f64, y: f64, z: f64, yaw: f64) -> Pose {
    Pose::new(Vector3::new(x, y, z), Vector3::new(0.0, 0.0, yaw))
}

fn on_the_rig(base: Knowledge, board: Knowledge) -> Model {
    let frames = Frames {
        base: Frame { knowledge: base, ..Frame::given("base", pose(1.0, 2.0, 3.0, 0.5)) },
        tip: Frame { free_rotation: false, ..Frame::given("tip", Pose::identity()) },
        markers: Vec::new(),
        boards: vec![
            Frame { knowledge: board, ..Frame::given("board.normal", pose(0.4, 0.0, 0.1, 0.0)) },
            Frame { knowledge: board, ..Frame::given("board.roll", pose(0.4, 0.0, 0.2, 0.1)) },
        ],
    };
    Model::new(dh(RIGHT_ARM), frames).expect("valid")
}

#[test]
fn knowledge_decides_freedom_prior_and_role() {
    let model = on_the_rig(Knowledge::Measured { sigma_m: 1e-3, sigma_rad: 2e-3 }, Knowledge::Estimated);
    let parameter = |name: &str| &model.parameters()[model.index(name).expect("exists")];
    let (x, rz) = (parameter("base.x"), parameter("base.rz"));
    assert_eq!((x.free, x.prior_sigma, x.role, x.unit), (true, Some(1e-3), Role::KnownFrame, Unit::Metre));
    assert_eq!((rz.free, rz.prior_sigma, rz.unit, rz.nominal), (true, Some(2e-3), Unit::Radian, 0.0));
    let (tip, board) = (parameter("tip.z"), parameter("board.roll.z"));
    assert_eq!((tip.free, tip.prior_sigma, tip.role), (false, None, Role::KnownFrame));
    assert_eq!((board.free, board.prior_sigma, board.role), (true, Some(0.5), Role::EstimatedFrame));
    assert_eq!(board.nominal, 0.2);
    assert!(model.index("tip.rx").is_none());
    assert_eq!(model.parameters().len(), 16 + 6 + 3 + 12);
}

#[test]
fn a_perfect_observation_leaves_no_residual() {
    let model = on_the_rig(Knowledge::Given, Knowledge::Given);
    let (p, q) = (model.nominal(), [0.2, -0.4, 0.3]);
    let tip = pose(1.0, 2.0, 3.0, 0.5) * model.tip_in_base(&p, &q);
    let residual = model.residual(&p, &tracked(&q, &tip));
    assert!(residual.position_m.norm() < 1e-15 && residual.rotation_rad.expect("has one").norm() < 1e-15);
    let board = model.board_in_world(&p, 0).expect("first recording");
    let cavity = board.inverse_transform_point(&tip.translation.vector.into()).coords;
    assert!(model.residual(&p, &seated(&q, cavity)).position_m.norm() < 1e-15);
    // The second recording has its own board.
    let mut other = seated(&q, cavity);
    other.dwell.recording = 1;
    assert!(model.residual(&p, &other).position_m.norm() > 0.05);
}

#[test]
fn measured_minus_predicted_in_world_axes() {
    let model = on_the_rig(Knowledge::Given, Knowledge::Given);
    let (p, q) = (model.nominal(), [0.2, -0.4, 0.3]);
    let tip = model.base_in_world(&p) * model.tip_in_base(&p, &q);
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.0, 0.01));
    let seen =
        Pose::from_parts((tip.translation.vector + Vector3::new(1e-3, 0.0, 0.0)).into(), turn * tip.rotation);
    let residual = model.residual(&p, &tracked(&q, &seen));
    assert!((residual.position_m - Vector3::new(1e-3, 0.0, 0.0)).norm() < 1e-15);
    assert!((residual.rotation_rad.expect("has one") - Vector3::new(0.0, 0.0, 0.01)).norm() < 1e-14);
    assert_eq!(residual.rows().count(), residual.len());
}

/// By hand: a tip at (0.3, 0.4, 0) from a point is 0.5 m away; above a plane through that point whose normal is turned by 30 deg
/// from z about x it is -0.2 m high.
#[test]
fn distances_and_heights_are_those_of_the_geometry() {
    let bare = on_the_rig(Knowledge::Given, Knowledge::Given);
    let (p, q) = (bare.nominal(), [0.2, -0.4, 0.3]);
    let tip_m = (bare.base_in_world(&p) * bare.tip_in_base(&p, &q)).translation.vector;
    let at = tip_m - Vector3::new(0.3, 0.4, 0.0);
    let turned = Pose::new(at, Vector3::new(30f64.to_radians(), 0.0, 0.0));
    let places = [("post", Pose::translation(at.x, at.y, at.z), false), ("plate", turned, true)];
    let places =
        places.map(|(name, pose, is_plane)| FixedPlace { frame: Frame::given(name, pose), is_plane });
    let bar = Length { name: "bar".into(), length_m: 0.45, knowledge: Knowledge::Given };
    let model = bare.against(&places, &[bar]).expect("new names");
    let p = model.nominal();
    let error_m = |reference| {
        let o = Observation { reference, ..seated(&q, Vector3::zeros()) };
        let residual = model.residual(&p, &o);
        let rows: Vec<f64> = residual.rows().collect();
        assert_eq!((rows.len(), residual.len()), (1, 1));
        // What it is off in the world, along what was measured.
        assert!((residual.position_m.norm() - rows[0].abs()).abs() < 1e-15);
        rows[0]
    };
    let post = Against::Fixed(0);
    // The bar shows 0.04 m beyond its 0.45 m, and the model has 0.01 m more: measured less predicted, as of a height.
    assert!((error_m(Reference::distance(post, 0, 0.04)) + 0.01).abs() < 1e-15);
    assert!((error_m(Reference::height(1, -0.2)) - 0.0).abs() < 1e-15);
    assert!((error_m(Reference::height(1, -0.17)) - 0.03).abs() < 1e-15);
    // An offset of a plane is along its normal.
    let mut lifted = p.clone();
    lifted[model.index("plate.z").expect("a plane has an offset")] += 0.05;
    let o = Observation { reference: Reference::height(1, -0.2), ..seated(&q, Vector3::zeros()) };
    assert!((model.residual(&lifted, &o).rows().sum::<f64>() - 0.05).abs() < 1e-15);
    let names: Vec<&str> = model.parameters().iter().map(|p| p.name.as_str()).collect();
    let own = ["post.x", "post.y", "post.z", "plate.z", "plate.rx", "plate.ry", "bar.length"];
    assert_eq!(names[names.len() - 7..], own);
}

#[test]
fn places_that_the_model_does_not_have_are_named() {
    let model = on_the_rig(Knowledge::Given, Knowledge::Given);
    let post = Reference::Joined { to: Against::Fixed(0) };
    let o = Observation { reference: post, ..seated(&[0.0; 3], Vector3::zeros()) };
    let said = model.check(&[o]).expect_err("there is no place").to_string();
    assert!(said.contains("against place 0, and the model has 0"), "{said}");
    // What nobody checked before is no number, and no measurement of something else.
    let place = FixedPlace { frame: Frame::given("post", Pose::identity()), is_plane: false };
    let standing = model.clone().against(&[place], &[]).expect("a new name");
    let to = Against::Fixed(0);
    let strange = Reference::Number { kind: "rail".into(), to, length: None, reading_m: 0.0 };
    for (reference, why) in [
        (strange, "\"rail\", which is no kind"),
        (Reference::distance(to, 0, 0.1), "length 0, and the model has 0"),
    ] {
        let o = Observation { reference, ..seated(&[0.1; 3], Vector3::zeros()) };
        let rows: Vec<f64> = standing.residual(&standing.nominal(), &o).rows().collect();
        assert!(rows.len() == 1 && rows[0].is_nan(), "{why}: {rows:?}");
        let said = standing.check(&[o]).expect_err("there is none").to_string();
        assert!(said.contains(why), "{said}");
    }
    let twice = FixedPlace { frame: Frame::given("tip", Pose::identity()), is_plane: false };
    let said = model.against(&[twice], &[]).expect_err("a name that is taken").to_string();
    assert!(said.contains("\"tip.x\""), "{said}");
}

#[test]
fn overrides_by_name_and_by_glob() {
    let mut model = on_the_rig(Knowledge::Given, Knowledge::Estimated);
    assert_eq!(model.set_parameter("joint*.alpha", |p| p.free = false).expect("matches"), 3);
    assert_eq!(model.set_parameter("board.*", |p| p.prior_sigma = Some(0.01)).expect("matches"), 12);
    assert_eq!(model.set_parameter("tool.d", |p| p.nominal = 0.355).expect("matches"), 1);
    assert_eq!(model.nominal()[model.index("tool.d").expect("exists")], 0.355);
    assert!(
        model.parameters().iter().all(|p| p.name.ends_with("alpha") <= (!p.free || p.name == "tool.alpha"))
    );
}

#[test]
fn a_misspelt_override_names_the_nearest_parameter() {
    let mut model = on_the_rig(Knowledge::Given, Knowledge::Given);
    let error = model.set_parameter("joint2.theat", |p| p.free = false).expect_err("no such parameter");
    assert!(error.to_string().contains("did you mean \"joint2.theta\"?"), "{error}");
    let error = model.set_parameter("joint[", |p| p.free = false).expect_err("not a pattern");
    assert!(matches!(error, ModelError::BadPattern { .. }), "{error}");
}

#[test]
fn an_override_that_cannot_be_fitted_changes_nothing() {
    let mut model = on_the_rig(Knowledge::Given, Knowledge::Given);
    let before = model.clone();
    for edit in [
        (|p: &mut armcal_core::Parameter| p.lower = p.nominal + 1.0) as fn(&mut armcal_core::Parameter),
        |p| p.nominal = f64::NAN,
        |p| p.prior_sigma = Some(0.0),
        |p| p.upper = f64::NAN,
    ] {
        let error = model.set_parameter("joint*.d", edit).expect_err("not a usable parameter");
        assert!(error.to_string().contains("joint1.d"), "{error}");
    }
    model.set_parameter("joint1.d", |p| p.name = "other".into()).expect("the name is not theirs to change");
    assert_eq!(model, before);
}

#[test]
fn a_board_can_start_where_the_association_found_it() {
    let mut model = on_the_rig(Knowledge::Given, Knowledge::Estimated);
    let found = pose(0.5, 0.1, 0.15, 1.0);
    assert!(model.set_board_start(1, found));
    assert!(!model.set_board_start(2, found));
    let board = model.board_in_world(&model.nominal(), 1).expect("exists");
    assert!((board.to_homogeneous() - found.to_homogeneous()).abs().max() < 1e-15);
    assert_eq!(model.board_in_world(&model.nominal(), 0), Some(pose(0.4, 0.0, 0.1, 0.0)));
}

#[test]
fn observations_that_do_not_fit_are_named_and_never_panic() {
    let model = on_the_rig(Knowledge::Given, Knowledge::Given);
    let p = model.nominal();
    let short = seated(&[0.0, 0.0], Vector3::zeros());
    let mut no_board = seated(&[0.0; 3], Vector3::zeros());
    no_board.dwell.recording = 7;
    assert!(matches!(
        model.check(std::slice::from_ref(&short)),
        Err(ModelError::JointCount { actual: 2, expected: 3, .. })
    ));
    assert!(matches!(model.check(std::slice::from_ref(&no_board)), Err(ModelError::NoBoard { .. })));
    for o in [short, no_board] {
        let (residual, _) = model.residual_with_jacobian(&p, &o);
        assert!(residual.position_m.iter().any(|x| x.is_nan()));
        assert_eq!(model.joint_jacobian(&p, &o).ncols(), 3);
    }
}

#[test]
fn names_and_poses_must_be_usable() {
    let frames = |name: &str, knowledge, at| Frames {
        base: Frame { name: name.into(), pose: pose(at, 0.0, 0.0, 0.0), knowledge, free_rotation: true },
        ..Frames::of_bare_arm()
    };
    let error = |frames| Model::new(dh(RIGHT_ARM), frames).expect_err("unusable").to_string();
    assert!(error(frames("tip", Knowledge::Given, 0.0)).contains("\"tip.x\""));
    assert!(error(frames("base", Knowledge::Given, f64::NAN)).contains("frame \"base\""));
    let negative = Knowledge::Measured { sigma_m: -1.0, sigma_rad: 0.0 };
    assert!(error(frames("base", negative, 0.0)).contains("not negative"));
    let exact = Knowledge::Measured { sigma_m: 0.0, sigma_rad: 0.01 };
    let model = Model::new(dh(RIGHT_ARM), frames("base", exact, 0.0)).expect("usable");
    let free = |name: &str| model.parameters()[model.index(name).expect("exists")].free;
    assert!(!free("base.x") && free("base.rx"));
}
