use crate::support::{number, real_recordings, root, run_as_shipped, run_pipeline, shipped};
use armcal_core::Severity;
use armcal_recording::{Recording, is_recording};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// A shipped pipeline on real recordings: the folder of these, and the summary. On every one of these robots geometry is not
/// adequate, and saying so is right.
fn run(pipeline: &str) -> Option<(PathBuf, Value)> {
    let real = real_recordings()?;
    let summary = run_as_shipped(pipeline);
    let [nominal, fitted] = held_out_mm(&summary);
    println!("{pipeline}: held out {nominal:.3} -> {fitted:.3} mm");
    Some((real, summary))
}

/// Mean error on held-out points, nominal and fitted.
fn held_out_mm(summary: &Value) -> [f64; 2] {
    ["nominal", "fitted"].map(|side| number(summary, &format!("/fit/holdout/{side}_mm/mean")))
}

/// Every dwell is found, and in the right socket. The truth files give interval and socket of each; only this
/// assertion reads them.
fn assert_every_dwell(summary: &Value, truth: &Path) {
    for recording in summary["recordings"].as_array().expect("recordings") {
        let name = Path::new(recording["path"].as_str().expect("path"));
        let truth = truth.join(name.with_extension("truth.csv").file_name().expect("file"));
        let truth = std::fs::read_to_string(truth).expect("truth file");
        let labels: Vec<&str> = truth.lines().skip(1).filter_map(|l| l.split(',').nth(2)).collect();
        let dwells = recording["places"].as_array().expect("places");
        let cavities: Vec<&str> = dwells.iter().map(|p| p["cavity"].as_str().unwrap_or("-")).collect();
        assert_eq!(cavities, labels, "{}", name.display());
    }
}

/// The bars are what an independent numpy least squares reaches on the same recordings (datasets.md of the project's
/// notes); every fixture placement is left out in turn.
#[test]
fn panda_unit_1_without_a_camera() {
    let Some((real, summary)) = run("mukca-panda.toml") else { return };
    let [nominal, fitted] = held_out_mm(&summary);
    assert!(fitted <= 0.80 && nominal > 5.0 * fitted, "{nominal} -> {fitted} mm");
    assert_sound(&summary);
    assert_every_dwell(&summary, &real.join("mukca_panda"));
}

/// The shipped fixture. An independent numpy least squares reaches 3.90 -> 0.255 mm rms about the socket's mean with one
/// placement left out; armcal, which also has the 50 mm between the sockets to keep, may be a tenth off either.
#[test]
fn panda_unit_4_from_the_fixtures_without_a_camera() {
    let summary = run_as_shipped("mukca-panda4.toml");
    let rms = |side: &str| number(&summary, &format!("/fit/holdout/{side}_mm/rms"));
    println!("mukca-panda4.toml: held out {:.3} -> {:.3} mm rms", rms("nominal"), rms("fitted"));
    assert!((rms("nominal") / 3.90 - 1.0).abs() < 0.1, "{} mm rms", rms("nominal"));
    assert!(rms("fitted") < 1.1 * 0.255, "{} mm rms", rms("fitted"));
    // No model without effects can be better on all of these dwells than the 0.21 mm of the fit to them.
    assert!(rms("fitted") > 0.21, "{} mm rms", rms("fitted"));
    assert_eq!(number(&summary, "/fit/holdout/n"), 207.0);
    let [nominal, fitted] = held_out_mm(&summary);
    assert!(fitted <= 0.25 && nominal > 5.0 * fitted, "{nominal} -> {fitted} mm");
    assert_sound(&summary);
    // What effects claim on the held-out placements, chosen with them, and what they are worth there, chosen without.
    let nested = &summary["diagnosis"]["nested"];
    let [geometry, worth, claimed] =
        ["/held_out/before", "/held_out/after", "/chosen_on_all_mm"].map(|at| number(nested, at));
    println!(
        "mukca-panda4.toml: chosen with {geometry:.3} -> {claimed:.3}, without {geometry:.3} -> {worth:.3} mm"
    );
    assert!((geometry - fitted).abs() < 1e-6, "one quantity, one value: {geometry} and {fitted} mm");
    assert!(claimed < worth && worth < 1.02 * geometry, "{nested}");
    assert_every_dwell(&summary, &root().join("fixtures/mukca-panda4"));
}

