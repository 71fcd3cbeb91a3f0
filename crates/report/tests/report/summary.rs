use crate::synthetic::{HOSTILE, synthetic};
use armcal_core::ErrorStats;
use armcal_report::summary_json;
use armcal_result::summary::SCHEMA;
use serde::Deserialize;

/// The contract, field by field: all of these must be there.
#[derive(Deserialize)]
struct Summary {
    schema: String,
    recordings: Vec<Recording>,
    fit: Fit,
    diagnosis: serde_json::Value,
}

#[derive(Deserialize)]
struct Recording {
    path: String,
    sha256: String,
    dwells: usize,
    associated: usize,
    rejected: Vec<Rejected>,
    clock_offset_ms: f64,
    warnings: Vec<serde_json::Value>,
}

#[derive(Deserialize)]
struct Rejected {
    dwell: usize,
    why: String,
}

#[derive(Deserialize)]
struct Fit {
    objective: String,
    effects: Vec<String>,
    noise_floor_mm: f64,
    train: Side,
    holdout: Side,
    parameters: Vec<Parameter>,
    undetermined: Vec<String>,
}

#[derive(Deserialize)]
struct Side {
    n: usize,
    nominal_mm: Errors,
    fitted_mm: Errors,
}

#[derive(Deserialize)]
struct Errors {
    mean: f64,
    rms: f64,
    p95: f64,
    max: f64,
}

#[derive(Deserialize)]
struct Parameter {
    name: String,
    unit: String,
    nominal: f64,
    value: f64,
    ci95: [f64; 2],
    determined: bool,
    at_bound: bool,
    free: bool,
}

#[test]
fn the_contract_holds() {
    let s = synthetic();
    let json = summary_json(&s.run).unwrap();
    let summary: Summary = serde_json::from_str(&json).unwrap();
    assert_eq!(summary.schema, SCHEMA);
    assert!(summary.diagnosis.is_null() && json.contains("\"diagnosis\": null"));

    let [first, second, third] = summary.recordings.try_into().ok().unwrap();
    assert!(first.path.ends_with("input0.mcap"));
    let bytes = std::fs::read(&s.paths[0]).unwrap();
    assert_eq!(first.sha256, sha256(&bytes));
    assert_eq!((first.dwells, first.associated), (6, 4));
    assert!((first.clock_offset_ms - 12.3).abs() < 1e-9 && second.clock_offset_ms == 0.0);
    assert_eq!(second.rejected.iter().map(|r| r.dwell).collect::<Vec<_>>(), [4, 5]);
    assert!(second.rejected[0].why.contains("hovers"));
    assert_eq!((second.warnings.len(), third.warnings.len()), (1, 0));

    let fit = summary.fit;
    assert_eq!(fit.objective, "robust least squares (Huber)");
    assert!(fit.effects.is_empty() && fit.undetermined.len() == 1);
    assert!((fit.noise_floor_mm - 0.18).abs() < 1e-12);
    assert_eq!((fit.train.n, fit.holdout.n), (9, 4));
    let holdout = s.run.calibration.holdout;
    assert_same(&fit.holdout.nominal_mm, &holdout.nominal);
    assert_same(&fit.holdout.fitted_mm, &holdout.fitted);
    assert_same(&fit.train.fitted_mm, &s.run.calibration.train.fitted);
    assert!(fit.holdout.nominal_mm.mean > 5.0 && fit.holdout.fitted_mm.mean < 0.3);

    assert_eq!(fit.parameters.len(), s.run.model.parameters().len());
    let by_name = |name: &str| fit.parameters.iter().find(|p| p.name == name).unwrap();
    let theta = by_name("joint2.theta");
    assert_eq!(theta.unit, "rad");
    assert!((theta.value - theta.nominal - 0.02).abs() < 2e-5);
    assert!((theta.ci95[1] - theta.ci95[0] - 2.0 * 1.96e-4).abs() < 1e-12);
    assert!(by_name("joint1.theta").at_bound && !by_name("joint2.d").determined);
    assert!(!by_name("joint3.alpha").free && by_name("joint3.a").unit == "m");
    assert!(by_name(&format!("board.{HOSTILE}.x")).free);
}

#[test]
fn what_is_not_known_is_null_and_never_zero() {
    let mut s = synthetic();
    s.run.calibration.holdout = Default::default();
    s.run.calibration.noise_floor_m = f64::NAN;
    s.run.calibration.fit.estimates[0].value = f64::INFINITY;
    let summary: serde_json::Value = serde_json::from_str(&summary_json(&s.run).unwrap()).unwrap();
    let fit = &summary["fit"];
    assert_eq!(fit["holdout"]["n"], 0);
    assert!(fit["holdout"]["fitted_mm"]["mean"].is_null() && fit["noise_floor_mm"].is_null());
    assert!(fit["parameters"][0]["value"].is_null());
    assert_eq!(summary["status"], "ok");
}

#[test]
fn the_status_is_that_of_the_gravest_warning() {
    let mut s = synthetic();
    s.run.warnings[0].severity = armcal_core::Severity::Inadequate;
    assert_eq!(status(&s.run), "inadequate");
    let mut lost = s.run.recordings[1].warnings[0].clone();
    lost.severity = armcal_core::Severity::DataLost;
    s.run.recordings[2].report.warnings.push(lost);
    assert_eq!(status(&s.run), "data_lost");
}

fn status(run: &armcal_result::Run) -> String {
    let summary: serde_json::Value = serde_json::from_str(&summary_json(run).unwrap()).unwrap();
    summary["status"].as_str().unwrap().to_owned()
}

#[test]
fn a_split_recording_has_one_hash_and_all_its_files() {
    let mut s = synthetic();
    let second = s.run.recordings[1].report.files[0].clone();
    let first = &mut s.run.recordings[0];
    first.report.files.push(second);
    first.paths = vec!["input0.mcap".into(), "input1.mcap".into()];
    let summary: serde_json::Value = serde_json::from_str(&summary_json(&s.run).unwrap()).unwrap();
    let recording = &summary["recordings"][0];
    assert_eq!(recording["files"][1]["path"], "input1.mcap");
    let digest = |path| format!("{}\n", sha256(&std::fs::read(path).unwrap()));
    let digests: String = s.paths[..2].iter().map(digest).collect();
    assert_eq!(recording["sha256"].as_str().unwrap(), sha256(digests.as_bytes()));
}

#[test]
fn without_a_board_a_dwell_the_fit_uses_is_an_associated_one() {
    let mut s = synthetic();
    s.run.board = None;
    s.run.recordings.iter_mut().for_each(|r| r.association = None);
    let summary: serde_json::Value = serde_json::from_str(&summary_json(&s.run).unwrap()).unwrap();
    assert_eq!(summary["recordings"][0]["associated"], 5);
    assert_eq!(summary["recordings"][2]["associated"], 4);
}

fn assert_same(written: &Errors, stats: &ErrorStats) {
    let expected = [stats.mean_m, stats.rms_m, stats.p95_m, stats.max_m].map(|m| m * 1e3);
    assert_eq!([written.mean, written.rms, written.p95, written.max], expected);
}

fn sha256(bytes: &[u8]) -> String {
    use sha2::Digest as _;
    sha2::Sha256::digest(bytes).iter().map(|b| format!("{b:02x}")).collect()
}
