use crate::support::{number, root, run_pipeline};

/// The shipped recordings are one simulated rig within the paper's bounds: what the paper measured before
/// calibration (26.850 mm on average) must look alike, and geometry alone must explain it, since nothing else is hidden.
#[test]
fn the_main_job_takes_tens_of_millimetres_to_the_noise_floor_on_points_it_never_saw() {
    let out = tempfile::tempdir().expect("temporary folder");
    let summary = run_pipeline(&root().join("pipelines/paper.toml"), out.path(), &[0]);
    let nominal = number(&summary, "/fit/holdout/nominal_mm/mean");
    let fitted = number(&summary, "/fit/holdout/fitted_mm/mean");
    let floor = number(&summary, "/fit/noise_floor_mm");
    println!("held out {nominal:.3} -> {fitted:.4} mm, floor {floor:.4} mm");
    assert!((10.0..50.0).contains(&nominal), "{nominal} mm");
    assert!(fitted < 1.10 * floor, "{fitted} mm against a floor of {floor} mm");
    assert!(number(&summary, "/fit/holdout/n") >= 20.0);

    for name in [
        "run.mcap",
        "summary.json",
        "parameters.toml",
        "calibrated.toml",
        "dwells.parquet",
        "observations.parquet",
    ] {
        assert!(out.path().join(name).is_file(), "{name} is missing");
    }
}

/// The clocks were planted 38 to 60 ms apart, latency included, drifting by 25 ppm; the truth is in `truth.json`.
#[test]
fn clock_offsets_agree_with_the_truth_within_their_own_uncertainty() {
    let out = tempfile::tempdir().expect("temporary folder");
    let summary = run_pipeline(&root().join("pipelines/paper.toml"), out.path(), &[0]);
    let truth = crate::support::read_json(&root().join("fixtures/paper/truth.json"));
    for i in 0..3 {
        let at = |name: &str| format!("/recordings/{i}/{name}");
        let clock = |name: &str| number(&truth, &format!("/recordings/{i}/clock/{name}"));
        let since_start_s = (number(&summary, &at("clock_reference_ns")) - clock("reference_ns")) * 1e-9;
        let planted_ms = (clock("offset_s") + clock("drift") * since_start_s) * 1e3;
        let found_ms = number(&summary, &at("clock_offset_ms"));
        let sigma_ms = number(&summary, &at("clock_offset_sigma_ms"));
        println!("recording {i}: {found_ms:.3} ± {sigma_ms:.3} ms, planted {planted_ms:.3} ms");
        assert!((found_ms - planted_ms).abs() < 4.0 * sigma_ms.max(0.1), "recording {i}");
    }
}
