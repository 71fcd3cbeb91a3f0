use crate::support::{
    armcal, python_with, quick_pipeline, read_json, root, run_pipeline, shipped, simulate, skip,
};
use armcal_core::{FeatureId, Parameter, Pose, Unit};
use armcal_model::{Chain, Frames, Model};
use armcal_result::{StoredArms, StoredObservations, open_model};
use nalgebra::{Matrix3, Matrix4, Vector3};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Joint vectors that every file is compared at.
const POSES: usize = 120;
const UNDIAGNOSED: &str = "\n[diagnosis]\nenabled = false\n";
/// Kinematics of a UR in the form that ur_calibration extracts; only its hash is read.
const OWN_KINEMATICS: &str = "kinematics:\n  shoulder:\n    x: 0\n  hash: calib_12788084448423163542\n";

/// Runs `armcal write`; what it printed as JSON, or what it said.
fn write(result: &Path, format: &str, out: &Path, more: &[&str]) -> Result<Value, String> {
    let (result, out) = (result.display().to_string(), out.display().to_string());
    let fixed = ["write", &result, "--as", format, "--out", &out, "--json"];
    let output = armcal(fixed.iter().chain(more));
    match output.status.code() {
        Some(0 | 3) => Ok(serde_json::from_slice(&output.stdout).expect("JSON")),
        _ => Err(String::from_utf8_lossy(&output.stderr).into_owned()),
    }
}

/// A session of the paper's rig with play in its gears, calibrated with and without it.
fn with_play(folder: &Path, play: bool) -> PathBuf {
    let recordings = folder.join("recordings");
    if !recordings.exists() {
        let lab = root().join("pipelines/lab/paper-backlash.toml");
        simulate(&lab, &recordings, &[]);
    }
    let effect = |joint| format!("\n[[effects]]\nkind = \"backlash\"\ntarget = {joint}\n");
    let effects: String = if play { [1, 2, 3].map(effect).concat() } else { String::new() };
    let pipeline = folder.join(format!("play-{play}.toml"));
    std::fs::write(&pipeline, quick_pipeline(&recordings) + &effects).expect("pipeline");
    let out = folder.join(format!("play-{play}"));
    run_pipeline(&pipeline, &out, &[0, 3]);
    out
}

/// A shipped pipeline without its diagnosis.
fn result_of(folder: &Path, pipeline: &str) -> PathBuf {
    let path = folder.join(pipeline);
    std::fs::write(&path, shipped(pipeline) + UNDIAGNOSED).expect("pipeline");
    let out = folder.join(pipeline.trim_end_matches(".toml"));
    run_pipeline(&path, &out, &[0, 3]);
    out
}

/// A result of a UR10 that differs from its table in every entry by up to 2 mm and 0.3 deg: another result's `model.json` with
/// this arm in it.
fn ur10(folder: &Path, other: &Path) -> PathBuf {
    let text = std::fs::read_to_string(root().join("pipelines/models/ur10.toml")).expect("table");
    let chain = Chain::from_dh_toml(&text, Path::new("ur10.toml")).expect("table");
    let model = Model::new(chain, Frames::of_bare_arm()).expect("model");
    let mut rng = ChaCha8Rng::seed_from_u64(10);
    let value = |p: &Parameter| {
        let most = if p.unit == Unit::Metre { 2e-3 } else { 5e-3 };
        let calibrated = p.nominal + rng.random_range(-1.0..=1.0) * most;
        json!({"name": p.name, "nominal": p.nominal, "calibrated": calibrated, "sigma": 1e-4})
    };
    let parameters: Vec<Value> = model.parameters().iter().map(value).collect();
    let mut file = read_json(&other.join("model.json"));
    let frame = |name: &str| json!({"name": name, "xyz_m": [0.0, 0.0, 0.0], "quaternion_xyzw": [0.0, 0.0, 0.0, 1.0], "free_rotation": true});
    let postures: Vec<Vec<f64>> = readings(6, 30);
    for (key, value) in [
        ("chain", json!({"form": "dh", "text": text})),
        ("base", frame("base")),
        ("tip", frame("tip")),
        ("boards", json!([])),
        ("effects", json!([])),
        ("parameters", json!(parameters)),
        ("postures_rad", json!(postures)),
        ("range_rad", json!(vec![[-3.0, 3.0]; 6])),
        ("visited", json!([])),
    ] {
        file[key] = value;
    }
    let path = folder.join("ur10.json");
    std::fs::write(&path, file.to_string()).expect("model file");
    path
}