/// Whoever recorded these robots made no mistake that anyone knows of.
fn assert_sound(summary: &Value) {
    let findings = summary.pointer("/setup/findings").and_then(Value::as_array).expect("setup findings");
    let mistakes: Vec<&Value> = findings.iter().filter(|f| f["certainty"] == "mistake").collect();
    assert!(mistakes.is_empty(), "{mistakes:?}");
}

/// A shipped pipeline without what it declares of the arm's deviations, beside its files.
fn without_priors(pipeline: &str, folder: &Path) -> PathBuf {
    let text = shipped(pipeline);
    let from = text.find("[model.deviation]").expect("a declared deviation");
    let to = text.find("[frames.tip]").expect("a tip");
    let own = folder.join(pipeline);
    let (before, behind) = (&text[..from], &text[to..]);
    std::fs::write(&own, format!("{before}{behind}")).expect("pipeline");
    own
}

/// With default priors the scales of this arm are learnt, and with the effects that are chosen without the placement left out
/// it errs there no more than geometry with the preset somebody chose by hand, which the pipeline ships with (0.231 and 0.228 mm);
/// the panda, of which two of three placements name events that say nothing of the third, no more than by 2 % than geometry with what
/// was learnt. `docs/real-robots.md` has the numbers.
#[test]
fn what_is_not_declared_of_an_arm_is_learnt_from_its_recordings() {
    let limits = [
        ("mukca-panda4.toml", 0.235, 0.231),
        ("mukca-panda.toml", 0.84, 1.02 * 0.827),
        ("mukca-iiwa14.toml", 0.228, 0.228),
    ];
    for (pipeline, limit_mm, by_hand_mm) in limits {
        if pipeline != "mukca-panda4.toml" && real_recordings().is_none() {
            continue;
        }
        let out = tempfile::tempdir().expect("temporary folder");
        let summary = run_pipeline(&without_priors(pipeline, out.path()), &out.path().join("out"), &[0, 3]);
        let [_, fitted_mm] = held_out_mm(&summary);
        assert!(fitted_mm < limit_mm, "{pipeline}: {fitted_mm}");
        let chosen_mm = summary.pointer("/diagnosis/nested/held_out/after").and_then(Value::as_f64);
        let after_mm = chosen_mm.unwrap_or(fitted_mm);
        println!("{pipeline}: {fitted_mm:.3} mm, {after_mm:.3} mm with what is chosen without the points");
        assert!(after_mm < by_hand_mm + 5e-4, "{pipeline}: {after_mm}");
        let warnings = summary["warnings"].as_array().expect("warnings");
        let said = warnings.iter().find(|w| w["code"] == "priors-learnt").expect("what was learnt");
        assert!(said["message"].as_str().is_some_and(|m| m.contains("lengths 0.")), "{said}");
        assert_sound(&summary);
    }
}

#[test]
fn iiwa14_without_a_camera() {
    let Some((real, summary)) = run("mukca-iiwa14.toml") else { return };
    assert_sound(&summary);
    let [nominal, fitted] = held_out_mm(&summary);
    assert!(fitted <= 0.26 && nominal > 2.0 * fitted, "{nominal} -> {fitted} mm");
    assert_every_dwell(&summary, &real.join("mukca_iiwa14"));
}

