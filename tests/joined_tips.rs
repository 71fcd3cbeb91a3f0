use crate::support::{armcal, files_made, root};
use armcal_core::Pose;
use armcal_lab::arm::AxisArm;
use armcal_lab::pair::{PairConfig, PairTruth, simulate};
use nalgebra::{Point3, Quaternion, UnitQuaternion, Vector3};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Days on which the same two arms were recorded.
const DAYS: [&str; 3] = ["monday", "tuesday", "wednesday"];

/// Three recordings of the lab's pair in a folder, and what was true.
fn recorded(seed: u64, folder: &Path) -> PairTruth {
    let path = root().join("pipelines/lab/two-arms.toml");
    let text = std::fs::read_to_string(&path).expect("lab file");
    let mut config = PairConfig::from_toml(&text, &path).expect("valid");
    (config.seed, config.recordings) = (seed, DAYS.map(str::to_owned).to_vec());
    simulate(&config, folder).expect("simulated").facts
}

/// The shipped pipeline on one of these days, changed.
fn pipeline(folder: &Path, day: &str, change: [&str; 2]) -> PathBuf {
    let shipped = std::fs::read_to_string(root().join("pipelines/two-arms.toml")).expect("pipeline");
    let text = shipped
        .replace("../fixtures/two-arms/closed.mcap", &format!("{day}.mcap"))
        .replace("models/", &format!("{}/", root().join("pipelines/models").display()));
    assert!(text.contains(change[0]));
    let path = folder.join(format!("{day}.toml"));
    std::fs::write(&path, text.replace(change[0], change[1])).expect("writable");
    path
}

const AS_IT_IS: [&str; 2] = ["", ""];

/// The result of a day, in `results/<day>`.
fn result(folder: &Path, day: &str) -> PathBuf {
    let out = folder.join("results").join(day);
    std::fs::create_dir_all(folder.join("results")).expect("a folder");
    let mut command = Command::new(env!("CARGO_BIN_EXE_armcal"));
    files_made(command.arg("run").arg(pipeline(folder, day, AS_IT_IS)), &out);
    out
}

fn json(output: &Output) -> Value {
    let text = String::from_utf8_lossy(&output.stderr);
    serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{e}: {text}"))
}

fn refused(arguments: &[&Path]) -> String {
    let output = armcal(arguments.iter().map(|a| a.as_os_str()));
    // An option that cannot be is 2.
    assert!(matches!(output.status.code(), Some(1 | 2)), "{}", String::from_utf8_lossy(&output.stdout));
    String::from_utf8(output.stderr).expect("text")
}

/// Where the tip of an arm truly is [m], by the lab's own geometry.
fn true_tip_m(truth: &PairTruth, arm: usize, joint_rad: &[f64]) -> Vector3<f64> {
    let of = &truth.arms[arm];
    let mut rows = truth.config.arms[arm].rows.clone();
    for row in &mut rows {
        let value = |quantity: &str| {
            let name = format!("{}.{}.{quantity}", of.name, row.name);
            of.deviations.iter().find(|d| d.name == name).expect("a deviation").value
        };
        (row.theta_deg, row.alpha_deg) = (value("theta").to_degrees(), value("alpha").to_degrees());
        (row.d_m, row.a_m) = (value("d"), value("a"));
    }
    let base = &of.world_from_base;
    let [x, y, z, w] = base.quaternion_xyzw;
    let rotation = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
    let base = Pose::from_parts(Vector3::from(base.xyz_m).into(), rotation);
    (base * Point3::from(AxisArm::from_rows(&rows).tip(joint_rad))).coords
}

