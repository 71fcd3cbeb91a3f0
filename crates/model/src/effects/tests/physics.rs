//! Whether drivers and effects are what their equations say, in closed form.

use super::super::{EffectSpec, NominalPose, Session, Since};
use super::rig::{observations, panda, paper, scara, ur10};
use crate::tests::{RIGHT_ARM, bare, dh, tracked};
use crate::{Chain, Masses, Model};
use armcal_core::{Arrival, Observation, Pose};
use nalgebra::Vector3;
use std::f64::consts::FRAC_PI_2;

const G: f64 = 9.80665;

/// Potential energy of the nominal links and the load [J].
fn energy_j(model: &Model, joints: &[f64], load_kg: f64) -> f64 {
    let pose: NominalPose = model.nominal_arm().pose(joints);
    let links: f64 = (0..joints.len()).map(|k| pose.link_mass_kg(k) * G * pose.link_centre_m(k).z).sum();
    let tip = model.base_in_world(&model.nominal()) * model.tip_in_base(&model.nominal(), joints);
    links + load_kg * G * tip.translation.z
}

/// Two links that turn about y, level at zero, with a tool on the second.
fn weighed(masses: bool) -> Model {
    let inertial = |kg: f64, x: f64| match masses {
        true => format!("<inertial><origin xyz='{x} 0 0'/><mass value='{kg}'/></inertial>"),
        false => String::new(),
    };
    let link = |name: &str, inertial: String| format!("<link name='{name}'>{inertial}</link>");
    let joint = |name: &str, kind: &str, parent: &str, child: &str, x: f64| {
        format!(
            "<joint name='{name}' type='{kind}'><parent link='{parent}'/><child link='{child}'/>\
             <origin xyz='{x} 0 0'/><axis xyz='0 1 0'/></joint>"
        )
    };
    let xml = [
        "<robot name='two'>".to_owned(),
        link("base", inertial(50.0, 0.0)),
        link("upper", inertial(3.0, 0.2)),
        link("fore", inertial(2.0, 0.1)),
        link("tool", inertial(0.5, 0.05)),
        joint("j1", "revolute", "base", "upper", 0.0),
        joint("j2", "revolute", "upper", "fore", 0.5),
        joint("flange", "fixed", "fore", "tool", 0.4),
        "</robot>".to_owned(),
    ];
    let chain = Chain::from_urdf(&xml.concat(), "base", "tool", std::path::Path::new("two.urdf"));
    bare(chain.expect("a chain"))
}

#[test]
fn masses_and_centres_of_a_urdf_make_the_torque() {
    let model = weighed(true);
    let session = Session::of(&[]);
    let o = tracked(&[0.0, 0.0], &Pose::identity());
    let torque = model.drivers(&session, &o).torque().to_vec();
    // About joint 2: the forearm at 0.1 m, the tool at 0.4 + 0.05 m; about joint 1 half a metre further out, and the
    // upper arm at 0.2 m. A weight at +x turns about +y.
    let outer = |lever: f64| G * (2.0 * (lever + 0.1) + 0.5 * (lever + 0.45));
    assert!((torque[1].total_nm() - outer(0.0)).abs() < 1e-9, "{torque:?}");
    assert!((torque[0].total_nm() - outer(0.5) - G * 3.0 * 0.2).abs() < 1e-9, "{torque:?}");
    assert!((torque[0].outer_nm - outer(0.5)).abs() < 1e-9, "{torque:?}");
    // Without masses: 2.5 kg a metre.
    let plain = weighed(false);
    assert_eq!((model.masses(), plain.masses()), (Some(Masses::Urdf), Some(Masses::Uniform)));
    let torque = plain.drivers(&session, &o).torque().to_vec();
    assert!((torque[1].total_nm() - G * 2.5 * 0.4 * 0.2).abs() < 1e-9, "{torque:?}");
}

#[test]
fn torque_is_the_slope_of_the_potential_energy() {
    for model in [paper(), ur10(), scara(), panda(), weighed(true)] {
        for o in observations(&model, 6, true) {
            let session = Session::of(std::slice::from_ref(&o));
            let drivers = model.drivers(&session, &o);
            for (j, torque) in drivers.torque().iter().enumerate() {
                let energy = |step: f64| {
                    let mut q = o.joint_rad.clone();
                    q[j] += step;
                    energy_j(&model, &q, o.load_kg)
                };
                let slope = (energy(1e-5) - energy(-1e-5)) / 2e-5;
                assert!((torque.total_nm() + slope).abs() < 1e-7, "joint {}: {torque:?} {slope}", j + 1);
            }
        }
    }
}

