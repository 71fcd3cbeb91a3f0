use crate::support::{self, armcal, in_one_line, number, read_json, root, run_pipeline, shipped};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Output;

/// Name, declared roll and pitch [deg] of the table on six days.
const DAYS: [(&str, f64, f64); 6] = [
    ("monday", 0.0, 0.0),
    ("tuesday", 11.7, 0.0),
    ("wednesday", 0.0, 11.8),
    ("thursday", 6.0, 9.0),
    ("friday", 16.0, 4.0),
    ("saturday", 3.0, 15.0),
];

/// Six recordings of one arm on six days, each run alone, pooled, and all of them in one dense run.
struct Week {
    folder: tempfile::TempDir,
    pooled: Value,
    dense: Value,
    alone: Vec<Value>,
}

fn write(path: &Path, text: &str) {
    std::fs::write(path, text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
}

/// Simulates the days with the paper's small rig into `folder`.
fn simulate(folder: &Path, days: &[(&str, f64, f64)]) {
    let lab = shipped("lab/paper-small.toml");
    let (rig, _) = lab.split_once("[[recordings]]").expect("recordings of the lab");
    let mut text = rig.replace("interval_s = 900.0", "interval_s = 86400.0");
    for (name, roll_deg, pitch_deg) in days {
        text += &format!(
            "[[recordings]]\nname = \"{name}\"\nroll_deg = {roll_deg:?}\npitch_deg = {pitch_deg:?}\n\n"
        );
    }
    let path = folder.join("lab.toml");
    write(&path, &text);
    support::simulate(&path, folder, &[]);
}

/// A shipped pipeline on some of the days, without diagnosis; `more` is appended.
fn pipeline(name: &str, folder: &Path, days: &[(&str, f64, f64)], more: &str) -> String {
    let text = shipped(name);
    let (_, behind) = text.split_once("[streams.joints]").expect("streams");
    let (sections, _) = behind.split_once("[check]").unwrap_or((behind, ""));
    let mut own = String::from("name = \"week\"\n");
    for (name, roll_deg, pitch_deg) in days {
        let path = folder.join(format!("{name}.mcap"));
        own += &format!(
            "[[recordings]]\npaths = [{path:?}]\ntilt = {{ roll_deg = {roll_deg:?}, pitch_deg = {pitch_deg:?} }}\n"
        );
    }
    format!(
        "{own}\n[streams.joints]{sections}\n[diagnosis]\nenabled = false\n[output]\ninput = \"reference\"\n{more}"
    )
}

/// Runs every day alone into `results/<day>` and returns their summaries.
fn run_alone(shipped: &str, folder: &Path, days: &[(&str, f64, f64)]) -> Vec<Value> {
    let run = |day: &(&str, f64, f64)| {
        let path = folder.join(format!("{}.toml", day.0));
        write(&path, &pipeline(shipped, folder, &[*day], ""));
        run_pipeline(&path, &folder.join("results").join(day.0), &[0, 3])
    };
    days.iter().map(run).collect()
}

fn pool(pipeline: &Path, results: &[PathBuf], out: &Path) -> Output {
    let mut args = vec!["pool".into(), pipeline.as_os_str().to_owned()];
    args.extend(results.iter().map(|path| path.as_os_str().to_owned()));
    args.extend(["--out".into(), out.as_os_str().to_owned()]);
    armcal(args)
}

fn said(output: &Output) -> String {
    in_one_line(&String::from_utf8_lossy(&output.stderr))
}

fn week() -> Week {
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path();
    simulate(path, &DAYS);
    let alone = run_alone("paper-camera-free.toml", path, &DAYS);
    let together = path.join("week.toml");
    write(&together, &pipeline("paper-camera-free.toml", path, &DAYS, ""));
    let dense = run_pipeline(&together, &path.join("dense"), &[0, 3]);
    // Which recordings these were, the results know.
    let settings = path.join("settings.toml");
    write(&settings, &pipeline("paper-camera-free.toml", path, &[], ""));
    let output = pool(&settings, &[path.join("results")], &path.join("pool"));
    assert!(matches!(output.status.code(), Some(0 | 3)), "{}", said(&output));
    println!("{}", String::from_utf8_lossy(&output.stdout));
    let pooled = read_json(&path.join("pool/pool.json"));
    Week { folder, pooled, dense, alone }
}

fn parameters<'a>(summary: &'a Value, pointer: &str) -> Vec<&'a Value> {
    summary.pointer(pointer).and_then(Value::as_array).expect("parameters").iter().collect()
}

