use crate::support::{armcal, files_made, root};
use armcal_core::{DwellId, FeatureId, Observation, Reference};
use armcal_lab::pair::{PairConfig, simulate};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The lab's torso with two arms, with play in the drives of some joints: whose (an arm's number, 2 for the torso), which of
/// its joints, width [deg].
fn hiding(seed: u64, gaps: &[(usize, usize, f64)]) -> PairConfig {
    let path = root().join("pipelines/lab/humanoid.toml");
    let text = std::fs::read_to_string(&path).expect("lab file");
    let mut config = PairConfig::from_toml(&text, &path).expect("valid");
    config.seed = seed;
    for (whose, joint, width_deg) in gaps {
        let gap = json!({ "kind": "gap", "joint": joint, "width_deg": width_deg });
        let gap = serde_json::from_value(gap).expect("a mechanism");
        match config.torso.as_mut().filter(|_| *whose == 2) {
            Some(torso) => torso.arm.mechanisms.push(gap),
            None => config.arms[*whose].mechanisms.push(gap),
        }
    }
    config
}

/// The shipped pipeline on another recording, with cameras or without.
fn pipeline(folder: &Path, with_cameras: bool) -> PathBuf {
    let path = root().join("pipelines/simulated/humanoid.toml");
    let mut text = std::fs::read_to_string(path).expect("pipeline");
    text = text
        .replace("../../out/humanoid/", "")
        .replace("../models", root().join("pipelines/models").to_str().expect("UTF-8"));
    if !with_cameras {
        let mut table: toml::Table = text.parse().expect("TOML");
        let streams = table["streams"].as_table_mut().expect("streams");
        streams.retain(|name, _| name == "joints");
        table["frames"].as_table_mut().expect("frames").remove("base");
        text = table.to_string();
    }
    let path = folder.join("pipeline.toml");
    std::fs::write(&path, text).expect("writable");
    path
}

fn diagnosed(pipeline: &Path) -> Vec<String> {
    let output = armcal(["diagnose".as_ref(), pipeline.as_os_str(), "--json".as_ref()]);
    let said: Value = serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&output.stderr)));
    let names = said["names"].as_array().expect("names").iter().filter_map(Value::as_str);
    names.map(|name| name.split([',', '@']).next().unwrap_or_default().to_owned()).collect()
}

/// Which effects are hidden, only the assertion knows.
#[test]
fn play_in_an_arm_is_named_and_that_of_the_waist_where_something_sees_the_hands() {
    let folder = tempfile::tempdir().expect("a folder");
    simulate(&hiding(41, &[(2, 1, 0.5), (1, 2, 0.6)]), folder.path()).expect("simulated");
    let seen = diagnosed(&pipeline(folder.path(), true));
    assert_eq!(seen, ["backlash:1", "backlash:6"], "the waist and l_lift");
    // The waist turns both hands alike; play that gravity closes is nearly the same here.
    assert_eq!(diagnosed(&pipeline(folder.path(), false))[0], "backlash:6");
}

#[test]
fn the_hands_of_one_robot_calibrate_its_arms_and_leave_its_waist_open() {
    let folder = tempfile::tempdir().expect("a folder");
    let truth = simulate(&hiding(51, &[]), folder.path()).expect("simulated").facts;
    let out = folder.path().join("out");
    let mut command = Command::new(env!("CARGO_BIN_EXE_armcal"));
    let files = files_made(command.arg("run").arg(pipeline(folder.path(), false)), &out);
    let summary: Value = serde_json::from_slice(&files["summary.json"]).expect("summary");
    let fit = &summary["fit"];
    let mm = |value: &Value| value.as_f64().expect("a number");
    let (left, floor) = (mm(&fit["holdout"]["fitted_mm"]["mean"]), mm(&fit["noise_floor_mm"]));
    assert!(
        left < 1.25 * floor && mm(&fit["holdout"]["nominal_mm"]["mean"]) > 50.0 * floor,
        "{left} {floor}"
    );
    assert_eq!(summary["arms"], json!(["tip", "left_hand"]));
    let of_waist: Vec<&Value> = fit["parameters"]
        .as_array()
        .expect("parameters")
        .iter()
        .filter(|p| p["name"].as_str().is_some_and(|name| name.starts_with("waist.")))
        .collect();
    assert_eq!(of_waist.len(), 6);
    assert!(of_waist.iter().all(|p| p["determined"] == false), "{of_waist:?}");
    let open = fit["undetermined"].to_string();
    for quantity in ["x", "y", "z", "rx", "ry", "rz"] {
        assert!(open.contains(&format!("waist.{quantity}: ")), "{quantity}: {open}");
    }

    // What was left of it closes the true poses again, wherever the waist stands.
    let past = armcal_result::open_model(&out).expect("model.json").arms().expect("the robot");
    let names = past.model.chain().joint_names();
    assert_eq!(names, ["waist", "r_yaw", "r_lift", "r_elbow", "l_yaw", "l_lift", "l_elbow"]);
    let closed = Reference::Joined { to: armcal_core::Against::Feature(FeatureId(1)) };
    for dwell in truth.recordings[0].dwells.iter().filter(|dwell| dwell.joined) {
        for waist_rad in [-0.7, 0.4] {
            let joint_rad = [vec![waist_rad], dwell.joint_rad.concat()].concat();
            let o = Observation::bare(DwellId { recording: 0, dwell: 0 }, joint_rad, closed.clone());
            let open_m = past.model.residual(&past.values, &o).position_m.norm();
            assert!(open_m < 0.35e-3, "{open_m} m");
        }
    }
}

#[test]
fn what_a_robot_with_two_tips_cannot_be_is_told_in_words() {
    let folder = tempfile::tempdir().expect("a folder");
    simulate(&hiding(61, &[]), folder.path()).expect("simulated");
    let says = |from: &str, to: &str| {
        let path = pipeline(folder.path(), true);
        let text = std::fs::read_to_string(&path).expect("pipeline");
        assert!(text.contains(from), "{from}");
        std::fs::write(&path, text.replace(from, to)).expect("writable");
        let output = armcal(["run".as_ref(), path.as_os_str()]);
        assert_eq!(output.status.code(), Some(1));
        String::from_utf8(output.stderr).expect("text")
    };
    let unread = says("names = [\"waist\"]", "names = [\"waist_yaw\"]");
    assert!(unread.contains("waist_yaw"), "{unread}");
    let absent = says("\"l_elbow\"]", "\"l_elbow\", \"r_yaw\"]");
    assert!(absent.contains("r_yaw"), "{absent}");
    let unknown = says("\"tip\", \"left_hand\"]", "\"tip\", \"left\"]");
    assert!(unknown.contains("closed_chain.between") && unknown.contains("tip, left_hand"), "{unknown}");
    let twice = says("\"tip\", \"left_hand\"]", "\"tip\", \"tip\"]");
    assert!(twice.contains("names `tip` twice"), "{twice}");
    let nowhere = says("link = \"l_hand\"", "link = \"l_hnd\"");
    assert!(nowhere.contains("l_hand"), "{nowhere}");
}
