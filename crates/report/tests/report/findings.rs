use crate::recording::{Full, get, list, number, own, read, string, vector, write};
use crate::synthetic::{Synthetic, synthetic};
use armcal_config::InputMessages;
use armcal_model::EffectSpec;
use armcal_result::Refit;
use nalgebra::{Rotation3, Vector3};
use prost_reflect::DynamicMessage;
use serde_json::Value;

fn numbers(message: &DynamicMessage, field: &str) -> Vec<f64> {
    get(message, field).as_list().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

/// Every observation errs as if one joint were off, which the fitted model does not know.
fn with_joint_off(joint: usize, offset_rad: f64) -> Synthetic {
    let mut s = synthetic();
    let p = s.run.calibration.fit.values();
    for (o, r) in s.run.observations.iter().zip(&mut s.run.calibration.residuals) {
        let mut moved = o.clone();
        moved.joint_rad[joint] += offset_rad;
        let tip = |o| s.run.model.predicted_tip_in_world(&p, o);
        r.fitted_m = tip(&moved) - tip(o);
    }
    s
}

/// The run with play in joint 1 of this width found, and nothing left.
pub fn with_play_found(s: &mut Synthetic, width_rad: f64) {
    let run = &mut s.run;
    let joints = run.model.chain().joint_names();
    let spec = EffectSpec::parse("backlash:1", joints).unwrap();
    let model = run.model.with_effects(&[spec], &run.session).unwrap();
    let mut calibration = run.calibration.clone();
    let added = run.model.parameters().len()..model.parameters().len();
    for parameter in &model.parameters()[added] {
        let like = calibration.fit.estimates[0].clone();
        let value = if parameter.name.ends_with("width") { width_rad } else { parameter.nominal };
        calibration.fit.estimates.push(armcal_calibrate::Estimate {
            value,
            parameter: parameter.clone(),
            ..like
        });
    }
    for r in &mut calibration.residuals {
        r.fitted_m = Vector3::zeros();
    }
    run.steps = vec![Refit { effects: vec!["backlash:1".into()], model, calibration }];
}

#[test]
fn an_offset_of_a_joint_is_implied_at_every_dwell() {
    let offset_rad = 4e-5;
    for joint in 0..3 {
        let s = with_joint_off(joint, offset_rad);
        let messages = read(&write(&s, InputMessages::Reference, "out").join("run.mcap"));
        let implied = &own(&messages, &format!("/armcal/implied/joint{}", joint + 1))[0];
        let errors = numbers(implied, "error");
        assert_eq!(errors.len() as u32 + get(implied, "left_out").as_u32().unwrap(), 13);
        assert!(errors.len() > 9, "{errors:?}");
        for error_deg in &errors {
            assert!(
                (error_deg.to_radians() - offset_rad).abs() < 1e-3 * offset_rad,
                "joint {joint}: {errors:?}"
            );
        }
    }
}

#[test]
fn branches_are_those_of_the_arrivals() {
    let s = with_joint_off(1, 1e-4);
    let messages = read(&write(&s, InputMessages::Reference, "out").join("run.mcap"));
    // In the synthetic run joint 1 always arrives in +q, joint 2 in -q, and of joint 3 nobody knows.
    for (joint, own_branch) in [(1, "positive"), (2, "negative"), (3, "unknown")] {
        let implied = &own(&messages, &format!("/armcal/implied/joint{joint}"))[0];
        for branch in ["positive", "negative", "unknown"] {
            let drawn = numbers(implied, branch).iter().filter(|e| e.is_finite()).count();
            let expected = if branch == own_branch { numbers(implied, "reading").len() } else { 0 };
            assert_eq!(drawn, expected, "joint {joint}, {branch}");
        }
    }
}

#[test]
fn what_an_effect_does_is_shown_apart_from_what_is_left() {
    let mut s = synthetic();
    let width_rad = 1e-3;
    with_play_found(&mut s, width_rad);
    let messages = read(&write(&s, InputMessages::Reference, "out").join("run.mcap"));
    let implied = &own(&messages, "/armcal/implied/joint1")[0];
    assert!(numbers(implied, "error_after").iter().all(|e| *e == 0.0));
    // Its geometry is that of the run, so once the play is taken out again the run's own errors are back.
    let plain = synthetic();
    let messages = read(&write(&plain, InputMessages::Reference, "out").join("run.mcap"));
    let before = numbers(&own(&messages, "/armcal/implied/joint1")[0], "error");
    let effect = numbers(implied, "effect");
    assert_eq!(effect.len(), before.len());
    assert!(effect.iter().zip(&before).all(|(e, b)| (e - b).abs() < 1e-12), "{effect:?} {before:?}");
    // With it, joint 1 is half the width further back wherever it arrives in +q.
    let refit = &s.run.steps[0];
    let p = refit.calibration.fit.values();
    let o = &s.run.observations[0];
    let mut behind = o.clone();
    behind.joint_rad[0] -= width_rad / 2.0;
    let base = plain.run.calibration.fit.values();
    let expected = plain.run.model.predicted_tip_in_world(&base, &behind);
    assert!((refit.model.predicted_tip_in_world(&p, o) - expected).norm() < 1e-12);
}

#[test]
fn board_vectors_are_the_residuals_in_the_frame_of_the_board() {
    let s = synthetic();
    let messages = read(&write(&s, InputMessages::Reference, "out").join("run.mcap"));
    let p = s.run.calibration.fit.values();
    for recording in 0..3 {
        let board = &own(&messages, &format!("/armcal/board/{recording}"))[0];
        let axes: [Vec<f64>; 3] = ["fitted_x_mm", "fitted_y_mm", "fitted_z_mm"].map(|f| numbers(board, f));
        assert_eq!(axes[0].len(), 4, "the tracked point is on no board");
        let pose = s.run.model.board_in_world(&p, recording).unwrap();
        let world_from_board: Rotation3<f64> = pose.rotation.to_rotation_matrix();
        let seated = s.run.observations.iter().zip(&s.run.calibration.residuals);
        let seated = seated.filter(|(o, _)| o.dwell.recording == recording && o.cavity().is_some());
        for (i, (o, r)) in seated.enumerate() {
            let back = world_from_board * Vector3::new(axes[0][i], axes[1][i], axes[2][i]);
            assert!((back - r.fitted_m * 1e3).norm() < 1e-9, "{} {back}", o.dwell);
            let cavity = s.run.board.as_ref().unwrap().cavity(o.cavity().unwrap()).unwrap();
            assert!((numbers(board, "x_mm")[i] - cavity.in_board_m.x * 1e3).abs() < 1e-9);
        }
    }
}

#[test]
fn the_map_of_boards_draws_them_at_the_stated_scale() {
    let s = synthetic();
    let messages = read(&write(&s, InputMessages::Reference, "out").join("run.mcap"));
    let map = &own(&messages, "/armcal/board_map")[0];
    let entities = list(map, "entities");
    let legend = string(&list(entities.last().unwrap(), "texts")[0], "text");
    for recording in 0..3 {
        let board = &own(&messages, &format!("/armcal/board/{recording}"))[0];
        let factor = number(board, "magnification");
        assert!(
            factor >= 1.0 && legend.contains(&format!("x {factor}, from where the model puts")),
            "{legend}"
        );
        let entity = entities.iter().find(|e| string(e, "id") == format!("calibrated/{recording}")).unwrap();
        assert_eq!(string(entity, "frame_id"), "board_map");
        let (x_mm, y_mm) = (numbers(board, "fitted_x_mm"), numbers(board, "fitted_y_mm"));
        let arrows = list(entity, "arrows");
        assert_eq!(arrows.len(), x_mm.len());
        for (i, arrow) in arrows.iter().enumerate() {
            let length_mm = 1e3 * (number(arrow, "shaft_length") + number(arrow, "head_length"));
            assert!((length_mm - factor * x_mm[i].hypot(y_mm[i])).abs() < 1e-9);
            assert_eq!(vector(arrow, "pose.position").z, 0.0);
        }
    }
}

#[test]
fn the_map_is_as_large_as_what_it_draws() {
    let magnification = |s: &Synthetic, folder: &str| {
        let messages = read(&write(s, InputMessages::Reference, folder).join("run.mcap"));
        number(&own(&messages, "/armcal/board/0")[0], "magnification")
    };
    let mut s = synthetic();
    let plain = magnification(&s, "plain");
    // Errors across the boards are not drawn, so they make no arrow shorter.
    let p = s.run.calibration.fit.values();
    for r in &mut s.run.calibration.residuals {
        let board = s.run.model.board_in_world(&p, r.dwell.recording).unwrap();
        r.fitted_m += board.rotation * Vector3::new(0.0, 0.0, 0.5);
    }
    assert_eq!(magnification(&s, "across"), plain);
}

#[test]
fn the_error_falls_step_by_step() {
    let mut s = synthetic();
    with_play_found(&mut s, 1e-3);
    s.run.steps[0].calibration.holdout.fitted.mean_m = s.run.calibration.holdout.fitted.mean_m / 4.0;
    let messages = read(&write(&s, InputMessages::Reference, "out").join("run.mcap"));
    let steps = list(&own(&messages, "/armcal/steps")[0], "steps");
    let adds: Vec<String> = steps.iter().map(|step| string(step, "adds")).collect();
    assert_eq!(adds, ["nominal", "calibration", "backlash:1"]);
    assert!((number(&steps[2], "falls_by_percent") - 75.0).abs() < 1e-9);
    let holdout = &s.run.calibration.holdout;
    let means: Vec<f64> = steps.iter().map(|step| number(step, "mean_mm")).collect();
    // With the four digits that a table shows.
    for (shown, mean_m) in means.iter().zip([holdout.nominal.mean_m, holdout.fitted.mean_m]) {
        assert!((shown - mean_m * 1e3).abs() <= 5e-4 * shown && shown.to_string().len() <= 6, "{shown}");
    }
    for residual in own(&messages, "/armcal/residuals") {
        assert_eq!(numbers(&residual, "step_norm_mm"), [0.0]);
    }
}

/// Every string of a JSON value that names a topic or begins with one, without the rest of its path.
fn topics(value: &Value, found: &mut Vec<String>) {
    match value {
        Value::String(s) if s.starts_with('/') => found.push(s.split('.').next().unwrap().to_owned()),
        Value::Array(all) => all.iter().for_each(|v| topics(v, found)),
        Value::Object(all) => {
            found.extend(all.keys().filter(|k| k.starts_with('/')).cloned());
            all.values().for_each(|v| topics(v, found));
        }
        _ => {}
    }
}

#[test]
fn layouts_name_topics_that_are_there() {
    let mut found = synthetic();
    with_play_found(&mut found, 1e-3);
    let mut bare = synthetic();
    bare.run.board = None;
    bare.run.observations.clear();
    bare.run.calibration.residuals.clear();
    for (name, s) in [("plain", synthetic()), ("found", found)] {
        let out = write(&s, InputMessages::Reference, name);
        let messages: Vec<Full> = read(&out.join("run.mcap"));
        for file in ["foxglove-layout.json", "foxglove-layout-legacy.json"] {
            let layout: Value = serde_json::from_slice(&std::fs::read(out.join(file)).unwrap()).unwrap();
            let mut named = Vec::new();
            topics(&layout, &mut named);
            assert!(named.len() > 30, "{name}: {named:?}");
            for topic in named {
                assert!(messages.iter().any(|m| m.topic == topic), "{name}, {file}: nothing on {topic}");
            }
        }
    }
    write(&bare, InputMessages::Reference, "nothing to show");
}
