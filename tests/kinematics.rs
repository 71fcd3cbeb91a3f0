use crate::support::{armcal, python_with, root, skip};
use armcal_kinematics::{CalibratedArm, Conditions, Driven, Motion, Point};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Results of `armcal run` on the paper's rig with play, a Panda, a UR10; and the frame that poses are in.
const CASES: [(&str, bool); 4] =
    [("paper-play", false), ("paper-play", true), ("panda", true), ("ur10", false)];

/// What is asked, as text, and what the library answers that the program is made of.
struct Questions {
    text: String,
    answers: Vec<Vec<f64>>,
}

fn model_file(name: &str) -> PathBuf {
    root().join(format!("fixtures/models/{name}.json"))
}

fn arm(name: &str) -> CalibratedArm {
    let text = std::fs::read_to_string(model_file(name)).expect("a shipped model");
    CalibratedArm::from_json(&text).expect("an arm")
}

/// Readings within what was recorded, joints arriving from either side; whole degrees, so that they are written without loss.
fn readings_deg(arm: &CalibratedArm, count: usize) -> Vec<Vec<f64>> {
    let share = |k: usize, j: usize| 0.2 + 0.06 * ((k * (7 + 2 * j) + 3 * j) % 11) as f64;
    let at = |k: usize, j: usize| {
        let [low, high] = arm.file.range_rad[j];
        (low + (high - low) * share(k, j)).to_degrees().round()
    };
    (0..count).map(|k| (0..arm.joint_count()).map(|j| at(k, j)).collect()).collect()
}

fn si(arm: &CalibratedArm, deg: &[f64]) -> Vec<f64> {
    let unit = |j: usize| arm.models.model.chain().joint_unit(j);
    deg.iter().enumerate().map(|(j, q)| unit(j).from_display(*q)).collect()
}

/// Where the nominal arm goes, with its orientation where it can be given one.
fn places(arm: &CalibratedArm, motion: &Motion<'_>, path: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let place = |q: &Vec<f64>| {
        let pose = motion.nominal_tip(q).expect("a pose");
        let turned = if arm.joint_count() < 6 { &[][..] } else { pose.rotation.coords.as_slice() };
        pose.translation.vector.iter().chain(turned).copied().collect()
    };
    path.iter().map(place).collect()
}