#[test]
fn set_points_of_either_arm_bring_both_tips_to_one_place() {
    let folder = tempfile::tempdir().expect("a folder");
    let truth = recorded(91, folder.path());
    let result = result(folder.path(), "monday");
    let targets = folder.path().join("targets.csv");
    let places = [[0.40, 0.25, 0.30], [0.45, 0.20, 0.35], [0.35, 0.30, 0.20]];
    let rows = places.map(|[x, y, z]| format!("{x},{y},{z}\n")).concat();
    std::fs::write(&targets, format!("x_m,y_m,z_m\n{rows}")).expect("writable");
    let out = folder.path().join("set-points.csv");
    let found = ["right", "left"].map(|arm| {
        let output = armcal([
            "compensate".as_ref(),
            result.as_os_str(),
            targets.as_os_str(),
            "--tip".as_ref(),
            arm.as_ref(),
            "--from=0,-30,10,5,-25,15".as_ref(),
            "--out".as_ref(),
            out.as_os_str(),
            "--json".as_ref(),
        ]);
        json(&output)["set_points"].as_array().expect("set-points").clone()
    });
    let readings = |point: &Value, which: &str| -> Vec<f64> {
        point[which].as_array().expect("readings").iter().filter_map(Value::as_f64).collect()
    };
    let mut nominal_m = 0.0;
    for (right, left) in found[0].iter().zip(&found[1]) {
        let apart_m = |which: &str| {
            let own = [readings(right, which), readings(left, which)];
            (true_tip_m(&truth, 0, &own[0][..3]) - true_tip_m(&truth, 1, &own[1][3..])).norm()
        };
        let [before_m, after_m] = ["nominal_rad", "set_point_rad"].map(apart_m);
        assert!(after_m < 0.2e-3, "{before_m} {after_m}");
        nominal_m += before_m / found[0].len() as f64;
        // The other arm stays where --from has it.
        let stays = [5.0, -25.0, 15.0].map(f64::to_radians);
        assert!(
            readings(right, "set_point_rad")[3..].iter().zip(stays).all(|(q, at)| (q - at).abs() < 1e-12)
        );
    }
    assert!(nominal_m > 1e-3, "{nominal_m}");
    let whose = refused(&["compensate".as_ref(), &result, &targets]);
    assert!(whose.contains("--tip") && whose.contains("right, left"), "{whose}");
    let whence = refused(&["compensate".as_ref(), &result, &targets, "--tip".as_ref(), "left".as_ref()]);
    assert!(whence.contains("--from") && whence.contains("right.joint1"), "{whence}");
}

#[test]
fn another_recording_of_joined_tips_says_what_a_result_is_worth() {
    let folder = tempfile::tempdir().expect("a folder");
    recorded(92, folder.path());
    let result = result(folder.path(), "monday");
    let verified = |day: &str| {
        let path = pipeline(folder.path(), day, AS_IT_IS);
        armcal(["verify".as_ref(), result.as_os_str(), path.as_os_str(), "--json".as_ref()])
    };
    let new = verified("tuesday");
    assert!(new.status.success());
    let new = json(&new);
    let row = |subject: &str| {
        let rows = new["points"].as_array().expect("rows").iter();
        rows.clone().find(|row| row["subject"] == subject).expect("a row").clone()
    };
    let mean_m = |side: &str| row("all")[side]["mean_m"].as_f64().expect("a mean");
    assert_eq!(row("all")["n"], 80, "two of 82 dwells are open");
    assert!(mean_m("before") > 2e-3 && mean_m("after") < 0.12e-3, "{}", row("all"));
    let codes: Vec<&Value> =
        new["warnings"].as_array().expect("warnings").iter().map(|w| &w["code"]).collect();
    assert!(codes.iter().any(|code| *code == "tips-open"), "{codes:?}");
    assert!(new["iso9283"]["calibrated"]["criteria"].as_array().expect("criteria").is_empty());
    // What the calibration saw proves nothing.
    let known = verified("monday");
    assert_eq!(known.status.code(), Some(3));
    assert_eq!(json(&known)["told"][0]["dwells"], 82);
}

#[test]
fn days_of_two_arms_are_pooled_and_those_joined_otherwise_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    recorded(93, folder.path());
    let days = [result(folder.path(), "monday"), result(folder.path(), "tuesday")];
    let path = pipeline(folder.path(), "wednesday", AS_IT_IS);
    let out = folder.path().join("pool");
    let mut command = Command::new(env!("CARGO_BIN_EXE_armcal"));
    let files = files_made(command.arg("pool").arg(&path).arg(folder.path().join("results")), &out);
    let summary = |bytes: &[u8]| serde_json::from_slice::<Value>(bytes).expect("a summary");
    let pooled = summary(&files["summary.json"]);
    assert_eq!(pooled["fit"]["holdout"]["n"], 160);
    let sigma = |summary: &Value, name: &str| {
        let all = summary["fit"]["parameters"].as_array().expect("parameters").clone();
        all.iter().find(|p| p["name"] == name).expect("there")["sigma"].as_f64().expect("a number")
    };
    for day in &days {
        let alone = summary(&std::fs::read(day.join("summary.json")).expect("a summary"));
        for name in ["right.joint1.alpha", "left.joint1.alpha", "left.joint2.alpha"] {
            assert!(sigma(&pooled, name) < 0.85 * sigma(&alone, name), "{name} in {}", day.display());
        }
    }
    let unseen = summary(&files["pool.json"])["transfer"]["unseen"].clone();
    let mean_mm = |which: &str| unseen[which]["mean"].as_f64().expect("a mean");
    assert!(mean_mm("nominal_mm") > 2.0 && mean_mm("fitted_mm") < 0.12, "{unseen}");
    assert!(files.contains_key("right.toml") && files.contains_key("left.toml"));
    let change = ["kind = \"same-point\"", "kind = \"rigid-link\"\nlength_mm = 180.0"];
    let linked = pipeline(folder.path(), "wednesday", change);
    let other = refused(&["pool".as_ref(), &linked, &folder.path().join("results")]);
    assert!(other.contains("joined in another way"), "{other}");
}