fn readings(joints: usize, count: usize) -> Vec<Vec<f64>> {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    (0..count).map(|_| (0..joints).map(|_| rng.random_range(-2.8..2.8)).collect()).collect()
}

/// One arm of a result, and the link that its base is.
struct Arm {
    result: PathBuf,
    arms: StoredArms,
    at: usize,
    root: &'static str,
}

impl Arm {
    fn of(result: &Path, at: usize, root: &'static str) -> Arm {
        let arms = open_model(result).expect("a result").arms().expect("its models");
        Arm { result: result.to_owned(), arms, at, root }
    }

    /// Writes a format and asks its readers where `place` is, which lies `behind` less than the tip.
    fn cases(&self, folder: &Path, format: &str, more: &[&str], asked: &Asked<'_>) -> Vec<Case> {
        let path = folder.join(format!("{}-{format}.{}", asked.name, asked.extension));
        let said = write(&self.result, format, &path, more).unwrap_or_else(|e| panic!("{format}: {e}"));
        println!("{said}");
        let (model, values) = (&self.arms.model, &self.arms.values);
        let own = model.chain().arms().get(self.at).map_or(0..model.joint_count(), |arm| arm.joints.clone());
        let readings = readings(own.len(), POSES);
        let at = |readings: &Vec<f64>| {
            let mut all = vec![0.0; model.joint_count()];
            all[own.clone()].copy_from_slice(readings);
            model.feature_in_base(values, FeatureId(self.at), &all) * asked.behind.inverse()
        };
        let expected: Vec<Pose> = readings.iter().map(at).collect();
        let case = |reader: &&str| {
            let mut question = json!({
                "reader": reader, "path": path, "root": self.root, "places": [asked.place],
                "joints": model.chain().arm(self.at).0.joint_names(), "readings": readings,
            });
            for (key, value) in asked.extra.as_object().into_iter().flatten() {
                question[key] = value.clone();
            }
            if *reader == "xacro" {
                question["description"] = described(&path).into();
            }
            let what = format!("{format} of {} by {reader}", asked.name);
            Case { question, expected: expected.clone(), within: asked.within, what }
        };
        asked.readers.iter().map(case).collect()
    }
}

/// Who is asked for which place.
struct Asked<'a> {
    name: &'a str,
    extension: &'a str,
    readers: &'a [&'a str],
    place: &'a str,
    /// From the place to the tip.
    behind: Pose,
    within: f64,
    extra: Value,
}

impl Asked<'_> {
    fn tip<'a>(name: &'a str, readers: &'a [&'a str]) -> Asked<'a> {
        Asked {
            name,
            extension: "xml",
            readers,
            place: "tip",
            behind: Pose::identity(),
            within: 1e-12,
            extra: json!({}),
        }
    }
}

/// A file, what reads it, and where armcal has its place.
struct Case {
    question: Value,
    expected: Vec<Pose>,
    /// Largest difference of an entry of a pose.
    within: f64,
    what: String,
}

/// What Python answers.
fn answers(python: &Path, questions: &[&Value], folder: &Path) -> Vec<Value> {
    let path = folder.join("cases.json");
    std::fs::write(&path, serde_json::to_vec(questions).expect("JSON")).expect("writing the cases");
    let script = root().join("tests/python/written_formats.py");
    let output = Command::new(python).arg(script).arg(&path).output().expect("starting python");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("answers")
}

fn compare(python: &Path, cases: &[Case], folder: &Path) {
    let questions: Vec<&Value> = cases.iter().map(|case| &case.question).collect();
    let answers = answers(python, &questions, folder);
    assert_eq!(answers.len(), cases.len());
    for (case, answer) in cases.iter().zip(&answers) {
        let mut largest = 0f64;
        let poses: Vec<Vec<[[f64; 4]; 4]>> = serde_json::from_value(answer.clone()).expect("poses");
        assert_eq!(poses.len(), POSES, "{}", case.what);
        for (own, theirs) in case.expected.iter().zip(poses.iter().flatten()) {
            let theirs = Matrix4::from_fn(|r, c| theirs[r][c]);
            largest = largest.max((own.to_homogeneous() - theirs).amax());
        }
        println!("{}: {largest:.1e}", case.what);
        assert!(largest < case.within, "{}: {largest:e}", case.what);
    }
}

