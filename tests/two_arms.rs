use crate::support::{armcal, files_made, root};
use armcal_core::{Against, DwellId, FeatureId, Observation, Reference};
use armcal_lab::pair::{PairConfig, PairTruth, simulate};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Command;

fn lab() -> PairConfig {
    let path = root().join("pipelines/lab/two-arms.toml");
    PairConfig::from_toml(&std::fs::read_to_string(&path).expect("lab file"), &path).expect("valid")
}

/// The shipped pipeline on another recording, with this `[closed_chain]`.
fn pipeline(folder: &Path, closed_chain: &str) -> std::path::PathBuf {
    let shipped = std::fs::read_to_string(root().join("pipelines/two-arms.toml")).expect("pipeline");
    let models = root().join("pipelines/models");
    let text = shipped
        .replace("../fixtures/two-arms/closed.mcap", "closed.mcap")
        .replace("models/", &format!("{}/", models.display()))
        .replace("kind = \"same-point\"", closed_chain);
    let path = folder.join("pipeline.toml");
    std::fs::write(&path, text).expect("writable");
    path
}

fn run(pipeline: &Path, out: &Path) -> (Value, BTreeMap<String, Vec<u8>>) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_armcal"));
    let files = files_made(command.arg("run").arg(pipeline), out);
    (serde_json::from_slice(&files["summary.json"]).expect("summary"), files)
}

/// Determined parameters of the arms within their intervals, and how many there are.
fn inside(summary: &Value, truth: &PairTruth) -> [usize; 2] {
    let truth: BTreeMap<&str, f64> =
        truth.arms.iter().flat_map(|a| &a.deviations).map(|d| (d.name.as_str(), d.value)).collect();
    let mut count = [0, 0];
    for p in summary["fit"]["parameters"].as_array().expect("parameters") {
        if let (Some(true), Some(truth)) =
            (p["determined"].as_bool(), truth.get(p["name"].as_str().unwrap_or("")))
        {
            let [from, to] = [0, 1].map(|k| p["ci95"][k].as_f64().expect("a number"));
            count = [count[0] + usize::from(from <= *truth && *truth <= to), count[1] + 1];
        }
    }
    count
}

#[test]
fn the_recording_of_two_arms_recovers_both_and_closes_dwells_it_never_saw() {
    let mut count = [0, 0];
    for (seed, length_mm) in [(21, None), (22, None), (23, None), (24, Some(180.0)), (25, Some(180.0))] {
        let folder = tempfile::tempdir().expect("a folder");
        let mut config = lab();
        (config.seed, config.joined.length_mm) = (seed, length_mm);
        let truth = simulate(&config, folder.path()).expect("simulated").facts;
        let chain = match length_mm {
            None => "kind = \"same-point\"",
            Some(_) => "kind = \"rigid-link\"\nlength_mm = 180.0",
        };
        let out = folder.path().join("out");
        let (summary, _) = run(&pipeline(folder.path(), chain), &out);
        let of = inside(&summary, &truth);
        count = [count[0] + of[0], count[1] + of[1]];

        // At home, before and after, the tips are apart: these two dwells are found out and told.
        let recording = &summary["recordings"][0];
        assert_eq!(recording["dwells"], 82, "seed {seed}");
        let open: Vec<i64> = recording["rejected"]
            .as_array()
            .expect("rejected dwells")
            .iter()
            .filter_map(|d| d["dwell"].as_i64())
            .collect();
        assert_eq!(open, [0, 81], "seed {seed}");

        let mm = |side: &str, which: &str| summary["fit"][side][which]["mean"].as_f64().expect("a mean");
        let floor = summary["fit"]["noise_floor_mm"].as_f64().expect("a floor");
        let (before, after) = (mm("holdout", "nominal_mm"), mm("holdout", "fitted_mm"));
        println!(
            "seed {seed}: {before:.2} -> {after:.3} mm, floor {floor:.3} mm; {} of {} inside",
            of[0], of[1]
        );
        assert_eq!(summary["fit"]["holdout"]["n"], 80);
        // Of m equations p are used up by the fit: an unseen error has m / (m - p) times the variance of the noise.
        let equations = if length_mm.is_some() { 64.0 } else { 3.0 * 64.0 };
        let used_up = summary["fit"]["rank"].as_f64().expect("a rank");
        let predicted = floor * (equations / (equations - used_up)).sqrt();
        assert!(
            after < 1.25 * predicted && before > 20.0 * floor,
            "seed {seed}: {before} {after} {predicted}"
        );
        let scale_is_open = summary["fit"]["undetermined"].to_string().contains("scale (every length");
        assert_eq!(scale_is_open, length_mm.is_none(), "seed {seed}");
    }
    assert!(
        count[1] > 40 && count[0] as f64 >= 0.88 * count[1] as f64,
        "{} of {} inside",
        count[0],
        count[1]
    );
}