fn asked(arm: &CalibratedArm, in_base: bool) -> Questions {
    let mut motion = arm.motion(&Conditions { in_base, ..Conditions::default() }).expect("a motion");
    let path: Vec<Vec<f64>> = readings_deg(arm, 8).iter().map(|q| si(arm, q)).collect();
    let places = places(arm, &motion, &path[1..]);
    let mut questions = Questions { text: String::new(), answers: Vec::new() };
    let mut ask = |word: &str, given: &[f64], answer: Vec<f64>| {
        let given: Vec<String> = given.iter().map(f64::to_string).collect();
        questions.text += &format!("{word} {}\n", given.join(" "));
        questions.answers.push(answer);
    };
    let pose = |pose: armcal_core::Pose| {
        let (at, q) = (pose.translation.vector, pose.rotation.coords);
        [at.x, at.y, at.z, q.x, q.y, q.z, q.w].to_vec()
    };
    let point = |point: &armcal_compensate::SetPoint| {
        let reached = point.reached.as_ref().expect("what it reaches");
        let turn = reached.turn_rad.unwrap_or([f64::NAN; 2]);
        let directions: Vec<f64> = point.arrival.iter().map(|arrival| arrival.sign()).collect();
        [&point.joint_rad[..], &directions, &[reached.before_m, reached.after_m], &turn].concat()
    };
    motion.start(Some(&path[0])).expect("a start");
    ask("start", &path[0], Vec::new());
    let q_len = path[0].len();
    let rising = vec![1.0; q_len];
    for q in &path[1..] {
        ask("tip", q, pose(motion.tip(q, &Driven::default()).expect("a pose")));
        let driven = Driven { direction: Some(&rising), ..Driven::default() };
        ask("rising", q, pose(motion.tip(q, &driven).expect("a pose")));
        ask("nominal", q, pose(motion.nominal_tip(q).expect("a pose")));
        ask("correct", q, point(&motion.correct(q, None).expect("a set-point")));
    }
    motion.go(&path[2]).expect("a move");
    ask("go", &path[2], Vec::new());
    ask("tip", &path[3], pose(motion.tip(&path[3], &Driven::default()).expect("a pose")));
    // From where it stands a tenth of the way at a time, and back: joints turn, and cross their gaps meanwhile.
    let [from, to] = [2, 3].map(|k: usize| &path[k]);
    let share = |share: f64| from.iter().zip(to).map(|(a, b)| a + share * (b - a)).collect::<Vec<f64>>();
    let way: Vec<Vec<f64>> = [0.1, 0.2, 0.3, 0.2, 0.1, 0.05].map(share).to_vec();
    let times: Vec<f64> = (0..way.len()).map(|k| 0.1 * k as f64).collect();
    let rows = way.iter().zip(&times).flat_map(|(q, t)| [&[*t][..], q].concat());
    let given: Vec<f64> = std::iter::once(0.3).chain(rows).collect();
    let in_gap = |p: &armcal_compensate::SetPoint| {
        (0..q_len).map(|j| f64::from(p.in_gap.contains(&j))).collect::<Vec<_>>()
    };
    let all = motion.path(&way, &times, 0.3).expect("a path");
    let answer = all.iter().flat_map(|p| {
        let point = point(p);
        [&point[..2 * q_len], &in_gap(p), &point[2 * q_len..]].concat()
    });
    ask("path", &given, answer.collect());
    motion.start(Some(&path[0])).expect("a start");
    ask("start", &path[0], Vec::new());
    for place in &places {
        let at = motion.set_point(&wanted(place)).expect("a set-point");
        ask("place", place, [&at.nominal_rad[..], &point(&at)].concat());
    }
    questions
}

fn wanted(place: &[f64]) -> Point {
    let turned = place.get(3..7).map(|q| nalgebra::Quaternion::new(q[3], q[0], q[1], q[2]));
    Point {
        position_m: nalgebra::Vector3::from_column_slice(&place[..3]),
        orientation: turned.map(nalgebra::UnitQuaternion::new_normalize),
        time_s: None,
    }
}

/// The shared library, which cargo puts beside the tests.
fn library_folder() -> PathBuf {
    let tests = std::env::current_exe().expect("this test");
    tests.parent().expect("its folder").to_owned()
}

/// Puts the questions to a program; its answers, and what it complained of.
fn answers(command: &mut Command, questions: &str) -> (Vec<Vec<f64>>, String) {
    let command = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("starting the program");
    child.stdin.take().expect("its input").write_all(questions.as_bytes()).expect("questions");
    let output = child.wait_with_output().expect("its end");
    let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{out}\n{err}");
    let numbers = |line: &str| line.split_whitespace().map(|n| n.parse().expect("a number")).collect();
    (out.lines().map(numbers).collect(), err.into_owned())
}

/// To the last bit; no number is none on either side.
fn assert_same(found: &[Vec<f64>], wanted: &[Vec<f64>], what: &str) {
    assert_eq!(found.len(), wanted.len(), "{what}");
    for (k, (found, wanted)) in found.iter().zip(wanted).enumerate() {
        let same = |(a, b): (&f64, &f64)| a == b || (a.is_nan() && b.is_nan());
        assert!(
            found.len() == wanted.len() && found.iter().zip(wanted).all(same),
            "{what}, answer {k}:\n{found:?}\n{wanted:?}"
        );
    }
}