fn named<'a>(parameters: &[&'a Value], name: &Value) -> &'a Value {
    parameters.iter().find(|p| p["name"] == *name).unwrap_or_else(|| panic!("no parameter {name}"))
}

#[test]
fn results_of_six_days_are_pooled_into_what_one_fit_of_their_recordings_gives() {
    let week = week();
    let shared = parameters(&week.pooled, "/fit/parameters");
    let dense = parameters(&week.dense, "/fit/parameters");
    assert_eq!(number(&week.pooled, "/fit/train/n"), number(&week.dense, "/fit/train/n"));

    // The dense run associated anew from where its own fit put the boards: a start, and the centre of a ridge of 0.5 m.
    let mut worst: (f64, f64) = (0.0, 0.0);
    for p in shared.iter().filter(|p| p["free"] == true) {
        let q = named(&dense, &p["name"]);
        let sigma = number(q, "/sigma");
        worst.0 = worst.0.max((number(p, "/value") - number(q, "/value")).abs() / sigma);
        worst.1 = worst.1.max((number(p, "/sigma") / sigma - 1.0).abs());
    }
    println!("pool and dense run: values {:.1e} sigma apart, sigmas {:.1e}", worst.0, worst.1);
    assert!(worst.0 < 1e-3 && worst.1 < 1e-3);

    let truth = read_json(&week.folder.path().join("truth.json"));
    let (mut inside, mut determined) = (0, 0);
    for planted in truth["deviations"].as_array().expect("deviations") {
        let found = named(&shared, &planted["name"]);
        if found["determined"] == true {
            let value = number(planted, "/value");
            determined += 1;
            inside += usize::from(number(found, "/ci95/0") <= value && value <= number(found, "/ci95/1"));
            for (alone, (day, ..)) in week.alone.iter().zip(DAYS) {
                let alone = named(&parameters(alone, "/fit/parameters"), &planted["name"]);
                let ratio = number(found, "/sigma") / number(alone, "/sigma");
                assert!(ratio < 1.0, "{} is no narrower than on {day}: {ratio}", planted["name"]);
            }
        }
    }
    println!("{inside} of {determined} planted parameters inside their 95 % intervals");
    assert!(inside + 1 >= determined);
    let known_alone = |alone: &Value| {
        let planted = truth["deviations"].as_array().expect("deviations").iter();
        let all = parameters(alone, "/fit/parameters");
        planted.filter(|planted| named(&all, &planted["name"])["determined"] == true).count()
    };
    let most = week.alone.iter().map(known_alone).max().expect("days");
    println!("determined: {determined} in the pool, at most {most} on one day");
    assert!(determined >= most && determined > 0);

    let unseen_mm = number(&week.pooled, "/transfer/unseen/fitted_mm/mean");
    let floor_mm = number(&week.pooled, "/transfer/noise_floor_mm");
    println!("as a new day: {unseen_mm:.3} mm, declared noise {floor_mm:.3} mm");
    assert!(unseen_mm < 1.3 * floor_mm);
    for (recording, (day, ..)) in week.pooled["recordings"].as_array().expect("recordings").iter().zip(DAYS) {
        assert_eq!(recording["name"], day);
        assert_eq!(recording["parameters"].as_array().map(Vec::len), Some(6));
    }
    refused(week.folder.path());
}