#[test]
fn the_shipped_recording_is_what_its_seed_gives_and_each_arm_gets_its_table_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let made = simulate(&lab(), folder.path()).expect("simulated");
    let shipped = root().join("fixtures/two-arms");
    let bytes = |path: &Path| std::fs::read(path).expect("readable");
    assert!(bytes(&made.recordings[0]) == bytes(&shipped.join("closed.mcap")), "closed.mcap has changed");
    assert!(bytes(&made.truth) == bytes(&shipped.join("truth.json")), "truth.json has changed");

    let path = root().join("pipelines/two-arms.toml");
    let (summary, files) = run(&path, &folder.path().join("out"));
    let names: Vec<&str> = files.keys().map(String::as_str).collect();
    // As of one arm, with a model file an arm.
    let expected = [
        "dwells.parquet",
        "foxglove-layout-legacy.json",
        "foxglove-layout.json",
        "left.toml",
        "model.json",
        "observations.json",
        "observations.parquet",
        "parameters.parquet",
        "parameters.toml",
        "report.html",
        "right.toml",
        "run.mcap",
        "summary.json",
        "view.toml",
    ];
    assert_eq!(names, expected);
    assert_eq!(summary["arms"], serde_json::json!(["right", "left"]));
    assert_eq!(summary["closure"], "same point");
    assert_eq!(run(&path, &folder.path().join("again")).1, files, "the same input gives the same bytes");
    for arm in ["right", "left"] {
        let text = String::from_utf8(files[&format!("{arm}.toml")].clone()).expect("text");
        let chain = armcal_model::Chain::from_dh_toml(&text, Path::new(arm)).expect("a DH table");
        for p in chain.parameters() {
            let name = format!("{arm}.{}", p.name);
            let all = summary["fit"]["parameters"].as_array().expect("parameters");
            let value = all.iter().find(|v| v["name"] == name.as_str()).expect("there")["value"].as_f64();
            assert!((p.nominal - value.expect("a number")).abs() < 1e-12, "{name}");
        }
    }
}

#[test]
fn what_two_arms_cannot_show_is_told_in_words() {
    let folder = tempfile::tempdir().expect("a folder");
    let says = |change: &dyn Fn(&mut PairConfig), closed_chain: &str| {
        let mut config = lab();
        change(&mut config);
        simulate(&config, folder.path()).expect("simulated");
        let out = folder.path().join("out");
        let output = armcal([
            "run".as_ref(),
            pipeline(folder.path(), closed_chain).as_os_str(),
            "--out".as_ref(),
            out.as_os_str(),
        ]);
        assert_eq!(output.status.code(), Some(1));
        assert!(!out.exists(), "no half results");
        String::from_utf8(output.stderr).expect("text")
    };
    let same = "kind = \"same-point\"";
    let few = says(&|c| c.task.poses = 2, same);
    assert!(few.contains("different poses; 6 are the least"), "{few}");
    let still = says(&|c| c.task.region_m = [[0.4, 0.4], [0.25, 0.25], [0.3, 0.3]], same);
    assert!(still.contains("in 2 different poses"), "{still}");
    let lengthless = says(&|c| c.task.poses = 4, "kind = \"rigid-link\"");
    assert!(lengthless.contains("length_mm") && lengthless.contains("is missing"), "{lengthless}");

    let path = pipeline(folder.path(), same);
    let text = std::fs::read_to_string(&path).expect("pipeline");
    let text = text.replace("\"cavity-folds\"", "\"every-nth-cavity\"").replace("k = 5", "n = 4\noffset = 0");
    std::fs::write(&path, text).expect("writable");
    let cavity = String::from_utf8(armcal(["run".as_ref(), path.as_os_str()]).stderr).expect("text");
    assert!(cavity.contains("holdout.kind") && cavity.contains("none in common"), "{cavity}");
}