/// `armcal compensate` on the places where the nominal arm is at these joints, from where it waits [deg], with times [s] on a path:
/// what it writes for each, as the other programs answer.
fn compensate(
    (name, in_base): (&str, bool),
    folder: &Path,
    from_deg: &[f64],
    path: &[Vec<f64>],
    times: Option<&[f64]>,
) -> Vec<Vec<f64>> {
    let arm = arm(name);
    let motion = arm.motion(&Conditions { in_base, ..Conditions::default() }).expect("a motion");
    let row = |numbers: &[f64]| numbers.iter().map(f64::to_string).collect::<Vec<String>>().join(",");
    let columns = if arm.joint_count() < 6 { "x_m,y_m,z_m" } else { "x_m,y_m,z_m,qx,qy,qz,qw" };
    let columns = columns.to_owned() + if times.is_some() { ",t_s" } else { "" };
    let mut rows = places(&arm, &motion, path);
    rows.iter_mut().zip(times.into_iter().flatten()).for_each(|(row, t)| row.push(*t));
    let rows: Vec<String> = rows.iter().map(|place| row(place)).collect();
    let [targets, out] =
        ["targets.csv", "set-points.csv"].map(|file| folder.join(format!("{name}-{in_base}-{file}")));
    std::fs::write(&targets, format!("{columns}\n{}\n", rows.join("\n"))).expect("targets");
    let from = format!("--from={}", row(from_deg));
    let frame = if in_base { "--frame=base" } else { "--frame=world" };
    let (model, out_arg) = (model_file(name), format!("--out={}", out.display()));
    let output = armcal([
        "compensate".as_ref(),
        model.as_os_str(),
        targets.as_os_str(),
        from.as_ref(),
        frame.as_ref(),
        out_arg.as_ref(),
    ]);
    assert!(matches!(output.status.code(), Some(0 | 3)), "{}", String::from_utf8_lossy(&output.stderr));
    let text = std::fs::read_to_string(&out).expect("set-points");
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().expect("a header").split(',').collect();
    let prefixes = ["nominal.", "set_point.", "arrival."];
    let of =
        |prefix: &str| (0..header.len()).filter(|c| header[*c].starts_with(prefix)).collect::<Vec<usize>>();
    let wanted: Vec<usize> = prefixes.iter().flat_map(|prefix| of(prefix)).collect();
    lines
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            wanted.iter().map(|c| cells[*c].parse().expect("a number")).collect()
        })
        .collect()
}

/// The first of the two ways to say where the tip should be is that of the command line.
#[test]
fn a_place_gives_the_set_point_that_the_command_line_writes() {
    let folder = tempfile::tempdir().expect("temporary folder");
    for (name, in_base) in CASES {
        let arm = arm(name);
        let answers = asked(&arm, in_base).answers;
        let places = &answers[answers.len() - 7..];
        let joints = arm.joint_count();
        let placed: Vec<Vec<f64>> = places.iter().map(|answer| answer[..3 * joints].to_vec()).collect();
        let degrees = readings_deg(&arm, 8);
        let path: Vec<Vec<f64>> = degrees[1..].iter().map(|q| si(&arm, q)).collect();
        assert_same(&compensate((name, in_base), folder.path(), &degrees[0], &path, None), &placed, name);
    }
}