fn at(joints: &[f64]) -> Observation {
    let mut o = tracked(joints, &Pose::identity());
    o.arrival = vec![Arrival::Positive; joints.len()];
    o
}

/// Motion of the tip of the paper's arm by one amplitude, all others zero.
fn motion_m(text: &str, quantity: &str, amplitude: f64, o: &Observation) -> Vector3<f64> {
    let model = bare(dh(RIGHT_ARM));
    let session = Session { load: true, end_ns: 1, ..Session::of(std::slice::from_ref(o)) };
    let spec: EffectSpec = model.effect(text).expect("a spec");
    let extended = model.with_effects(&[spec], &session).expect("a model");
    let mut p = extended.nominal();
    p[extended.index(&format!("{text}.{quantity}")).expect("a parameter")] = amplitude;
    extended.predicted_tip_in_world(&p, o) - model.predicted_tip_in_world(&model.nominal(), o)
}

#[test]
fn the_forearm_sags_by_its_torque() {
    // Joints at zero: forearm level, 354.3 mm forward and 12 mm aside; its weight pulls towards -q3.
    let o = at(&[0.0; 3]);
    let length_m = 0.3543f64.hypot(0.012);
    let torque_nm = -2.5 * length_m * G * 0.3543 / 2.0;
    let sag_m = motion_m("compliance:3", "compliance", 1e-4, &o);
    let expected_m = 0.3543 * (1e-4 * torque_nm).sin();
    assert!((sag_m.z - expected_m).abs() < 1e-12 && sag_m.z < 0.0, "{sag_m}");
    let loaded = Observation { load_kg: 0.7, ..o };
    let sag_m = motion_m("compliance:3", "compliance_load", 1e-4, &loaded);
    assert!((sag_m.z - 0.3543 * (-1e-4 * 0.7 * G * 0.3543).sin()).abs() < 1e-12, "{sag_m}");
}

#[test]
fn everything_elastic_sags_when_stretched_out() {
    // Upper arm and forearm level, with a load.
    let o = Observation { load_kg: 0.5, ..at(&[0.3, -FRAC_PI_2, FRAC_PI_2]) };
    for (text, quantity) in [
        ("compliance:2", "compliance"),
        ("compliance:2", "compliance_load"),
        ("hardening_compliance:2", "cubic"),
        ("belt_compliance:3", "compliance"),
        ("belt_compliance:3", "compliance_load"),
        ("base_compliance", "compliance"),
        ("base_compliance", "compliance_load"),
        ("link_bending:2", "sag"),
        ("link_bending:2", "sag_outer"),
        ("link_bending:2", "sag_load"),
    ] {
        assert!(motion_m(text, quantity, 1e-4, &o).z < -1e-6, "{text}.{quantity}");
    }
}

#[test]
fn a_link_held_out_level_is_a_cantilever() {
    // Upper arm and forearm level and in line: force and moment of the forearm at the end of the upper arm.
    let o = at(&[0.0, -FRAC_PI_2, FRAC_PI_2]);
    let (a, forearm) = (0.4f64, 0.3543f64);
    // Masses up to their common density.
    let force = forearm + 3.0 / 8.0 * a;
    let moment = forearm * forearm / 2.0;
    let sag = force * a.powi(3) / 3.0 + moment * a.powi(2) / 2.0;
    let slope = force * a.powi(2) / 2.0 + moment * a;
    let expected_m = -1e-3 * (1.0 + slope / sag * forearm);
    let found_m = motion_m("link_bending:2", "sag", 1e-3, &o).z;
    // The forearm is 12 mm aside of the line, which the reference length includes.
    assert!((found_m / expected_m - 1.0).abs() < 2e-3, "{found_m} {expected_m}");
    // Hanging straight down from a level upper arm, the forearm has no moment and sinks by the force alone.
    let hanging = at(&[0.0, -FRAC_PI_2, 0.0]);
    let expected_m = -1e-3 * force * a.powi(3) / 3.0 / sag;
    let found_m = motion_m("link_bending:2", "sag", 1e-3, &hanging).z;
    assert!((found_m / expected_m - 1.0).abs() < 2e-2, "{found_m} {expected_m}");
}

