//! What several end-to-end tests share.

pub mod browser;
pub mod conformance;
pub mod damage;
pub mod slurm;
pub mod world;

use serde_json::Value;
pub use skipped_tests::skip;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// The repository.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().expect("the repository's root")
}

/// The folder of real recordings beside the repository, if this machine has it; without it the test is skipped.
#[track_caller]
pub fn real_recordings() -> Option<PathBuf> {
    let shared = root().join("../shared/real");
    if shared.is_dir() {
        return Some(shared);
    }
    skip("no real recordings in ../shared/real beside the repository");
    None
}

/// A Python with the packages that read results back: `$ARMCAL_PYTHON`, else `python3`; without it the test is skipped.
#[track_caller]
pub fn python() -> Option<PathBuf> {
    python_with("scipy, numpy, mcap, mcap_ros2, mcap_protobuf")
}

/// A Python that can import these packages of `tests/requirements.txt`; without it the test is skipped.
#[track_caller]
pub fn python_with(packages: &str) -> Option<PathBuf> {
    let python = PathBuf::from(std::env::var_os("ARMCAL_PYTHON").unwrap_or_else(|| "python3".into()));
    let import = format!("import {packages}");
    if Command::new(&python).args(["-c", &import]).output().is_ok_and(|o| o.status.success()) {
        return Some(python);
    }
    skip(&format!("{} lacks {packages} of tests/requirements.txt; set ARMCAL_PYTHON", python.display()));
    None
}

/// A text in one line, however it was wrapped.
pub fn in_one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Runs `armcal` and returns what it said.
pub fn armcal<I: IntoIterator<Item = S>, S: AsRef<std::ffi::OsStr>>(args: I) -> Output {
    Command::new(env!("CARGO_BIN_EXE_armcal")).args(args).output().expect("starting armcal")
}

/// Runs `armcal`, expects success, and returns every file it left in `out`, by name.
pub fn files_made(command: &mut Command, out: &Path) -> BTreeMap<String, Vec<u8>> {
    let output = command.arg("--out").arg(out).output().expect("starting armcal");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let entries = std::fs::read_dir(out).expect("results folder");
    entries
        .map(|entry| {
            let path = entry.expect("entry").path();
            let name = path.file_name().expect("name").to_string_lossy().into_owned();
            (name, std::fs::read(path).expect("result file"))
        })
        .collect()
}

/// Simulates a laboratory into a folder; `more` arguments.
pub fn simulate(lab: &Path, out: &Path, more: &[&str]) {
    let own = [Path::new("simulate"), lab, Path::new("--out"), out].map(Path::as_os_str);
    let output = armcal(own.into_iter().chain(more.iter().map(std::ffi::OsStr::new)));
    assert!(output.status.success(), "{}: {}", lab.display(), String::from_utf8_lossy(&output.stderr));
}

/// The text of a shipped pipeline or laboratory, usable from any folder: its files are found where they are.
pub fn shipped(name: &str) -> String {
    let file = root().join("pipelines").join(name);
    let text = std::fs::read_to_string(&file).expect("a shipped file");
    let folder = file.parent().expect("its folder").display().to_string();
    ["../", "boards/", "models/"]
        .iter()
        .fold(text, |text, beside| text.replace(&format!("\"{beside}"), &format!("\"{folder}/{beside}")))
}

/// The same, its recordings of the paper's rig looked for in `recordings`.
fn shipped_on(name: &str, recordings: &Path) -> String {
    let fixtures = format!("\"{}/../fixtures/paper/", root().join("pipelines").display());
    shipped(name).replace(&fixtures, &format!("\"{}/", recordings.display()))
}

/// The text of `pipelines/paper.toml`, usable from any folder, its recordings looked for in `recordings`.
pub fn paper_pipeline(recordings: &Path) -> String {
    shipped_on("paper.toml", recordings)
}

/// The text of `pipelines/paper-normal.toml` without its diagnosis, usable from any folder, its recording looked for in
/// `recordings`.
pub fn quick_pipeline(recordings: &Path) -> String {
    shipped_on("paper-normal.toml", recordings) + "\n[diagnosis]\nenabled = false\n"
}

