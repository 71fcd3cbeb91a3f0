//! The example is what it says: a pipeline run from another program, against what the same data gave by hand.

#![allow(clippy::expect_used, reason = "a test may stop")]

#[path = "../examples/embed.rs"]
#[allow(dead_code, reason = "its `main` is for whoever runs it")]
mod embed;

use std::path::Path;

/// `docs/real-robots.md` has the same arm: 0.231 mm with the geometry alone, and a compliance that leaves less.
#[test]
fn recordings_and_a_urdf_give_errors_and_a_name() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../pipelines/mukca-panda4.toml");
    let answer = embed::calibrate(&path).expect("a calibration");
    let [nominal_mm, fitted_mm] = answer.error_mm;
    assert!((fitted_mm - 0.231).abs() < 0.002 && nominal_mm > 5.0 * fitted_mm, "{nominal_mm} {fitted_mm}");
    let compliance = |set: &Vec<String>| set.iter().any(|name| name == "arm_compliance");
    assert!(answer.missing.iter().any(compliance), "{:?}", answer.missing);
    assert!(answer.with_them_mm < 0.9 * fitted_mm, "{}", answer.with_them_mm);
}