/// The description of the Panda with every origin that the file has replaced by its macro.
fn described(patch: &Path) -> String {
    let urdf = std::fs::read_to_string(root().join("fixtures/mukca-panda4/panda.urdf")).expect("URDF");
    let open = "<robot name=\"panda\" xmlns:xacro=\"http://www.ros.org/wiki/xacro\"><xacro:include filename=\"@PATCH@\"/>";
    let mut text = urdf.replace("<robot name=\"panda\">", open);
    let patch = std::fs::read_to_string(patch).expect("patch");
    let names: Vec<&str> = patch.split("('").skip(1).filter_map(|rest| rest.split('\'').next()).collect();
    assert!(names.len() >= 7, "{names:?}");
    for name in names {
        let joint = text.find(&format!("<joint name=\"{name}\"")).expect("the joint");
        let from = joint + text[joint..].find("<origin").expect("its origin");
        let to = from + text[from..].find("/>").expect("its end") + 2;
        text.replace_range(from..to, &format!("<xacro:calibrated_origin joint=\"{name}\"/>"));
    }
    text
}

#[test]
fn every_format_is_read_by_others_as_the_arm_that_was_calibrated() {
    let Some(python) = python_with("numpy, mujoco, pinocchio, pydrake.multibody, xacro, yaml") else {
        return;
    };
    let folder = tempfile::tempdir().expect("temporary folder");
    let folder = folder.path();
    let own = folder.join("own.yaml");
    std::fs::write(&own, OWN_KINEMATICS).expect("kinematics");
    let own = own.display().to_string();
    let mut cases = Vec::new();
    let urdf = |name, readers, place| Asked { extension: "urdf", place, ..Asked::tip(name, readers) };
    let sdf = |name| Asked { extension: "sdf", ..Asked::tip(name, &["drake"]) };
    let simulators = &["mujoco", "pinocchio"];

    // The paper's arm, from a DH table, with play in the model.
    let paper = Arm::of(&with_play(folder, true), 0, "base");
    let rows = |arm: &Arm, name, within| {
        let behind = arm.arms.model.feature_in_link(&arm.arms.values, FeatureId(arm.at));
        Asked { extension: "csv", behind, within, ..Asked::tip(name, &["rows"]) }
    };
    cases.extend(paper.cases(folder, "urdf", &[], &urdf("paper", &["pinocchio", "drake"], "tip")));
    cases.extend(paper.cases(folder, "mjcf", &[], &Asked::tip("paper", simulators)));
    cases.extend(paper.cases(folder, "sdf", &[], &sdf("paper")));
    cases.extend(paper.cases(folder, "dh-csv", &[], &rows(&paper, "paper", 1e-12)));

    // A Panda, from a URDF.
    let panda = Arm::of(&result_of(folder, "mukca-panda4.toml"), 0, "panda_link0");
    cases.extend(panda.cases(folder, "urdf", &[], &urdf("panda", &["pinocchio"], "ball_link")));
    let xacro = Asked { extension: "xacro", ..urdf("panda", &["xacro"], "ball_link") };
    cases.extend(panda.cases(folder, "xacro", &[], &xacro));
    cases.extend(panda.cases(folder, "mjcf", &[], &Asked::tip("panda", &["mujoco"])));
    // Pinocchio 4.1 puts a site on a body without a joint where its parent is: it is asked for the body.
    let behind = panda.arms.model.feature_in_link(&panda.arms.values, FeatureId::TIP);
    let body = Asked { place: "ball_link", behind, ..Asked::tip("panda", &["pinocchio"]) };
    cases.extend(panda.cases(folder, "mjcf", &[], &body));
    cases.extend(panda.cases(folder, "sdf", &[], &sdf("panda")));
    cases.extend(panda.cases(folder, "dh-csv", &[], &rows(&panda, "panda", 1e-9)));

    // A UR10, with tilts of axes that are nearly parallel: rows of hundreds of metres without them.
    let ur = Arm::of(&ur10(folder, &paper.result), 0, "base");
    let (model, values) = (&ur.arms.model, &ur.arms.values);
    let last = model.chain().dh_rows(&values[..model.chain().parameters().len()]).expect("rows").1.remove(5);
    let flange = Pose::translation(last.a_m, 0.0, 0.0) * Pose::rotation(Vector3::x() * last.alpha_rad);
    let behind = flange * model.feature_in_link(values, FeatureId::TIP);
    let extra = json!({"hash": "calib_12788084448423163542"});
    let kinematics =
        Asked { extension: "yaml", place: "tool0", behind, extra, ..Asked::tip("ur10", &["ur"]) };
    cases.extend(ur.cases(folder, "ur-yaml", &["--hash-from", &own], &kinematics));
    cases.extend(ur.cases(folder, "urdf", &[], &urdf("ur10", &["pinocchio", "drake"], "tip")));
    cases.extend(ur.cases(folder, "dh-csv", &[], &rows(&ur, "ur10", 1e-9)));
    match std::env::var("ARMCAL_UR_DESCRIPTION") {
        Ok(clone) => {
            let extra = json!({"folder": clone, "hash": "calib_12788084448423163542"});
            let whole = Asked { name: "described", readers: &["ur_description"], extra, ..kinematics };
            // Its description has pi to sixteen digits, and turns the base by it.
            let ur = Arm { root: "base_link_inertia", ..ur };
            cases.extend(ur.cases(folder, "ur-yaml", &["--hash-from", &own], &whole));
        }
        Err(_) => skip(
            "no clone of ur_description; name one by ARMCAL_UR_DESCRIPTION to load the kinematics through it",
        ),
    }

    // Either of two arms.
    let pair = result_of(folder, "two-arms.toml");
    for (at, name) in ["right", "left"].into_iter().enumerate() {
        let arm = Arm::of(&pair, at, "base");
        let place = format!("{name}.tip");
        let asked = Asked { place: &place, ..Asked::tip(name, simulators) };
        cases.extend(arm.cases(folder, "mjcf", &["--arm", name], &asked));
    }
    compare(&python, &cases, folder);
}

