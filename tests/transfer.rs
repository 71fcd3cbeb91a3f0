use crate::support::{armcal, number, real_recordings, root, run_pipeline, shipped};
use serde_json::Value;
use std::path::Path;

/// `armcal transfer` with its JSON; panics with its words unless it exits with `code`.
pub fn transfer(from: &Path, to: &Path, effects: &[&str], code: i32) -> Value {
    transferred(from, to, effects, &[code])
}

/// The same, of one of these codes.
fn transferred(from: &Path, to: &Path, effects: &[&str], codes: &[i32]) -> Value {
    let words = [Path::new("transfer"), from, to].into_iter().chain(effects.iter().map(Path::new));
    let output = armcal(words.chain([Path::new("--json")]));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let code = output.status.code().unwrap_or(-1);
    assert!(codes.contains(&code), "{code}: {said}{}", String::from_utf8_lossy(&output.stdout));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

fn pipelines(name: &str) -> std::path::PathBuf {
    root().join("pipelines").join(name)
}

/// The same arm on other days: what geometry learnt from the level board holds on the tilted ones, and what is not there
/// helps nowhere.
#[test]
fn geometry_carries_over_and_what_is_not_there_does_not() {
    let (from, to) = (pipelines("paper-normal.toml"), pipelines("paper-verify.toml"));
    // An event of the first session is nobody else's.
    let seen = transfer(&from, &to, &["compliance:2", "tool_shift@0.40"], 0);
    let [before, after] = ["before", "after"].map(|at| number(&seen, &format!("/calibration/{at}")));
    println!("geometry: {before:.2} -> {after:.3} mm, floor {:.3}", number(&seen, "/noise_floor_mm"));
    assert!(before > 15.0 && after < 0.25, "{before} -> {after}");
    assert!(number(&seen, "/calibration/change_ci95/1") < 0.0);
    let effects = seen["effects"].as_array().expect("effects");
    assert_eq!(effects.len(), 1, "{effects:?}");
    assert_eq!(effects[0]["verdict"], "no more than chance", "{}", effects[0]);
    assert_eq!(seen["left_behind"][0]["effect"], "tool_shift@0.40");

    // The same by `verify`, which opens a result instead of making one: one quantity, one value.
    let folder = tempfile::tempdir().expect("temporary folder");
    run_pipeline(&from, folder.path(), &[0]);
    let output = armcal([Path::new("verify"), folder.path(), &to, Path::new("--json")]);
    let verified: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let row = verified["points"].as_array().expect("rows").iter().find(|r| r["by"] == "all").expect("all");
    for (at, ours_mm) in [("/before/mean_m", before), ("/after/mean_m", after)] {
        let theirs_mm = 1e3 * number(row, at);
        assert!((theirs_mm - ours_mm).abs() < 0.02 * theirs_mm, "{at}: {theirs_mm} and {ours_mm} mm");
    }
}

/// A session is no judge of itself, another arm no judge at all, and an effect is spelt right before hours of work.
#[test]
fn what_cannot_judge_is_refused() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let refused = |from: &Path, to: &Path, effect: &str, code: i32, words: &[&str]| {
        let arguments = [Path::new("transfer"), from, to, Path::new(effect)];
        let output = armcal(arguments.into_iter().filter(|a| !a.as_os_str().is_empty()));
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{said}");
        assert!(words.iter().all(|word| said.contains(word)), "{said}");
    };
    let (normal, verify) = (pipelines("paper-normal.toml"), pipelines("paper-verify.toml"));
    refused(&normal, &pipelines("paper.toml"), "", 1, &["normal"]);
    refused(&normal, &verify, "backlsh:1", 2, &["backlash"]);
    let other = shipped("paper-verify.toml").replace("models/right_arm", "models/left_arm");
    let path = folder.path().join("other.toml");
    std::fs::write(&path, other).expect("pipeline");
    // The setup of that session contradicts its data, or the arms differ by name: no sentence about effects.
    refused(&normal, &path, "", 1, &[]);
}

/// A shipped pipeline on some of its recordings, in order.
fn on_some(pipeline: &str, wanted: impl Fn(usize) -> bool, path: &Path) {
    let text = shipped(pipeline);
    let mut blocks = text.split("[[recordings]]\n");
    let mut own = blocks.next().expect("a head").to_owned();
    let count = blocks.clone().count();
    for (at, block) in blocks.enumerate() {
        // Behind the last recording comes the rest of the pipeline.
        let (recording, rest) = block.split_once("\n\n").expect("a blank line behind a recording");
        if wanted(at) {
            own += &format!("[[recordings]]\n{recording}\n\n");
        }
        if at + 1 == count {
            own += rest;
        }
    }
    if (0..count).filter(|at| wanted(*at)).count() < 2 {
        own = own.replace("kind = \"each-recording\"", "kind = \"none\"");
    }
    std::fs::write(path, own).expect("pipeline");
}

/// What two placements of the fixture name, with the hold-out that they have, helps in the third or is said not to; on the iiwa14
/// it is the same compliance from any two placements, and it helps in the third (docs/real-robots.md).
#[test]
fn what_two_placements_name_holds_in_the_third_or_is_said_not_to() {
    for (robot, always) in [("panda4", None), ("iiwa14", Some("arm_compliance")), ("panda", None)] {
        if robot != "panda4" && real_recordings().is_none() {
            continue;
        }
        let folder = tempfile::tempdir().expect("temporary folder");
        let [two, third] = ["two.toml", "third.toml"].map(|name| folder.path().join(name));
        for judge in 0..3 {
            on_some(&format!("mukca-{robot}.toml"), |at| at != judge, &two);
            on_some(&format!("mukca-{robot}.toml"), |at| at == judge, &third);
            let seen = transferred(&two, &third, &[], &[0, 3]);
            let effects = seen["effects"].as_array().expect("effects");
            for effect in effects {
                let [before, after] =
                    ["before", "after"].map(|at| number(effect, &format!("/held_out/{at}")));
                let (name, verdict) = (&effect["effect"], &effect["verdict"]);
                println!("{robot}, placement {judge}: {name} {before:.3} -> {after:.3} mm, {verdict}");
                assert!(after < before || verdict != "it helps there", "{robot} {judge}: {effect}");
            }
            if let Some(name) = always {
                assert!(
                    effects.iter().any(|e| e["effect"] == name && e["verdict"] == "it helps there"),
                    "{robot} {judge}: {effects:?}"
                );
            }
        }
    }
}