#[test]
fn the_input_of_two_arms_can_stay_where_it_is() {
    let folder = tempfile::tempdir().expect("a folder");
    simulate(&lab(), folder.path()).expect("simulated");
    let topics = |bytes: &[u8]| -> BTreeSet<String> {
        let messages = mcap::MessageStream::new(bytes).expect("an MCAP");
        messages.map(|m| m.expect("a message").channel.topic.clone()).collect()
    };
    let path = pipeline(folder.path(), "kind = \"same-point\"");
    let (_, copied) = run(&path, &folder.path().join("copied"));
    let text = std::fs::read_to_string(&path).expect("pipeline") + "\n[output]\ninput = \"reference\"\n";
    std::fs::write(&path, text).expect("writable");
    let (_, referred) = run(&path, &folder.path().join("referred"));
    assert_eq!(copied["summary.json"], referred["summary.json"]);
    let own: BTreeSet<String> = ["/left/joint_states", "/right/joint_states"].map(str::to_owned).into();
    let [all, results] = [&copied, &referred].map(|files| topics(&files["run.mcap"]));
    assert!(own.is_subset(&all) && results.iter().all(|topic| topic.starts_with("/armcal/")), "{results:?}");
    assert_eq!(&results | &own, all);
}

/// The lab's pair with play in the drive of one joint, by its number through both arms; width [deg].
fn hiding(seed: u64, joint: usize, width_deg: f64) -> PairConfig {
    let mut config = lab();
    config.seed = seed;
    let gap = serde_json::json!({ "kind": "gap", "joint": joint % 3 + 1, "width_deg": width_deg });
    config.arms[joint / 3].mechanisms.push(serde_json::from_value(gap).expect("a mechanism"));
    config
}

/// What the diagnosis says of a recording of the pair. What is hidden it does not see.
fn diagnosed(config: &PairConfig) -> Value {
    let folder = tempfile::tempdir().expect("a folder");
    simulate(config, folder.path()).expect("simulated");
    let path = pipeline(folder.path(), "kind = \"same-point\"");
    let output = armcal(["diagnose".as_ref(), path.as_os_str(), "--json".as_ref()]);
    let said = serde_json::from_slice::<Value>(&output.stdout);
    said.unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&output.stderr)))
}

/// Whether the answer holds play of this joint (index from 0), and nothing but a play of it.
fn is_named(said: &Value, joint: usize) -> bool {
    let names = said["names"].as_array().expect("names");
    let kind = |name: &Value| name.as_str().unwrap_or_default().split([',', '@']).next().map(str::to_owned);
    let kinds: Vec<Option<String>> = names.iter().map(kind).collect();
    let of = |what: &str| Some(format!("{what}:{}", joint + 1));
    kinds.contains(&of("backlash"))
        && kinds.iter().all(|kind| *kind == of("backlash") || *kind == of("gravity_backlash"))
}

/// Widths and seeds are not those that anything was chosen by.
#[test]
fn play_hidden_in_either_arm_has_its_joint_and_nothing_hidden_has_no_name() {
    let mut missed = Vec::new();
    for (joint, width_deg) in [(0, 0.5), (2, 0.7), (4, 0.35), (5, 0.5)] {
        let said = diagnosed(&hiding(7_100 + joint as u64, joint, width_deg));
        println!("play of {width_deg} deg in joint {}: {} {}", joint + 1, said["verdict"], said["names"]);
        missed.extend((!is_named(&said, joint)).then_some(joint + 1));
    }
    assert!(missed.len() <= 1, "no name or a wrong one: joints {missed:?}");
    for seed in 7_200..7_202 {
        let said = diagnosed(&PairConfig { seed, ..lab() });
        assert_eq!(said["verdict"], "nothing_missing", "seed {seed}: {}", said["names"]);
    }
}

#[test]
#[ignore = "minutes: cargo test --release --workspace --all-features --test integration fifty_pairs -- --ignored --nocapture"]
fn fifty_pairs_with_play_in_either_arm_and_twenty_without_any() {
    let width_deg = |seed: u64| 0.2 + 0.6 * ((seed * 37) % 100) as f64 / 100.0;
    let of = |seed: u64| (seed % 6) as usize;
    let missed: Vec<u64> =
        (8_000..8_050).filter(|&s| !is_named(&diagnosed(&hiding(s, of(s), width_deg(s))), of(s))).collect();
    let claimed: Vec<u64> = (8_100..8_120)
        .filter(|&seed| diagnosed(&PairConfig { seed, ..lab() })["verdict"] != "nothing_missing")
        .collect();
    println!(
        "named in {} of 50, not with seeds {missed:?}; claimed without reason with seeds {claimed:?}",
        50 - missed.len()
    );
    assert!(missed.len() <= 2, "{missed:?}");
    assert!(claimed.len() <= 1, "{claimed:?}");
}