/// Runs a pipeline; panics with its words unless it exits with one of `codes`. Returns `summary.json`.
pub fn run_pipeline(pipeline: &Path, out: &Path, codes: &[i32]) -> Value {
    let output = armcal([Path::new("run"), pipeline, Path::new("--out"), out]);
    let code = output.status.code().unwrap_or(-1);
    assert!(
        codes.contains(&code),
        "armcal run {} exited with {code}\n{}\n{}",
        pipeline.display(),
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
    let summary = read_json(&out.join("summary.json"));
    believable(&summary, &pipeline.display().to_string());
    summary
}

/// The summary of a shipped pipeline as it is, which several tests ask about: run once. Exit code 3 is allowed, as of a model that
/// is said to be inadequate.
pub fn run_as_shipped(name: &str) -> Value {
    static SUMMARIES: Mutex<BTreeMap<String, Arc<OnceLock<Value>>>> = Mutex::new(BTreeMap::new());
    let own = {
        let mut all = SUMMARIES.lock().unwrap_or_else(PoisonError::into_inner);
        all.entry(name.to_owned()).or_default().clone()
    };
    let run = || {
        let out = tempfile::tempdir().expect("temporary folder");
        run_pipeline(&root().join("pipelines").join(name), out.path(), &[0, 3])
    };
    own.get_or_init(run).clone()
}

/// The law of the verdict, held over everything that any test runs: *nothing is missing* never stands above 1.5 times the
/// floor, and no result is called adequate above twice the floor unless what was found explains half of what is beyond it. The first
/// explanation told is the answer.
pub fn believable(summary: &Value, what: &str) {
    let floors = |error: &str, floor: &str| {
        let at = |pointer| summary.pointer(pointer).and_then(Value::as_f64);
        at(error).zip(at(floor)).map(|(error, floor)| error / floor)
    };
    let mm = |pointer| summary.pointer(pointer).and_then(Value::as_f64);
    let expected_mm = mm("/diagnosis/floor_mm");
    let errors_mm =
        mm("/diagnosis/holdout_mm/before").zip(mm("/diagnosis/holdout_mm/after")).zip(expected_mm);
    if let (Some(((before, _), expected)), "nothing_missing") =
        (errors_mm, text(summary, "/diagnosis/verdict"))
    {
        assert!(before <= 1.5 * expected, "{what}: nothing is missing at {:.2} floors", before / expected);
    }
    if let Some(first) = summary.pointer("/diagnosis/names/0").and_then(Value::as_str) {
        let told = text(summary, "/diagnosis/candidates/0/spec");
        assert!(told.split('+').any(|name| name == first), "{what}: {first} is named, {told} stands first");
    }
    let understood = errors_mm.is_some_and(|((before, after), expected)| {
        let beyond = before.powi(2) - expected.powi(2);
        after <= 1.5 * expected || before.powi(2) - after.powi(2) >= 0.5 * beyond
    });
    let of = |side: &str| floors(&format!("/fit/{side}/fitted_mm/mean"), "/fit/noise_floor_mm");
    let held_out = summary.pointer("/fit/holdout/n").and_then(Value::as_u64) > Some(0);
    let named = ["identified", "ambiguous", "unknown"].contains(&text(summary, "/diagnosis/verdict"));
    let judged = match (held_out, named) {
        (true, false) => of("holdout"),
        (true, true) => of("holdout").zip(of("train")).map(|(a, b)| a.min(b)),
        (false, _) => of("train"),
    };
    if let (Some(floors), "ok") = (judged, text(summary, "/status")) {
        assert!(floors <= 2.0 || understood, "{what}: adequate at {floors:.2} floors");
    }
}

fn text<'a>(value: &'a Value, pointer: &str) -> &'a str {
    value.pointer(pointer).and_then(Value::as_str).unwrap_or_default()
}

/// Reads a JSON file.
pub fn read_json(path: &Path) -> Value {
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    serde_json::from_str(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// A number at a JSON pointer.
pub fn number(value: &Value, pointer: &str) -> f64 {
    value.pointer(pointer).and_then(Value::as_f64).unwrap_or_else(|| panic!("no number at {pointer}"))
}

/// A library that fails a call of the system in a program, made at `library`: see `failing_calls.c`. `None`, which is said, where
/// the machine cannot make one.
pub fn failing_calls(library: &Path) -> Option<PathBuf> {
    let source = root().join("tests/support/failing_calls.c");
    let mut compile = std::process::Command::new("cc");
    let made = compile.args(["-shared", "-fPIC", "-o"]).arg(library).arg(source).arg("-ldl").status();
    if !made.is_ok_and(|status| status.success()) {
        skip("this machine has no C compiler for x86-64 Linux");
        return None;
    }
    Some(library.to_owned())
}
