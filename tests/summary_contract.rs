use crate::support::{python_with, read_json, root, run_pipeline};
use armcal_result::summary::summary_schema;
use armcal_wording::warnings_page;
use serde_json::Value;
use std::process::Command;

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

/// What validates summaries is what they are made of.
#[test]
fn the_schema_is_that_of_the_types() {
    let path = root().join("docs/summary.schema.json");
    let written = std::fs::read_to_string(&path).expect("the schema");
    let made = format!("{:#}\n", summary_schema());
    assert!(written == made, "run `cargo run -p armcal-dev -- schema > docs/summary.schema.json`");
}

#[test]
fn every_kind_of_warning_is_in_the_docs() {
    let written = std::fs::read_to_string(root().join("docs/warnings.md")).expect("docs/warnings.md");
    assert!(written == warnings_page(), "run `cargo run -p armcal-dev -- warnings > docs/warnings.md`");
}

/// The program `jsonschema` of Python judges summaries by the schema: those of all kinds of runs hold, and none that lost a field.
#[test]
fn summaries_hold_their_schema() {
    let Some(python) = python_with("jsonschema") else { return };
    let out = tempfile::tempdir().expect("temporary folder");
    let mut summaries = Vec::new();
    for name in ["paper", "two-arms"] {
        let folder = out.path().join(name);
        run_pipeline(&root().join(format!("pipelines/{name}.toml")), &folder, &[0, 3]);
        summaries.push(folder.join("summary.json"));
    }
    let cut = out.path().join("cut.json");
    let mut value = read_json(&summaries[0]);
    value["fit"].as_object_mut().expect("a fit").remove("covariance");
    std::fs::write(&cut, value.to_string()).expect("written");
    let script = "import json, sys, jsonschema\n\
                  schema = json.load(open(sys.argv[1]))\n\
                  jsonschema.Draft202012Validator.check_schema(schema)\n\
                  judge = jsonschema.Draft202012Validator(schema)\n\
                  for path in sys.argv[2:]:\n    print([e.json_path for e in judge.iter_errors(json.load(open(path)))])\n";
    let schema = root().join("docs/summary.schema.json");
    let mut judge = Command::new(python);
    judge.args(["-c", script]).arg(schema).args(&summaries).arg(cut);
    let judged = judge.output().expect("python runs");
    let said = String::from_utf8_lossy(&judged.stdout);
    assert_eq!(said, "[]\n[]\n['$.fit']\n", "{}", String::from_utf8_lossy(&judged.stderr));
}

/// The covariance is that of the parameters: its diagonal their variances, and it is one.
#[test]
fn the_covariance_is_that_of_the_parameters() {
    let out = tempfile::tempdir().expect("temporary folder");
    let summary = run_pipeline(&root().join("pipelines/paper-normal.toml"), out.path(), &[0, 3]);
    let covariance = &summary["fit"]["covariance"];
    let names: Vec<&str> =
        covariance["names"].as_array().expect("names").iter().filter_map(Value::as_str).collect();
    let rows: Vec<Vec<f64>> = serde_json::from_value(covariance["rows"].clone()).expect("rows of numbers");
    let free: Vec<&Value> = summary["fit"]["parameters"]
        .as_array()
        .expect("parameters")
        .iter()
        .filter(|p| p["free"] == true)
        .collect();
    assert!(free.len() > 5 && names.len() == free.len() && rows.len() == free.len());
    for (i, parameter) in free.iter().enumerate() {
        assert_eq!(parameter["name"], names[i]);
        let sigma = parameter["sigma"].as_f64().expect("a number");
        assert!((rows[i][i].sqrt() / sigma - 1.0).abs() < 1e-9, "{}", names[i]);
        for (j, row) in rows.iter().enumerate() {
            let scale = (rows[i][i] * row[j]).sqrt();
            assert!(rows[i][j].abs() <= (1.0 + 1e-9) * scale && (rows[i][j] - row[i]).abs() <= 1e-9 * scale);
        }
    }
}