#[test]
fn what_is_missing_of_two_arms_is_added_and_the_error_falls_to_the_floor() {
    let folder = tempfile::tempdir().expect("a folder");
    simulate(&hiding(7_300, 4, 0.6), folder.path()).expect("simulated");
    let path = pipeline(folder.path(), "kind = \"same-point\"");
    let out = folder.path().join("out");
    let output =
        armcal(["add".as_ref(), "suggested".as_ref(), path.as_os_str(), "--out".as_ref(), out.as_os_str()]);
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    let summary: Value =
        serde_json::from_slice(&std::fs::read(out.join("summary.json")).expect("a summary")).expect("JSON");
    let effects = summary["fit"]["effects"].to_string();
    assert!(effects.contains("backlash:5"), "{effects}");
    let mm = |value: &Value| value.as_f64().expect("a number");
    let (left, floor) =
        (mm(&summary["fit"]["holdout"]["fitted_mm"]["mean"]), mm(&summary["fit"]["noise_floor_mm"]));
    assert!(left < 1.5 * floor, "{left} {floor}");
    let page = std::fs::read_to_string(out.join("report.html")).expect("a page");
    assert!(page.contains("their tips in one point"), "the page says what was calibrated");

    // Where a hand leaves a joint within its play, the plain effect leaves more of it than what was suggested, which is told.
    // The same model predicts again from what was left of it, and another command holds it to a limit.
    let past = armcal_result::open_model(&out).expect("model.json").arms().expect("the arms");
    assert_eq!(past.model.chain().arms().len(), 2);
    let text = std::fs::read_to_string(&path).expect("pipeline")
        + "\n[[effects]]\nkind = \"backlash\"\ntarget = \"left.joint2\"\n\n[check]\nmax_over_floor = 4.0\n";
    std::fs::write(&path, text).expect("writable");
    let checked = armcal(["check".as_ref(), path.as_os_str()]);
    let told = String::from_utf8_lossy(&checked.stdout);
    assert!(told.contains("holds") && !told.contains("BROKEN"), "{told}");
    // The effect that is told to be of an arm is that of all under its number.
    let own = std::fs::read_to_string(&path)
        .expect("pipeline")
        .replace("\n[[effects]]\nkind = \"backlash\"\ntarget = \"left.joint2\"\n", "");
    let own = own.replace(
        "base = { pose = \"estimated\" }",
        "effects = [{ kind = \"backlash\", target = 2 }]\nbase = { pose = \"estimated\" }",
    );
    std::fs::write(&path, own).expect("writable");
    let checked = armcal(["check".as_ref(), path.as_os_str()]);
    let told = String::from_utf8_lossy(&checked.stdout);
    assert!(told.contains("holds") && !told.contains("BROKEN"), "{told}");
}

#[test]
fn what_to_record_next_brings_the_tips_together() {
    let shipped = root().join("pipelines/two-arms.toml");
    let effects = "eccentricity:5,compliance:5";
    let output = armcal([
        "plan".as_ref(),
        shipped.as_os_str(),
        "--effects".as_ref(),
        effects.as_ref(),
        "--json".as_ref(),
    ]);
    let said: Value = serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&output.stderr)));
    let dwells = said["dwells"].as_array().expect("dwells");
    assert!(!dwells.is_empty(), "{said}");
    // By the calibrated arms of another run of the same recording.
    let folder = tempfile::tempdir().expect("a folder");
    run(&shipped, &folder.path().join("out"));
    let past = armcal_result::open_model(&folder.path().join("out")).expect("model.json");
    let arms = past.arms().expect("the arms");
    for dwell in dwells {
        assert_eq!(dwell["where"], "joined", "{dwell}");
        let joint_deg = dwell["joint_deg"].as_array().expect("readings");
        let joint_rad: Vec<f64> = joint_deg.iter().filter_map(Value::as_f64).map(f64::to_radians).collect();
        let joined = Reference::Joined { to: Against::Feature(FeatureId(1)) };
        let at = Observation::bare(DwellId { recording: 0, dwell: 0 }, joint_rad, joined);
        let open_m = arms.model.residual(&arms.values, &at).position_m.norm();
        assert!(open_m < 0.1e-3, "{open_m} m apart in {dwell}");
    }
}