/// The terminal's number against turning each joint by half its play, on the side it came from.
#[test]
fn what_is_left_is_what_the_effects_do() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let folder = folder.path();
    let result = with_play(folder, true);
    let said = write(&result, "urdf", &folder.join("arm.urdf"), &[]).expect("written");
    assert_eq!(said["lacks"][0], "effects: backlash:1, backlash:2, backlash:3");
    let arms = open_model(&result).expect("a result").arms().expect("its models");
    let observed = StoredObservations::open(&result.join("observations.json")).expect("observations");
    let geometry = &arms.values[..arms.geometry.parameters().len()];
    let gaps = arms.model.gaps(&arms.values);
    assert_eq!(gaps.len(), 3);
    let tip_m = |q: &[f64]| arms.geometry.tip_in_base(geometry, q).translation.vector;
    let mut off_mm: Vec<f64> = Vec::new();
    for o in observed.recordings.iter().flat_map(|r| &r.observations) {
        let mut link = o.joint_rad.clone();
        for (_, joint, width) in &gaps {
            link[*joint] -= 0.5 * width * o.arrival[*joint].sign();
        }
        off_mm.push(1e3 * (tip_m(&link) - tip_m(&o.joint_rad)).norm());
    }
    let mean = off_mm.iter().sum::<f64>() / off_mm.len() as f64;
    let (n, own) = (said["left_mm"]["n"].as_u64(), said["left_mm"]["mean"].as_f64().expect("a mean"));
    println!("{own:.3} mm left, by half the play {mean:.3} mm, at {n:?} observations");
    assert_eq!(n, Some(off_mm.len() as u64));
    assert!(own > 1.0 && (own / mean - 1.0).abs() < 0.05, "{own} against {mean} mm");

    // Without effects in the model a file holds all of it; zeros alone hold less, but more than nothing.
    let result = with_play(folder, false);
    let left = |format: &str| {
        let said = write(&result, format, &folder.join(format), &[]).expect("written");
        said["left_mm"]["mean"].as_f64().expect("a mean")
    };
    assert!(left("sdf") < 1e-9);
    let summary = read_json(&result.join("summary.json"));
    let nominal = summary["fit"]["train"]["nominal_mm"]["mean"].as_f64().expect("a mean");
    let zeros = left("joint-zeros");
    println!("nominal {nominal:.2} mm, with joint zeros {zeros:.2} mm");
    assert!(zeros > 0.1 && zeros < nominal, "{zeros} {nominal}");

    // As the controller has it: its nominal arm with the offsets of the file, its base measured anew.
    let Some(python) = python_with("numpy, yaml") else { return };
    let arms = open_model(&result).expect("a result").arms().expect("its models");
    let joints = arms.geometry.chain().joint_names();
    let question = json!({"reader": "offsets", "path": folder.join("joint-zeros"), "joints": joints});
    let answer = answers(&python, &[&question], folder).remove(0);
    let offsets: Vec<f64> = serde_json::from_value(answer[0].clone()).expect("offsets");
    let observed = StoredObservations::open(&result.join("observations.json")).expect("observations");
    let tips = observed.recordings.iter().flat_map(|r| &r.observations).map(|o| {
        let read: Vec<f64> = o.joint_rad.iter().zip(&offsets).map(|(q, offset)| q + offset).collect();
        let nominal = arms.geometry.tip_in_base(&arms.nominal_values, &read);
        let calibrated = arms.geometry.tip_in_base(&arms.values, &o.joint_rad);
        [nominal.translation.vector, calibrated.translation.vector]
    });
    let own = 1e3 * mean_after_alignment(&tips.collect::<Vec<_>>());
    assert!((own - zeros).abs() < 1e-4, "{own} against {zeros} mm");
}

