use crate::support::{armcal, number, root, run_pipeline};
use armcal_core::Samples;
use armcal_dwell::{DwellConfig, detect_dwells};
use armcal_recording::{JointStream, PoseStream, Recording, Streams};
use std::path::Path;

/// When the middle of each dwell of the paper's upright recording was [ns], and where the tip was seen then [mm].
fn timed_mm() -> Vec<(i64, [f64; 3])> {
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
    dwells.iter().map(|d| (d.mid_ns(), (tip.position_m[at(d.mid_ns())] * 1e3).into())).collect()
}

fn points_mm() -> Vec<[f64; 3]> {
    timed_mm().into_iter().map(|(_, point_mm)| point_mm).collect()
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

/// A tracker with a clock of its own, a day and 1,234.5 s behind, that loses the beam at every fourth dwell, sees a nest on the way
/// twice, one dwell twice, and exports its points by name, out of their order in time.
#[test]
fn times_of_a_tracker_say_which_dwells_it_missed() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let (recording, points) = (folder.path().join("points.csv"), timed_mm());
    let behind_ns = 86_400_000_000_000 + 1_234_500_000_000;
    let row = |time_ns: i64, p: &[f64; 3]| {
        let time =
            chrono::DateTime::from_timestamp_nanos(time_ns - behind_ns).format("%m/%d/%Y %I:%M:%S%.3f %p");
        format!("{time},{:.3},{:.3},{:.3}\n", p[0], p[1], p[2])
    };
    let seen = points.iter().enumerate().filter(|(k, _)| k % 4 != 1);
    let mut rows: Vec<String> = seen.map(|(_, (time_ns, p))| row(*time_ns, p)).collect();
    let on_the_way = |k: usize| i64::midpoint(points[k].0, points[k + 1].0);
    rows.extend([20, 40].map(|k| row(on_the_way(k), &[1.0, 2.0, 3.0])));
    rows.push(row(points[4].0 + 50_000_000, &points[4].1));
    // The first 17 come last, and first of all a row of a dwell that was not measured.
    rows.rotate_left(17);
    let text = format!("Date,X [mm],Y [mm],Z [mm]\nlost,-,-,-\n{}", rows.concat());
    std::fs::write(&recording, &text).expect("written");
    let timed = pipeline(folder.path(), ", time = \"date\"");
    let summary = run_pipeline(&timed, &folder.path().join("out"), &[0, 3]);
    let said = summary["recordings"][0]["warnings"].to_string();
    println!("{said}");
    let seen: Vec<usize> = (0..points.len()).filter(|k| k % 4 != 1).collect();
    let (first, seen) = (seen[17], seen.len());
    assert_eq!(number(&summary, "/fit/holdout/n"), seen as f64);
    assert!(
        said.contains(&format!("of its {} points {} were measured in dwells", seen + 3, seen + 1)),
        "{said}"
    );
    assert!(said.contains("2 in none and left out (line "), "{said}");
    let mm = number(&summary, "/fit/holdout/fitted_mm/mean");
    assert!(mm < 0.35, "{mm}");
    // The first row with a point is said to be the time of the recording that it was.
    let first_s = points[first].0 as f64 * 1e-9;
    let told = said.split("` is ").nth(1).and_then(|rest| rest.split(' ').next()).expect("a time");
    let within = said.split("give or take ").nth(1).and_then(|rest| rest.split(' ').next()).expect("a time");
    let [told, within] = [told, within].map(|text| text.parse::<f64>().expect("seconds"));
    assert!((told - first_s).abs() <= within + 0.01, "{told} {first_s} {within}");
    // A second point in a dwell, somewhere else.
    let wrong = text + &row(points[30].0 + 10_000_000, &[1.0, 2.0, 3.0]);
    for (text, more, words) in [
        (wrong.as_str(), "date", "leave out those that are wrong"),
        (
            &wrong.replace("AM", "in the morning").replace("PM", "at night"),
            "date",
            "is no time, or not written as the first is",
        ),
        (&wrong, "when", "no column is called `when`; there are Date, X [mm]"),
    ] {
        std::fs::write(&recording, text).expect("written");
        let timed = pipeline(folder.path(), &format!(", time = {more:?}"));
        let output = armcal([Path::new("run"), &timed, Path::new("--out"), &folder.path().join("no")]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(1) && said.contains(words), "{words}: {said}");
        println!("{}", said.lines().next().unwrap_or_default());
    }
}