#[test]
fn backlash_lags_behind_the_motion() {
    let mut o = at(&[0.2, 0.1, -0.3]);
    let lag = motion_m("backlash:1", "width", 0.01, &o);
    let model = bare(dh(RIGHT_ARM));
    let behind = model.tip_in_base(&model.nominal(), &[0.195, 0.1, -0.3]).translation.vector
        - model.tip_in_base(&model.nominal(), &[0.2, 0.1, -0.3]).translation.vector;
    assert!((lag - behind).norm() < 1e-15);
    // The last move was shorter than the gap: the link still is where the move before it left it.
    o.path_memory_rad = Some(vec![vec![0.5, 0.198, 0.2], vec![0.1], vec![-0.3]]);
    let held = motion_m("backlash:1", "width", 0.01, &o);
    let link = model.tip_in_base(&model.nominal(), &[0.203, 0.1, -0.3]).translation.vector
        - model.tip_in_base(&model.nominal(), &[0.2, 0.1, -0.3]).translation.vector;
    assert!((held - link).norm() < 1e-15);
    // A small gap is a gap too; a link that leads stands on the flank that the last move was pushed from, however small that was.
    o.path_memory_rad = Some(vec![vec![0.5, 0.1995, 0.2], vec![0.1], vec![-0.3]]);
    for (width, at) in [(0.003, 0.201), (-0.003, 0.2015)] {
        let held = motion_m("backlash:1", "width", width, &o);
        let link = model.tip_in_base(&model.nominal(), &[at, 0.1, -0.3]).translation.vector
            - model.tip_in_base(&model.nominal(), &[0.2, 0.1, -0.3]).translation.vector;
        assert!((held - link).norm() < 1e-15, "{width}");
    }
    // Nobody knows where joint 2 came from.
    o.arrival[1] = Arrival::Unknown;
    assert_eq!(motion_m("backlash:2", "width", 0.01, &o), Vector3::zeros());
}

#[test]
fn a_shift_turns_about_the_middle_of_the_volume() {
    let mut o = at(&[0.2, 0.1, -0.3]);
    let model = bare(dh(RIGHT_ARM));
    let tip_m = model.predicted_tip_in_world(&model.nominal(), &o);
    if let armcal_core::Reference::Tracked { position_m, .. } = &mut o.reference {
        *position_m = tip_m;
    }
    // The tip is the middle of a volume of one point: a turn leaves it, a shift moves it.
    assert!(motion_m("frame_shift@0", "rz", 0.1, &o).norm() < 1e-15);
    let shift_m = motion_m("frame_shift@0", "x", 1e-3, &o);
    assert!((shift_m - Vector3::new(1e-3, 0.0, 0.0)).norm() < 1e-15);
    assert_eq!(motion_m("frame_shift@1", "x", 1e-3, &o), Vector3::zeros());
    assert_eq!(motion_m("frame_shift@0.1", "x", 1e-3, &o), Vector3::zeros());
}

#[test]
fn without_a_sensor_a_shift_turns_about_the_middle_of_the_board() {
    let model = paper();
    let mut seated = observations(&model, 40, false);
    seated.retain(|o| o.cavity().is_some() && o.dwell.recording == 1);
    let session = Session::of(&seated);
    let spec = EffectSpec::new("frame_shift").since(Since::Recording(1));
    let extended = model.with_effects(&[spec], &session).expect("a model");
    let mut p = extended.nominal();
    let board = model.board_in_world(&p, 1).expect("a board");
    let middle_m = board * nalgebra::Point3::from(session.board_centres_m[&1]);
    p[extended.index("frame_shift@1.rz").expect("a parameter")] = 0.1;
    let turn = nalgebra::Rotation3::from_scaled_axis(Vector3::new(0.0, 0.0, 0.1));
    for o in &seated {
        let rigid_m = model.predicted_tip_in_world(&model.nominal(), o);
        let expected_m = turn * (rigid_m - middle_m.coords) + middle_m.coords;
        assert!((extended.predicted_tip_in_world(&p, o) - expected_m).norm() < 1e-14);
    }
}

#[test]
fn gravity_in_the_base_goes_before_gravity_in_the_world() {
    let model = paper();
    let o = at(&[0.2, 0.5, -0.3]);
    let session = Session::of(std::slice::from_ref(&o));
    let base = model.base_in_world(&model.nominal());
    let in_base = base.rotation.inverse() * session.gravity_in_world_mps2;
    let other = Session {
        gravity_in_base_mps2: Some(in_base),
        gravity_in_world_mps2: Vector3::x(),
        ..session.clone()
    };
    for (a, b) in model.drivers(&session, &o).torque().iter().zip(model.drivers(&other, &o).torque()) {
        assert!((a.total_nm() - b.total_nm()).abs() < 1e-12);
    }
}