/// Other boards, arms and settings and empty folders are named; a recording in two results counts once.
fn refused(path: &Path) {
    let (week, results, out) = (path.join("week.toml"), path.join("results"), path.join("refused"));
    let text = std::fs::read_to_string(&week).expect("pipeline");
    let refusal = |pipeline: &Path, results: &[PathBuf]| {
        let output = pool(pipeline, results, &out);
        assert_eq!(output.status.code(), Some(1), "{}", said(&output));
        assert!(!out.exists(), "something was written");
        said(&output)
    };
    let only = [results.clone()];
    let empty = path.join("empty");
    std::fs::create_dir(&empty).expect("folder");
    let message = refusal(&week, &[results.clone(), empty]);
    assert!(message.contains("empty holds no observations.json"), "{message}");

    let copy = path.join("copy");
    std::fs::create_dir(&copy).expect("folder");
    std::fs::copy(results.join("friday/observations.json"), copy.join("observations.json")).expect("copy");
    let once = path.join("once");
    let output = pool(&week, &[results.clone(), copy.clone()], &once);
    assert!(matches!(output.status.code(), Some(0 | 3)), "{}", said(&output));
    let once = read_json(&once.join("pool.json"));
    let twice = once["warnings"].as_array().and_then(|all| all.iter().find(|w| w["code"] == "counted-once"));
    assert_eq!(twice.expect("a warning")["subject"], "friday");
    assert_eq!(once["recordings"].as_array().map(Vec::len), Some(DAYS.len()));

    std::fs::write(copy.join("observations.json"), "{\"schema\": \"armcal.observations/9\"}").expect("file");
    let message = refusal(&week, &[copy]);
    assert!(
        message.contains("copy/observations.json") && message.contains("run the pipeline again"),
        "{message}"
    );

    let board = std::fs::read_to_string(root().join("pipelines/boards/paper.toml")).expect("board");
    let other = path.join("other-board.toml");
    write(&other, &board.replacen("seat_sigma_mm = ", "seat_sigma_mm = 1", 1));
    let shipped = format!("{}/pipelines/boards/paper.toml", root().display());
    let contradicting = path.join("contradicting.toml");
    write(&contradicting, &text.replace(&shipped, &other.display().to_string()));
    let message = refusal(&contradicting, &only);
    assert!(message.contains("friday") && message.contains("seat_sigma_mm"), "{message}");

    write(&contradicting, &format!("{text}[observations]\ntracked = false\n"));
    let message = refusal(&contradicting, &only);
    assert!(message.contains("[observations] were"), "{message}");

    let left = format!("{}/pipelines/models/left_arm.toml", root().display());
    let right = format!("{}/pipelines/models/right_arm.toml", root().display());
    write(&contradicting, &text.replace(&right, &left));
    let message = refusal(&contradicting, &only);
    assert!(message.contains("another nominal arm"), "{message}");

    write(&contradicting, &format!("{text}[pool]\nper_recording = [\"joint2.tehta\"]\n"));
    let message = refusal(&contradicting, &only);
    assert!(message.contains("joint2.theta"), "{message}");
}

/// Page, summary, channels, layouts and where `armcal view` finds what was pooled, and no second copy of observations.
fn leaves_what_a_run_leaves(out: &Path, pooled: &Value) {
    let summary = read_json(&out.join("summary.json"));
    assert_eq!(summary["schema"], "armcal.summary/1");
    for same in ["/conclusion", "/status", "/answer", "/fit/holdout", "/fit/rank"] {
        assert_eq!(summary.pointer(same), pooled.pointer(same), "{same}");
    }
    for file in ["run.mcap", "report.html", "foxglove-layout.json", "calibrated.toml", "observations.parquet"]
    {
        assert!(out.join(file).is_file(), "{file}");
    }
    assert!(!out.join("observations.json").exists(), "it would be pooled with what it was made of");
    let (seen, of) = (summary["recordings"].as_array(), pooled["recordings"].as_array());
    for (seen, of) in seen.expect("recordings").iter().zip(of.expect("recordings")) {
        assert_eq!(
            (&seen["name"], &seen["dwells"], &seen["files"]),
            (&of["name"], &of["dwells"], &of["files"])
        );
        assert!(seen["clock_offset_ms"].is_null(), "what is not known is not zero");
    }
    let view = std::fs::read_to_string(out.join("view.toml")).expect("view.toml");
    assert!(view.contains("results = [\"../results\"]"), "{view}");
}

