use crate::support::{armcal, number, root, run_pipeline};
use armcal_core::Samples;
use armcal_dwell::{DwellConfig, detect_dwells};
use armcal_recording::{JointStream, PoseStream, Recording, Streams};
use std::path::Path;

/// Where the tip was seen in the middle of each dwell of the paper's upright recording [mm].
fn points_mm() -> Vec<[f64; 3]> {
    let recording = Recording::open(&[root().join("fixtures/paper/normal.mcap")]).expect("recording");
    let names = ["joint1", "joint2", "joint3"].map(str::to_owned).to_vec();
    let joints = JointStream { topic: "/joint_states".into(), names, ..JointStream::default() };
    let tip = PoseStream { topic: "/vicon/tip/tip".into(), ..PoseStream::default() };
    let streams = Streams { joints: vec![joints], tip: Some(tip), ..Streams::default() };
    let (mut samples, ..) = recording.read(&streams).expect("readable");
    let tip = samples.tip.take().expect("a tip");
    let alone = Samples { joints: samples.joints, ..Samples::default() };
    let (dwells, _) = detect_dwells(0, &alone, None, &DwellConfig::default()).expect("dwells");
    let at = |time_ns: i64| tip.time_ns.partition_point(|t| *t < time_ns).min(tip.time_ns.len() - 1);
    dwells.iter().map(|d| (tip.position_m[at(d.mid_ns())] * 1e3).into()).collect()
}

fn csv(points: &[[f64; 3]]) -> String {
    let row = |(k, p): (usize, &[f64; 3])| format!("P{k},{:.3},{:.3},{:.3}\n", p[0], p[1], p[2]);
    "Name,X [mm],Y [mm],Z [mm]\n".to_owned() + &points.iter().enumerate().map(row).collect::<String>()
}

/// A recording of the joints alone, and the points that a tracker measured one by one.
fn pipeline(folder: &Path, more: &str) -> std::path::PathBuf {
    let [recording, dh] =
        ["fixtures/paper/normal.mcap", "pipelines/models/right_arm.toml"].map(|p| root().join(p));
    let text = format!(
        "name = \"points\"\n[[recordings]]\npaths = [{recording:?}]\npoints = {{ csv = \"points.csv\", sigma_mm = 0.15{more} }}\n\
         [streams.joints]\ntopic = \"/joint_states\"\nnames = [\"joint1\", \"joint2\", \"joint3\"]\n[model]\ndh = {dh:?}\n\
         [frames.base]\npose = \"estimated\"\n[frames.tip]\npose = \"estimated\"\n[holdout]\nkind = \"cavity-folds\"\nk = 5\n\
         [diagnosis]\nenabled = false\n"
    );
    let path = folder.join("p.toml");
    std::fs::write(&path, text).expect("a pipeline");
    path
}

/// The rows are the dwells that they were measured in, though the arm paused before and after, and once unmeasured.
#[test]
fn points_of_a_tracker_calibrate_the_arm() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let points = points_mm();
    let measured = csv(&points[2..58]);
    let hole = measured.lines().nth(9).expect("a row").to_owned();
    std::fs::write(folder.path().join("points.csv"), measured.replace(&hole, "P8,-,-,-")).expect("written");
    let summary = run_pipeline(&pipeline(folder.path(), ""), &folder.path().join("out"), &[0, 3]);
    let said = summary["recordings"][0]["warnings"].to_string();
    assert!(said.contains("its 56 rows are the dwells 2 to 57; 6 of 61 dwells have no point"), "{said}");
    let [nominal_mm, mm] =
        ["nominal", "fitted"].map(|n| number(&summary, &format!("/fit/holdout/{n}_mm/mean")));
    println!("{nominal_mm:.3} to {mm:.3} mm");
    assert_eq!(number(&summary, "/fit/holdout/n"), 55.0);
    // The same points, said to be the dwells after these: told.
    let wrong = pipeline(folder.path(), ", first_dwell = 4");
    let wrong = run_pipeline(&wrong, &folder.path().join("wrong"), &[0, 3]);
    let said = wrong["recordings"][0]["warnings"].to_string();
    assert!(
        said.contains("are the rows in the order of the dwells") && said.contains("inadequate"),
        "{said}"
    );
    // One reading of the camera: 0.15 mm an axis or 0.24 mm on average.
    assert!(mm < 0.35, "{mm}");
}

/// What does not fit is told with file and line, and nothing is guessed.
#[test]
fn points_that_do_not_fit_are_refused_in_words() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let points = points_mm();
    let all = csv(&points);
    let few = csv(&points[10..14]);
    let cases = [
        (all.clone() + &all[26..], "", "points.csv: 122 rows are more than the 61 dwells"),
        (all.replace("P3,", "P3,x"), "", "points.csv: line 5: `x"),
        (few, "", "set first_dwell"),
        (all.clone(), ", first_dwell = 3", "61 rows from dwell 3 on are more than the 61 dwells"),
        (all.clone(), ", sigma = 1", "unknown field `sigma`"),
    ];
    for (text, more, words) in cases {
        std::fs::write(folder.path().join("points.csv"), text).expect("written");
        let out = folder.path().join("out");
        let output = armcal([Path::new("run"), &pipeline(folder.path(), more), Path::new("--out"), &out]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(1) && said.contains(words), "{words}: {said}");
        println!("{}", said.lines().next().unwrap_or_default());
    }
    let both = std::fs::read_to_string(pipeline(folder.path(), "")).expect("a pipeline")
        + "[streams.tip]\ntopic = \"/vicon/tip/tip\"\n";
    let path = folder.path().join("p.toml");
    std::fs::write(&path, both).expect("written");
    let output = armcal([Path::new("run"), &path]);
    assert!(String::from_utf8_lossy(&output.stderr).contains("leave one out"));
}