/// Motion of the tip of the paper's arm by one amplitude in each of its observations, tracked and seated in turn.
fn motions_m(text: &str, quantity: &str, observations: &[Observation]) -> Vec<f64> {
    let model = paper();
    let session = Session::of(observations);
    let spec: EffectSpec = model.effect(text).expect("a spec");
    let extended = model.with_effects(&[spec], &session).expect("a model");
    let mut p = extended.nominal();
    let rigid = p.clone();
    p[extended.index(&format!("{text}.{quantity}")).expect("a parameter")] = 1e-3;
    let tip_m = |p: &[f64], o: &Observation| extended.predicted_tip_in_world(p, o);
    observations.iter().map(|o| (tip_m(&p, o) - tip_m(&rigid, o)).norm()).collect()
}

#[test]
fn a_hand_that_leads_the_link_leaves_it_on_the_other_flank() {
    let both = observations(&paper(), 20, false);
    for text in ["backlash:2", "friction_windup:2", "belt_backlash:3", "crossed_backlash:2,from=1"] {
        let quantity = if text.starts_with("friction") { "windup" } else { "width" };
        let always = motions_m(text, quantity, &both);
        let shared = |share: f64| motions_m(&format!("{text},seated={share}"), quantity, &both);
        let (none, half) = (shared(0.0), shared(0.5));
        for (k, o) in both.iter().enumerate() {
            let expected = if o.cavity().is_some() { [0.0, 0.5 * always[k]] } else { [always[k]; 2] };
            assert!((none[k] - expected[0]).abs() < 1e-12, "{text}: {} {}", none[k], expected[0]);
            assert!((half[k] - expected[1]).abs() <= 1e-3 * always[k], "{text}: {} {}", half[k], expected[1]);
        }
        assert!(always.iter().any(|m| *m > 1e-5), "{text}");
    }
    // With no play in the other direction the flanks are mirror images.
    let model = paper();
    let o = Observation {
        path_memory_rad: None,
        ..both.iter().find(|o| o.cavity().is_some()).expect("one").clone()
    };
    let session = Session::of(&both);
    let moved = |text: &str| {
        let extended = model.with_effects(&[model.effect(text).expect("a spec")], &session).expect("a model");
        let mut p = extended.nominal();
        let rigid = extended.predicted_tip_in_world(&p, &o);
        p[extended.index(&format!("{text}.width")).expect("a parameter")] = 1e-4;
        extended.predicted_tip_in_world(&p, &o) - rigid
    };
    assert!((moved("backlash:2") + moved("backlash:2,seated=-1")).norm() < 1e-8);
}

#[test]
fn a_link_leads_only_where_a_hand_may_have_led_it() {
    let (model, all) = (paper(), observations(&paper(), 20, false));
    let of = |text: &str, amplitude: &str| {
        let placed =
            model.with_effects(&[model.effect(text).expect("a spec")], &Session::of(&all)).expect("a model");
        placed.effects()[0].never_negative(amplitude)
    };
    assert!(
        !of("backlash:1", "width") && !of("backlash:1,seated=1", "width") && !of("zero_slip:1@1", "slip")
    );
    assert!(of("backlash:1,seated=-1", "width") && of("friction_windup:2,seated=0", "windup"));
    assert!(
        !of("friction_windup:2,seated=0", "windup_outer") && !of("compliance:2,seated=0", "compliance_outer")
    );
    assert!(of("compliance:2", "compliance") && of("arm_compliance", "compliance2"));
}

#[test]
fn an_unsettled_joint_lacks_a_share_of_its_last_move() {
    let model = paper();
    let mut all = observations(&model, 6, true);
    all[1].moved_rad = None;
    let extended = model
        .with_effects(&[model.effect("unsettled_reading:2").expect("a spec")], &Session::of(&all))
        .expect("a model");
    let mut p = extended.nominal();
    p[extended.index("unsettled_reading:2.share").expect("a parameter")] = 0.1;
    for o in &all {
        let mut there = o.clone();
        there.joint_rad[1] -= 0.1 * o.moved_rad.as_ref().map_or(0.0, |moved| moved[1]);
        let apart = extended.predicted_tip_in_world(&p, o)
            - extended.predicted_tip_in_world(&extended.nominal(), &there);
        assert!(apart.norm() < 1e-12, "{apart}");
    }
    // A filter that lets 30 % of a move be missing in the reading: the joint is where a share of -3/7 says.
    let (from, to) = (0.2_f64, 0.9);
    let read = to - 0.3 * (to - from);
    assert!((read + 0.3 / 0.7 * (read - from) - to).abs() < 1e-12);
    all.iter_mut().for_each(|o| o.moved_rad = None);
    let refused =
        model.with_effects(&[model.effect("unsettled_reading:2").expect("a spec")], &Session::of(&all));
    assert!(refused.expect_err("no moves").to_string().contains("rested before"));
}

