use crate::support::{number, real_recordings, root, run_pipeline};

/// Runs a shipped pipeline on real recordings; held-out mean, nominal and fitted [mm]. Exit code 3 is allowed: on
/// every one of these robots geometry is not adequate, and saying so is right.
fn holdout_mean_mm(pipeline: &str) -> Option<(f64, f64)> {
    real_recordings()?;
    let out = tempfile::tempdir().expect("temporary folder");
    let summary = run_pipeline(&root().join("pipelines").join(pipeline), out.path(), &[0, 3]);
    let nominal = number(&summary, "/fit/holdout/nominal_mm/mean");
    let fitted = number(&summary, "/fit/holdout/fitted_mm/mean");
    println!("{pipeline}: held out {nominal:.3} -> {fitted:.3} mm");
    Some((nominal, fitted))
}

/// The bars are what an independent numpy least squares reaches on the same recordings (datasets.md of the project's
/// notes); every fixture placement is left out in turn.
#[test]
fn panda_unit_1_without_a_camera() {
    let Some((nominal, fitted)) = holdout_mean_mm("mukca-panda.toml") else { return };
    assert!(fitted <= 0.80 && nominal > 5.0 * fitted, "{nominal} -> {fitted} mm");
}

#[test]
fn panda_unit_4_without_a_camera() {
    let Some((nominal, fitted)) = holdout_mean_mm("mukca-panda4.toml") else { return };
    assert!(fitted <= 0.25 && nominal > 5.0 * fitted, "{nominal} -> {fitted} mm");
}

#[test]
fn iiwa14_without_a_camera() {
    let Some((nominal, fitted)) = holdout_mean_mm("mukca-iiwa14.toml") else { return };
    assert!(fitted <= 0.26 && nominal > 2.0 * fitted, "{nominal} -> {fitted} mm");
}

#[test]
fn ur10_seen_by_a_laser_tracker() {
    let Some((nominal, fitted)) = holdout_mean_mm("ur10-tracker.toml") else { return };
    assert!(fitted <= 0.40 && nominal > 1.5 * fitted, "{nominal} -> {fitted} mm");
}

/// The truth files give the interval and the socket of every dwell; only this assertion reads them.
#[test]
fn every_dwell_of_the_sockets_is_found_and_in_the_right_one() {
    let Some(real) = real_recordings() else { return };
    for (pipeline, folder) in
        [("mukca-panda", "mukca_panda"), ("mukca-panda4", "mukca_panda4"), ("mukca-iiwa14", "mukca_iiwa14")]
    {
        let out = tempfile::tempdir().expect("temporary folder");
        let summary = run_pipeline(&root().join(format!("pipelines/{pipeline}.toml")), out.path(), &[0, 3]);
        for recording in summary["recordings"].as_array().expect("recordings") {
            let name = std::path::Path::new(recording["path"].as_str().expect("path"));
            let truth = real.join(folder).join(name.with_extension("truth.csv").file_name().expect("file"));
            let truth = std::fs::read_to_string(truth).expect("truth file");
            let labels: Vec<&str> = truth.lines().skip(1).filter_map(|l| l.split(',').nth(2)).collect();
            let dwells = recording["places"].as_array().expect("places");
            let cavities: Vec<&str> = dwells.iter().map(|p| p["cavity"].as_str().unwrap_or("-")).collect();
            assert_eq!(cavities, labels, "{pipeline} {}", name.display());
        }
    }
}

#[test]
fn all_1495_poses_of_the_ur10_are_found() {
    if real_recordings().is_none() {
        return;
    }
    let out = tempfile::tempdir().expect("temporary folder");
    let summary = run_pipeline(&root().join("pipelines/ur10-tracker.toml"), out.path(), &[0, 3]);
    assert_eq!(number(&summary, "/recordings/0/dwells"), 1495.0);
    assert_eq!(number(&summary, "/recordings/0/associated"), 1495.0);
}