/// Plastic gears whose backlash nobody can find in it, because the replay does not carry directions of arrival: an
/// independent least squares leaves 3.1 mm on placements left out, no static term a joint helps there, and the first dwells of `front`
/// lie about 9 mm off (datasets.md of the project's notes). The event that ends these is what is named first, and what remains is told.
#[test]
fn gen3lite_without_a_camera_shows_the_dwells_that_lie_off_and_stays_inadequate() {
    let Some((real, summary)) = run("mukca-gen3lite.toml") else { return };
    assert_sound(&summary);
    let [nominal, fitted] = held_out_mm(&summary);
    assert!(fitted <= 3.5 && nominal > 1.5 * fitted, "{nominal} -> {fitted} mm");
    let after = number(&summary, "/diagnosis/holdout_mm/after");
    let first = summary.pointer("/diagnosis/effects/0/set").and_then(Value::as_array).cloned();
    println!("mukca-gen3lite.toml: {first:?}, {fitted:.3} -> {after:.3} mm");
    let ends = |name: &Value| name.as_str().is_some_and(|n| n.contains("@0.7") || n.contains("@0.1-6"));
    assert!(first.is_some_and(|set| set.iter().all(ends)), "{}", summary["diagnosis"]["verdict"]);
    assert!(after < 0.95 * fitted, "{fitted} -> {after} mm");
    let warnings = summary["warnings"].as_array().expect("warnings");
    assert!(warnings.iter().any(|w| w["severity"] == "inadequate"), "{warnings:?}");
    assert_every_dwell(&summary, &real.join("mukca_gen3lite"));
}

/// Without the diagnosis of 1,495 poses, which takes minutes without optimisation.
#[test]
fn ur10_seen_by_a_laser_tracker() {
    if real_recordings().is_none() {
        return;
    }
    let text = shipped("ur10-tracker.toml");
    let out = tempfile::tempdir().expect("temporary folder");
    let own = out.path().join("ur10.toml");
    std::fs::write(&own, format!("{text}\n[diagnosis]\nenabled = false\n")).expect("pipeline");
    let summary = run_pipeline(&own, out.path(), &[0, 3]);
    let [nominal, fitted] = held_out_mm(&summary);
    assert!(fitted <= 0.40 && nominal > 1.5 * fitted, "{nominal} -> {fitted} mm");
    assert_eq!(number(&summary, "/recordings/0/dwells"), 1495.0);
    assert_eq!(number(&summary, "/recordings/0/associated"), 1495.0);
}

/// What the diagnosis proposes for the UR10, from either of its two sessions (docs/real-robots.md): a curve of 60 harmonics
/// for each of five joints, each of the size that was found, and beside them the compliance of the arm.
#[test]
fn the_curves_that_are_proposed_for_the_ur10_predict_poses_they_never_saw() {
    if real_recordings().is_none() {
        return;
    }
    let typical_rad = [
        ("ur10-tracker.toml", [0.00027, 0.00024, 0.00027, 0.00041, 0.0003]),
        ("ur10-tracker-a.toml", [0.00018, 0.00027, 0.00026, 0.00032, 0.00038]),
    ];
    for (name, typical_rad) in typical_rad {
        let out = tempfile::tempdir().expect("temporary folder");
        let mut text = shipped(name).replace("k = 10", "k = 4");
        text += "\n[diagnosis]\nenabled = false\n";
        for (joint, typical) in (1..=5).zip(typical_rad) {
            text += &format!(
                "\n[[effects]]\nkind = \"error_curve\"\ntarget = {joint}\nharmonics = 60\ntypical = {typical}\n"
            );
        }
        text += "\n[[effects]]\nkind = \"arm_compliance\"\n";
        let own = out.path().join("ur10.toml");
        std::fs::write(&own, text).expect("pipeline");
        let [_, fitted] = held_out_mm(&run_pipeline(&own, out.path(), &[0, 3]));
        println!("{name} with five curves and compliance: held out {fitted:.3} mm");
        assert!(fitted <= 0.100, "{name}: {fitted} mm");
    }
}

/// What says what was written agrees with what is read, in every recording there is of which nothing was lost.
#[test]
fn no_sound_recording_is_reported_as_damaged() {
    let Some(real) = real_recordings() else { return };
    let mut folders = vec![real, root().join("fixtures")];
    let mut recordings = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if is_recording(&path) {
                recordings.push(path);
            }
        }
    }
    assert!(recordings.len() >= 20, "{recordings:?}");
    for path in recordings {
        let recording = Recording::open(std::slice::from_ref(&path)).expect("a recording");
        let report = recording.report();
        let lost: Vec<_> = report.warnings.iter().filter(|w| w.severity >= Severity::DataLost).collect();
        assert_eq!(lost, Vec::<&armcal_core::Warning>::new(), "{}", path.display());
        assert!(report.channels.iter().any(|channel| channel.messages > 0), "{}", path.display());
    }
}
