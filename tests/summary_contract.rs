use crate::support::{root, run_pipeline};
use serde_json::Value;

/// The contract of `summary.json`: every pointer must exist with this kind of value. Extending it is fine,
/// renaming or dropping is not.
const CONTRACT: &[(&str, &str)] = &[
    ("/schema", "string"),
    ("/recordings", "array"),
    ("/recordings/0/path", "string"),
    ("/recordings/0/sha256", "string"),
    ("/recordings/0/dwells", "number"),
    ("/recordings/0/associated", "number"),
    ("/recordings/0/rejected", "array"),
    ("/recordings/0/clock_offset_ms", "number"),
    ("/recordings/0/warnings", "array"),
    ("/fit/objective", "string"),
    ("/fit/effects", "array"),
    ("/fit/noise_floor_mm", "number"),
    ("/fit/train/n", "number"),
    ("/fit/holdout/n", "number"),
    ("/fit/parameters", "array"),
    ("/fit/parameters/0/name", "string"),
    ("/fit/parameters/0/unit", "string"),
    ("/fit/parameters/0/nominal", "number"),
    ("/fit/parameters/0/value", "number"),
    ("/fit/parameters/0/ci95", "array"),
    ("/fit/parameters/0/determined", "boolean"),
    ("/fit/parameters/0/at_bound", "boolean"),
    ("/fit/undetermined", "array"),
    ("/frames/0/frame", "string"),
    ("/frames/0/parent", "string"),
    ("/frames/0/xyz_m", "array"),
    ("/frames/0/rpy_deg", "array"),
    ("/diagnosis/verdict", "string"),
    ("/diagnosis/names", "array"),
    ("/diagnosis/probability", "number"),
    ("/diagnosis/p_adjusted", "number"),
    ("/diagnosis/candidates/0/effect", "string"),
    ("/diagnosis/candidates/0/target", "string"),
    ("/diagnosis/candidates/0/parameters", "object"),
    ("/diagnosis/candidates/0/behind_nats", "number"),
    ("/diagnosis/candidates/0/probability", "number"),
    ("/diagnosis/candidates/0/p_adjusted", "number"),
    ("/diagnosis/candidates/0/holdout_mm/before", "number"),
    ("/diagnosis/candidates/0/holdout_mm/after", "number"),
    ("/diagnosis/candidates/0/same_to_the_data", "array"),
    // An object with channel, driver and expression where something unlisted is missing.
    ("/diagnosis/unknown", "null"),
    ("/diagnosis/cannot_tell_apart/0/1", "string"),
    ("/diagnosis/not_testable/0/effect", "string"),
    ("/diagnosis/not_testable/0/smallest_seen", "string"),
    ("/diagnosis/record_next", "array"),
];

fn kind(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "boolean",
        Value::Number(_) => "number",
        Value::String(_) => "string",
        Value::Array(_) => "array",
        Value::Object(_) => "object",
    }
}

#[test]
fn summary_keeps_its_contract() {
    let out = tempfile::tempdir().expect("temporary folder");
    let summary = run_pipeline(&root().join("pipelines/paper.toml"), out.path(), &[0]);
    assert_eq!(summary["schema"], "armcal.summary/1");
    for (pointer, expected) in CONTRACT {
        let value = summary.pointer(pointer).unwrap_or_else(|| panic!("{pointer} is missing"));
        assert_eq!(kind(value), *expected, "{pointer} is {value}");
    }
    for side in ["train", "holdout"] {
        for model in ["nominal_mm", "fitted_mm"] {
            for statistic in ["mean", "rms", "p95", "max"] {
                let pointer = format!("/fit/{side}/{model}/{statistic}");
                assert!(summary.pointer(&pointer).is_some_and(Value::is_number), "{pointer}");
            }
        }
    }
    let named = |name: &str| {
        let all = summary["fit"]["parameters"].as_array().expect("parameters");
        all.iter().any(|p| p["name"] == name && p["unit"] == "rad")
    };
    assert!(named("joint2.theta"));
}
