//! The rig in a physics engine that shares nothing with armcal's own lab: `tests/python/mujoco_rig`.

use crate::support::{number, python_with, root};
use serde_json::Value;
use std::process::Command;

/// Makes sessions, diagnoses them, adds what is suggested, and returns the counts of the judge.
fn judged(only: &str, nothing: usize) -> Option<Value> {
    let python = python_with("scipy, numpy, mcap_ros2, mujoco")?;
    let folder = tempfile::tempdir().expect("temporary folder");
    let output = Command::new(python)
        .args(["-m", "mujoco_rig.judge"])
        .arg(env!("CARGO_BIN_EXE_armcal"))
        .arg(folder.path())
        .args(["--only", only, "--seeds", "1", "--from", "901", "--nothing", &nothing.to_string()])
        .env("PYTHONPATH", root().join("tests/python"))
        .current_dir(folder.path())
        .output()
        .expect("starting python");
    let (said, failed) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{failed}");
    println!("{said}");
    Some(serde_json::from_str(said.lines().last().expect("a line")).expect("the counts"))
}

#[test]
fn what_acts_depends_on_who_holds_the_arm() {
    // A spring that rests while a hand carries the arm, and play that a hand and a servo leave on opposite flanks.
    let Some(found) = judged("compliance2,backlash1", 1) else { return };
    assert_eq!(number(&found, "/counts/compliance2/first"), 1.0);
    assert_eq!(number(&found, "/counts/backlash1/first"), 1.0);
    assert_eq!(number(&found, "/counts/nothing/at the floor"), 1.0);
    assert!(number(&found, "/after_floors/compliance2") < 1.1);
}