/// A path whose joints turn back: through its gaps as the command line goes, whose own inverse kinematics reaches places within
/// 1 nm; the points inside a gap are those of the time to cross it.
#[test]
fn a_path_goes_through_its_gaps_as_the_command_line_does() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let arm = arm("paper-play");
    let mut motion = arm.motion(&Conditions::default()).expect("a motion");
    let from_deg = &readings_deg(&arm, 1)[0];
    let start = si(&arm, from_deg);
    let times: Vec<f64> = (0..80).map(|k| 0.05 * f64::from(k)).collect();
    let at =
        |t: &f64| start.iter().zip([0.3, 0.25, 0.2]).map(|(q, size)| q + size * (1.7 * t).sin()).collect();
    let nominal: Vec<Vec<f64>> = times.iter().map(at).collect();
    let wanted = compensate(("paper-play", false), folder.path(), from_deg, &nominal, Some(&times));
    motion.start(Some(&start)).expect("a start");
    let before = motion.clone();
    let path = motion.path(&nominal, &times, 0.4).expect("a path");
    for (k, (point, wanted)) in path.iter().zip(&wanted).enumerate() {
        let off = |j: usize| (point.joint_rad[j] - wanted[3 + j]).abs();
        assert!((0..3).all(|j| off(j) < 2e-8), "{k}: {:?} {wanted:?}", point.joint_rad);
    }
    let last = &path[79].joint_rad;
    assert_eq!(motion.stands_rad().as_ref(), Some(last));
    // One leap after the other without time to cross, and the same set-points outside the gaps.
    let leaps = before.clone().path(&nominal, &times, 0.0).expect("a path");
    let mut step_by_step = before.clone();
    let (mut inside, mut leapt) = ([0; 3], [0; 3]);
    for (k, (leap, point)) in leaps.iter().zip(&path).enumerate() {
        assert_eq!(step_by_step.correct(&nominal[k], Some(times[k])).expect("a point"), *leap);
        assert!(leap.in_gap.is_empty());
        for j in 0..3 {
            let is_in_gap = point.in_gap.contains(&j);
            inside[j] += usize::from(is_in_gap);
            assert!(is_in_gap || (point.joint_rad[j] - leap.joint_rad[j]).abs() < 1e-12, "{k} {j}");
            let step = |q: &dyn Fn(usize) -> f64| q(k) - q(k.saturating_sub(1));
            let more = step(&|k| leaps[k].joint_rad[j]) - step(&|k| nominal[k][j]);
            leapt[j] += usize::from(more.abs() > 0.1_f64.to_radians() && k > 0);
        }
    }
    println!("leaps {leapt:?}, points inside a gap {inside:?}");
    assert!(leapt.iter().all(|n| *n > 0));
    // Of a crossing of 0.4 s seven or eight points of every 0.05 s are strictly inside.
    assert!((0..3).all(|j| (7 * leapt[j]..=8 * leapt[j]).contains(&inside[j])), "{leapt:?} {inside:?}");
    // What it says it reaches is where the model has the tip that is driven along the path.
    let mut driven = before.clone();
    for (nominal, point) in nominal.iter().zip(&path) {
        let tip = driven.tip(&point.joint_rad, &Driven::default()).expect("a tip");
        let wanted = driven.nominal_tip(nominal).expect("a tip");
        let off_m = (tip.translation.vector - wanted.translation.vector).norm();
        assert!((off_m - point.reached.as_ref().expect("reached").after_m).abs() < 1e-12);
        driven.go(&point.joint_rad).expect("a move");
    }
    // What makes no sense changes nothing.
    let stood = motion.stands_rad();
    for (nominal, times, crossing_s, words) in [
        (&nominal[..0], &times[..0], 0.4, "0 points"),
        (&nominal[..2], &times[..1], 0.4, "2 points and 1 times"),
        (&nominal[..2], &[1.0, 1.0][..], 0.4, "point 1 is 1, not later"),
        (&nominal[..2], &times[..2], -1.0, "-1 is no time"),
        (&[nominal[3].clone(), vec![0.1, f64::NAN, 0.1]][..], &times[..2], 0.4, "joint2 is NaN"),
    ] {
        let said = motion.path(nominal, times, crossing_s).expect_err("refused").to_string();
        assert!(said.contains(words) && motion.stands_rad() == stood, "{said}");
    }
}

#[test]
fn a_c_program_gets_the_same_digits() {
    let (folder, library) = (tempfile::tempdir().expect("temporary folder"), library_folder());
    let (program, source) = (folder.path().join("evaluate"), root().join("crates/kinematics"));
    if !Command::new("cc").arg("--version").output().is_ok_and(|o| o.status.success()) {
        return skip("no C compiler called cc");
    }
    let compiled = Command::new("cc")
        .args(["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-O1", "-o"])
        .arg(&program)
        .arg(source.join("examples/evaluate.c"))
        .arg("-I")
        .arg(source.join("include"))
        .arg("-L")
        .arg(&library)
        .arg("-larmcal_kinematics")
        .arg(format!("-Wl,-rpath,{}", library.display()))
        .output()
        .expect("starting cc");
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    let evaluate = |model: &Path, frame: &str| {
        let mut command = Command::new(&program);
        command.arg(model).arg(frame);
        command
    };
    for (name, in_base) in CASES {
        let questions = asked(&arm(name), in_base);
        let frame = if in_base { "base" } else { "world" };
        let (found, _) = answers(&mut evaluate(&model_file(name), frame), &questions.text);
        assert_same(&found, &questions.answers, name);
    }
    // No model, and nothing at all.
    for (model, code, words) in
        [("Cargo.toml", 2, "run the pipeline again"), ("nothing", 1, "json: must not be NULL")]
    {
        let output =
            evaluate(&root().join(model), "world").stdin(Stdio::null()).output().expect("starting it");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(code) && said.contains(words), "{:?} {said}", output.status);
    }
}