/// Mean distance between points and where they should be, after the one motion that brings them nearest (Arun, Huang and
/// Blostein 1987).
fn mean_after_alignment(pairs: &[[Vector3<f64>; 2]]) -> f64 {
    let n = pairs.len() as f64;
    let [from, to] = [0, 1].map(|k| pairs.iter().map(|pair| pair[k]).sum::<Vector3<f64>>() / n);
    let spread: Matrix3<f64> = pairs.iter().map(|[a, b]| (a - from) * (b - to).transpose()).sum();
    let svd = spread.svd(true, true);
    let (u, v) = (svd.u.expect("U"), svd.v_t.expect("V").transpose());
    let proper = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, (v * u.transpose()).determinant()));
    let turn = v * proper * u.transpose();
    pairs.iter().map(|[a, b]| (turn * (a - from) + to - b).norm()).sum::<f64>() / n
}

/// What cannot be written is refused by name, with nothing left behind.
#[test]
fn what_a_format_cannot_hold_is_refused_and_nothing_is_written() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let folder = folder.path();
    let (own, none) = (folder.join("own.yaml"), folder.join("none.yaml"));
    std::fs::write(&own, OWN_KINEMATICS).expect("kinematics");
    std::fs::write(&none, "kinematics:\n").expect("kinematics");
    let paths = [&own, &none].map(|path| path.display().to_string());
    let (by_own, by_none) = (["--hash-from", &paths[0]], ["--hash-from", &paths[1]]);
    let [paper, panda, pair] =
        ["paper-normal.toml", "mukca-panda4.toml", "two-arms.toml"].map(|p| result_of(folder, p));
    let ur = ur10(folder, &paper);
    let cases: [(&Path, &str, &[&str], &str); 10] = [
        (
            &paper,
            "ur-yaml",
            &by_own,
            "3 joints lead to its tip, and a UR has six; urdf, mjcf and sdf hold any arm",
        ),
        (&panda, "ur-yaml", &by_own, "7 joints lead to its tip"),
        (&paper, "xacro", &[], "it came from a DH table"),
        (&pair, "urdf", &[], "the arms of this result are right, left; name one"),
        (&pair, "urdf", &["--arm", "middle"], "--arm middle"),
        (&paper, "urdf", &["--arm", "right"], "the result is of one arm"),
        (&ur, "ur-yaml", &[], "only the arm has it"),
        (&ur, "ur-yaml", &by_none, "has not one line `hash: ...`"),
        (&ur, "urdf", &by_own, "only ur-yaml has a hash"),
        (&folder.join("nowhere"), "urdf", &[], "nowhere"),
    ];
    let out = folder.join("written");
    for (result, format, more, says) in cases {
        let words = write(result, format, &out, more).expect_err(says);
        assert!(words.contains(says), "{format}: {words}");
        assert!(!out.exists(), "{format} left a file");
    }
    // Neither the arm's own file nor the result is written over.
    for (out, format) in [(&own, "ur-yaml"), (&ur, "ur-yaml"), (&paper.join("observations.json"), "ur-yaml")]
    {
        let before = std::fs::read(out).expect("there");
        write(&ur, format, out, &by_own).expect_err("refused");
        assert_eq!(std::fs::read(out).expect("there"), before);
    }
    // The same bytes again, over the file of the first time.
    write(&ur, "ur-yaml", &out, &by_own).expect("written");
    let before = std::fs::read(&out).expect("there");
    write(&ur, "ur-yaml", &out, &by_own).expect("written again");
    assert_eq!(std::fs::read(&out).expect("there"), before);
    // The calibrated URDF is that of the run, to the byte.
    let urdf = folder.join("again.urdf");
    write(&panda, "urdf", &urdf, &[]).expect("written");
    assert_eq!(
        std::fs::read(&urdf).expect("there"),
        std::fs::read(panda.join("calibrated.urdf")).expect("of the run")
    );
}