/// The camera was set up anew every day: each recording has a base of its own, whatever the threads.
#[test]
fn every_day_may_have_a_base_of_its_own() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path();
    simulate(path, &DAYS[..3]);
    run_alone("paper.toml", path, &DAYS[..3]);
    let week = path.join("week.toml");
    write(&week, &pipeline("paper.toml", path, &DAYS[..3], "[pool]\nper_recording = [\"base.*\"]\n"));
    let with = |threads: &str| {
        let out = path.join(format!("pool-{threads}"));
        let output = std::process::Command::new(env!("CARGO_BIN_EXE_armcal"))
            .env("RAYON_NUM_THREADS", threads)
            .args([Path::new("pool"), &week, &path.join("results"), Path::new("--out"), &out])
            .output()
            .expect("starting armcal");
        assert!(matches!(output.status.code(), Some(0 | 3)), "{}", said(&output));
        ["pool.json", "parameters.toml", "model.json"]
            .map(|name| std::fs::read(out.join(name)).expect("result"))
    };
    assert!(with("1") == with("4"), "the number of threads changes the bytes");
    let pooled = read_json(&path.join("pool-1/pool.json"));
    for (recording, (day, ..)) in pooled["recordings"].as_array().expect("recordings").iter().zip(DAYS) {
        let own = parameters(recording, "/parameters");
        let base = named(&own, &Value::from(format!("{day}.base.rz")));
        assert!(base["free"] == true && number(base, "/sigma") > 0.0);
    }
    let shared = parameters(&pooled, "/fit/parameters");
    assert!(named(&shared, &Value::from("base.rz"))["free"] == false);
    leaves_what_a_run_leaves(&path.join("pool-1"), &pooled);
    // One run of all recordings gives each its own base too, and the same arm.
    let text = std::fs::read_to_string(&week).expect("pipeline");
    let together = run_pipeline(&week, &path.join("together"), &[0, 3]);
    assert!(text.contains("per_recording"));
    let of_run = parameters(&together, "/fit/parameters");
    let mut worst: f64 = 0.0;
    for recording in pooled["recordings"].as_array().expect("recordings") {
        for p in parameters(recording, "/parameters").into_iter().chain(shared.iter().copied()) {
            let q = named(&of_run, &p["name"]);
            assert_eq!((&p["free"], &p["determined"]), (&q["free"], &q["determined"]), "{}", p["name"]);
            if p["free"] == true {
                worst = worst.max((number(p, "/value") - number(q, "/value")).abs() / number(q, "/sigma"));
            }
        }
    }
    println!("pool and run, each with a base a day: {worst:.1e} sigma apart");
    assert!(worst < 1e-3);
    // The model of the pool corrects set-points like that of a run.
    let targets = path.join("targets.csv");
    write(&targets, "name,x_m,y_m,z_m\na,0.40,0.05,0.15\n");
    let args = ["compensate".into(), path.join("pool-1").into_os_string(), targets.into_os_string()];
    let frame = ["--frame", "base", "--out"].map(Into::into);
    let output = armcal(args.into_iter().chain(frame).chain([path.join("set-points.csv").into_os_string()]));
    assert!(matches!(output.status.code(), Some(0 | 3)), "{}", said(&output));
}