/// `init` takes the file, says of unit and time what its header says, and its pipeline errs as the one written by hand.
#[test]
fn a_proposal_takes_the_points_of_a_tracker() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let by_hand = pipeline(folder.path(), ", time = \"Date Time\"");
    let row = |(time_ns, p): &(i64, [f64; 3])| {
        let time =
            chrono::DateTime::from_timestamp_nanos(time_ns - 5_000_000_000).format("%Y-%m-%d %H:%M:%S%.3f");
        format!("{time};{:.6};{:.6};{:.6}\n", p[0] * 1e-3, p[1] * 1e-3, p[2] * 1e-3)
    };
    let rows = timed_mm()[3..].iter().map(row).collect::<String>();
    let csv = folder.path().join("points.csv");
    let written = |header: &str| std::fs::write(&csv, format!("{header}\n{rows}")).expect("written");
    written("Date Time;X [m];Y [m];Z [m]");
    let [recording, dh] =
        ["fixtures/paper/normal.mcap", "pipelines/models/right_arm.toml"].map(|p| root().join(p));
    let out = folder.path().join("proposed.toml");
    let init = |more: &[&Path]| {
        let given = [
            Path::new("init"),
            &recording,
            Path::new("--dh"),
            &dh,
            Path::new("--out"),
            &out,
            Path::new("--force"),
        ];
        let output = armcal([&given, more].concat());
        let said =
            [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text).into_owned()).concat();
        (output.status.code(), said)
    };
    let points = [Path::new("--points"), &csv];
    let (code, said) = init(&points);
    assert!(code == Some(0) && said.contains("--points says where the tip was"), "{said}");
    let text = std::fs::read_to_string(&out).expect("a proposal");
    println!("{said}\n{text}");
    assert!(text.contains("unit = \"m\", sigma_mm = 0.05, time = \"Date Time\" }"), "{text}");
    assert!(!text.contains("[streams.tip]") && !text.contains("[streams.base]"), "{text}");
    let by_hand_text =
        std::fs::read_to_string(&by_hand).expect("a pipeline").replace("csv\", ", "csv\", unit = \"m\", ");
    std::fs::write(&by_hand, by_hand_text).expect("written");
    let mm = [&out, &by_hand].map(|pipeline| {
        let summary = run_pipeline(pipeline, &folder.path().join("out"), &[0, 3]);
        assert_eq!(number(&summary, "/fit/holdout/n"), 58.0);
        number(&summary, "/fit/holdout/fitted_mm/mean")
    });
    println!("{mm:?} mm");
    assert!(mm[0] < 1.05 * mm[1], "{mm:?}");
    // What the header does not say is said; another unit, and another number of files, are refused.
    written("Date Time;X;Y;Z");
    let (_, said) = init(&points);
    assert!(said.contains("which its header does not say: taken as mm"), "{said}");
    written("Date Time;X [in];Y [in];Z [in]");
    let (code, said) = init(&points);
    assert!(code == Some(1) && said.contains("is in `in`: export it in mm"), "{said}");
    let (code, said) = init(&[points, points].concat());
    assert!(code == Some(1), "{said}");
}

/// Four points fit many offsets: asked for, and taken from who knows.
#[test]
fn few_times_are_not_guessed() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let row = |(time_ns, p): &(i64, [f64; 3])| {
        format!("{:.3},{},{},{}\n", (time_ns % 1_000_000_000_000) as f64 * 1e-9, p[0], p[1], p[2])
    };
    let few = timed_mm()[10..14].iter().map(row).collect::<String>();
    std::fs::write(folder.path().join("points.csv"), format!("t,x,y,z\n{few}")).expect("written");
    let run = |more: &str| {
        let output =
            armcal([Path::new("run"), &pipeline(folder.path(), more), Path::new("--out"), folder.path()]);
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    let said = run(", time = \"t\"");
    assert!(said.contains("so few points do not tell by how much the clocks are apart"), "{said}");
    // Then the dwells are known, and four points are too few for a calibration.
    let said = run(", time = \"t\", first_dwell = 10");
    assert!(!said.contains("points.csv:"), "{said}");
    println!("{said}");
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
