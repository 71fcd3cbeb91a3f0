use crate::support::{armcal, number, root, run_pipeline, shipped};
use serde_json::Value;
use std::path::Path;

/// The same recordings with Vicon and without: held-out cavities, dwell by dwell.
#[test]
fn the_table_alone_does_nearly_as_well_as_the_camera() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let (seen, unseen) = (folder.path().join("vicon"), folder.path().join("table"));
    run_pipeline(&root().join("pipelines/paper.toml"), &seen, &[0]);
    let summary = run_pipeline(&root().join("pipelines/paper-camera-free.toml"), &unseen, &[0]);
    let over_floor =
        number(&summary, "/fit/holdout/fitted_mm/mean") / number(&summary, "/fit/noise_floor_mm");
    let output = armcal([Path::new("compare"), &seen, &unseen, Path::new("--json")]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let compared: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let mean = |side: &str| number(&compared, &format!("/held_out/{side}"));
    let (vicon_mm, table_mm) = (mean("before_mm"), mean("after_mm"));
    println!(
        "held out, the same dwells: Vicon {vicon_mm:.3}, table alone {table_mm:.3} mm; {over_floor:.2} of the floor"
    );
    assert!(number(&compared, "/held_out/n") > 90.0);
    assert!(table_mm < 1.5 * vicon_mm);
    assert!(over_floor < 1.5);
}

/// What the table taught holds where Vicon looks: points and paths, the base placed by the verified dwells.
#[test]
fn the_cameras_recordings_verify_what_the_table_taught() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let out = folder.path().join("out");
    run_pipeline(&root().join("pipelines/paper-camera-free.toml"), &out, &[0]);
    let text = shipped("paper-verify.toml");
    let base = text.find("[frames.base]").expect("its base");
    let text = format!("{}[frames.base]\npose = \"estimated\"\n", &text[..base]);
    let verifying = folder.path().join("verifying.toml");
    std::fs::write(&verifying, text).expect("pipeline");
    let output = armcal([Path::new("verify"), &out, &verifying, Path::new("--json")]);
    // The recordings are those it was calibrated on, though only their encoders were read: said, and not hidden.
    assert_eq!(output.status.code(), Some(3), "{}", String::from_utf8_lossy(&output.stderr));
    let seen: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let rows = seen["points"].as_array().expect("rows");
    let tracked =
        rows.iter().find(|r| r["subject"] == "tracked").expect("free poses, which the table never had");
    let [before_mm, after_mm] = ["before", "after"].map(|s| 1e3 * number(tracked, &format!("/{s}/mean_m")));
    println!("free poses seen by Vicon: nominal {before_mm:.2}, camera-free calibration {after_mm:.2} mm");
    assert!(after_mm < 0.25 * before_mm);
}