#[test]
fn the_python_module_gets_the_same_digits() {
    let Some(python) = python_with("ctypes") else { return };
    for (name, in_base) in CASES {
        let questions = asked(&arm(name), in_base);
        let mut command = Command::new(&python);
        command
            .env("PYTHONPATH", root().join("crates/kinematics/python"))
            .env("ARMCAL_KINEMATICS_LIBRARY", library_folder().join("libarmcal_kinematics.so"))
            .arg("-B")
            .arg(root().join("tests/python/evaluate.py"))
            .arg(model_file(name))
            .arg(if in_base { "base" } else { "world" });
        let (found, said) = answers(&mut command, &questions.text);
        assert_same(&found, &questions.answers, name);
        for words in [
            "error 2: reading model.json",
            "there is no tip `no such tip`",
            "give a mass in kg",
            "away from it",
            "not later than the one before",
        ] {
            assert!(said.contains(words), "{words}: {said}");
        }
    }
}

/// ctypes lets threads run during a call: a motion that two of them have must not be in two calls at once.
#[test]
fn the_python_module_survives_threads() {
    let Some(python) = python_with("ctypes") else { return };
    let output = Command::new(&python)
        .env("PYTHONPATH", root().join("crates/kinematics/python"))
        .env("ARMCAL_KINEMATICS_LIBRARY", library_folder().join("libarmcal_kinematics.so"))
        .arg("-B")
        .arg(root().join("tests/python/threads.py"))
        .arg(model_file(CASES[0].0))
        .output()
        .expect("starting Python");
    assert!(output.status.success(), "{:?} {}", output.status, String::from_utf8_lossy(&output.stderr));
}

/// The header, the library and the Python module name the same functions, and the library needs no other.
#[test]
fn the_library_is_what_its_header_says() {
    let source = root().join("crates/kinematics");
    let read = |file: &str| std::fs::read_to_string(source.join(file)).expect("a source file");
    let (header, module) =
        (read("include/armcal_kinematics.h"), read("python/armcal_kinematics/__init__.py"));
    let code = read("src/c_abi.rs");
    let defined: Vec<&str> = code
        .split("extern \"C\" fn armcal_")
        .skip(1)
        .map(|rest| rest.split('(').next().expect("a name"))
        .collect();
    assert_eq!(header.matches(");\n").count(), defined.len(), "the header declares others");
    for name in &defined {
        assert!(header.contains(&format!("armcal_{name}(")), "the header lacks armcal_{name}");
        assert!(
            module.contains(&format!("(\"{name}\", ")) || module.contains(&format!("\"{name}\",\n")),
            "Python lacks {name}"
        );
    }
    let library = library_folder().join("libarmcal_kinematics.so");
    let Ok(needs) = Command::new("ldd").arg(&library).output() else {
        return skip("no ldd to list what the library needs");
    };
    let needs = String::from_utf8_lossy(&needs.stdout).into_owned();
    let known = ["linux-vdso", "linux-gate", "libgcc_s.", "libm.", "libc.", "ld-linux"];
    let other: Vec<&str> =
        needs.lines().filter(|line| !known.iter().any(|name| line.contains(name))).collect();
    assert!(other.is_empty() && needs.contains("libc."), "{needs}");
}