#[test]
fn an_undeclared_load_bends_the_joints_like_a_declared_one() {
    let model = paper();
    let mut all = observations(&model, 30, true);
    all.iter_mut().for_each(|o| o.load_kg = 0.0);
    let session = Session::of(&all);
    let hidden =
        model.with_effects(&[model.effect("undeclared_load@1").expect("a spec")], &session).expect("a model");
    // A kilogram on springs of 500 and 200 N m/rad.
    let springs = [500.0, 200.0];
    let mut loaded = all.clone();
    loaded.iter_mut().for_each(|o| o.load_kg = 1.0);
    let known = ["compliance:2", "compliance:3"].map(|text| model.effect(text).expect("a spec"));
    let known = model.with_effects(&known, &Session::of(&loaded)).expect("a model");
    let (mut p, mut q) = (hidden.nominal(), known.nominal());
    let reach_m = [1, 2].map(|k| model.nominal_arm().zero_pose().length_m(k));
    for (k, spring) in springs.iter().enumerate() {
        let stretched_nm = G * reach_m[k..].iter().sum::<f64>();
        p[hidden.index(&format!("undeclared_load@1.yield{}", k + 2)).expect("a parameter")] =
            stretched_nm / spring;
        q[known.index(&format!("compliance:{}.compliance_load", k + 2)).expect("a parameter")] = 1.0 / spring;
    }
    for (o, loaded) in all.iter().zip(&loaded) {
        let expected = if o.dwell.recording == 1 { loaded } else { o };
        let apart = hidden.predicted_tip_in_world(&p, o) - known.predicted_tip_in_world(&q, expected);
        assert!(apart.norm() < 1e-9, "{}: {apart}", o.dwell);
    }
    assert!(model.effect("undeclared_load").and_then(|spec| model.with_effects(&[spec], &session)).is_err());
}

#[test]
fn what_gravity_bends_may_rest_while_a_cavity_holds_the_tip() {
    let both = observations(&paper(), 20, false);
    for text in ["compliance:2", "link_bending:1", "base_compliance", "gravity_backlash:2"] {
        let quantity = match text {
            "link_bending:1" => "sag",
            "gravity_backlash:2" => "width",
            _ => "compliance",
        };
        let always = motions_m(text, quantity, &both);
        for share in [0.0, 0.5] {
            let own = motions_m(&format!("{text},seated={share}"), quantity, &both);
            for ((o, own), always) in both.iter().zip(&own).zip(&always) {
                let expected = if o.cavity().is_some() { share * always } else { *always };
                assert!((own - expected).abs() < 1e-3 * always, "{text} {share}: {own} {expected}");
            }
        }
    }
}

#[test]
fn a_board_that_slipped_moves_its_cavities_and_no_tracked_tip() {
    let model = paper();
    let both = observations(&model, 20, false);
    let session = Session::of(&both);
    let spec = model.effect("board_shift@0.3").expect("a spec");
    let extended = model.with_effects(&[spec], &session).expect("a model");
    let moved = |quantity: &str, o: &Observation| {
        let mut p = extended.nominal();
        p[extended.index(&format!("board_shift@0.3.{quantity}")).expect("a parameter")] = 1e-3;
        extended.measured_tip_in_world(&p, o) - model.measured_tip_in_world(&model.nominal(), o)
    };
    for o in &both {
        let acts = o.cavity().is_some() && (o.dwell.recording, o.dwell.dwell) >= (0, 3);
        let along = moved("x", o);
        let expected = if acts { 1e-3 } else { 0.0 };
        assert!((along.norm() - expected).abs() < 1e-12, "{}: {along}", o.dwell);
        // A turn about the middle of the seated points leaves that middle where it is.
        if acts && let armcal_core::Reference::Seated { in_board_m, .. } = &o.reference {
            let arm_m = in_board_m - session.board_centres_m[&o.dwell.recording];
            let turned_m = 1e-3 * arm_m.xy().norm();
            assert!((moved("rz", o).norm() - turned_m).abs() < 1e-6 * turned_m.max(1e-6), "{}", o.dwell);
        }
    }
    let tracked = observations(&model, 20, true);
    let spec = model.effect("board_shift@1").expect("a spec");
    let refused = model.with_effects(&[spec], &Session::of(&tracked)).expect_err("no cavities");
    assert!(refused.to_string().contains("frame_shift"), "{refused}");
}
