//! The program itself on one session, and what it said.

use crate::{Error, Session};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Longest run: what takes longer is a case that did not end.
const LONGEST: Duration = Duration::from_secs(600);

/// Where a statement stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Place {
    /// `setup.findings` of `summary.json`.
    Setup,
    /// `warnings` there, of the run or of a recording.
    Warning,
    /// The error message.
    Error,
}

/// One statement of the program.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Statement {
    /// Where it stands.
    pub place: Place,
    /// Its code; empty in an error message.
    pub code: String,
    /// Subject and message.
    pub text: String,
}

/// What the program said.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Said {
    /// Exit code; none if it was stopped, or ended by a signal.
    pub exit: Option<i32>,
    /// Mean error on held-out points [mm].
    pub held_out_mm: Option<f64>,
    /// Noise floor [mm].
    pub floor_mm: Option<f64>,
    /// Verdict of the diagnosis.
    pub verdict: Option<String>,
    /// Effects that the verdict names.
    pub effects: Vec<String>,
    /// Statements about the setup, warnings, and the error message.
    pub statements: Vec<Statement>,
}

impl Said {
    /// Held-out error over the floor.
    pub fn ratio(&self) -> Option<f64> {
        Some(self.held_out_mm? / self.floor_mm?)
    }

    /// Whether the verdict names physical effects.
    pub fn names(&self) -> bool {
        matches!(self.verdict.as_deref(), Some("identified" | "ambiguous"))
    }

    /// Reads `summary.json`.
    pub fn of_summary(summary: &Value) -> Said {
        let number = |pointer: &str| summary.pointer(pointer).and_then(Value::as_f64);
        let side = |side: &str| number(&format!("/fit/{side}/fitted_mm/mean"));
        let list =
            |pointer: &str| summary.pointer(pointer).and_then(Value::as_array).cloned().unwrap_or_default();
        let mut said = Said {
            held_out_mm: side("holdout").or_else(|| side("train")),
            floor_mm: number("/fit/noise_floor_mm"),
            verdict: summary.pointer("/diagnosis/verdict").and_then(Value::as_str).map(str::to_owned),
            ..Said::default()
        };
        let named = list("/diagnosis/names").into_iter().chain(list("/diagnosis/effects"));
        said.effects = named.flat_map(|entry| strings(&entry)).collect();
        said.statements.extend(list("/setup/findings").iter().map(|f| read_statement(Place::Setup, f)));
        said.statements.extend(list("/warnings").iter().map(|w| read_statement(Place::Warning, w)));
        for recording in list("/recordings") {
            let warnings = recording.get("warnings").and_then(Value::as_array).cloned().unwrap_or_default();
            said.statements.extend(warnings.iter().map(|w| read_statement(Place::Warning, w)));
        }
        said
    }
}

/// Every string within a value: the names in an effect's set, however they are laid out.
fn strings(value: &Value) -> Vec<String> {
    match value {
        Value::String(text) => vec![text.clone()],
        Value::Array(items) => items.iter().flat_map(strings).collect(),
        Value::Object(entry) => entry.get("set").map(strings).unwrap_or_default(),
        _ => Vec::new(),
    }
}

fn read_statement(place: Place, value: &Value) -> Statement {
    let text = |key: &str| value.get(key).and_then(Value::as_str).unwrap_or_default().to_owned();
    Statement { place, code: text("code"), text: format!("{}: {}", text("subject"), text("message")) }
}

/// Writes a session to `folder` and runs the program `armcal` on it, with one thread.
pub fn run(armcal: &Path, session: &Session, folder: &Path) -> Result<Said, Error> {
    let pipeline = session.write(folder)?;
    let (out, errors) = (folder.join("out"), folder.join("stderr.txt"));
    let stderr = std::fs::File::create(&errors).map_err(Error::file("making", &errors))?;
    let mut child = Command::new(armcal)
        .arg("run")
        .arg(&pipeline)
        .arg("--out")
        .arg(&out)
        .env("RAYON_NUM_THREADS", "1")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(stderr)
        .spawn()
        .map_err(Error::file("starting", armcal))?;
    let begin = Instant::now();
    let status = loop {
        match child.try_wait().map_err(Error::file("waiting for", armcal))? {
            Some(status) => break Some(status),
            None if begin.elapsed() > LONGEST => {
                // It is gone already, or goes now: both are fine.
                let _ = child.kill();
                let _ = child.wait();
                break None;
            }
            None => std::thread::sleep(Duration::from_millis(20)),
        }
    };
    let exit = status.and_then(|status| status.code());
    let mut said = match std::fs::read(out.join("summary.json")).map(|bytes| serde_json::from_slice(&bytes)) {
        Ok(Ok(summary)) => Said::of_summary(&summary),
        _ => Said::default(),
    };
    if !matches!(exit, Some(0 | 3)) {
        let text = std::fs::read(&errors).map_err(Error::file("reading", &errors))?;
        let text = String::from_utf8_lossy(&text).replace(&*folder.to_string_lossy(), "");
        said.statements.push(Statement { place: Place::Error, code: codes_in_brackets(&text), text });
    }
    Ok(Said { exit, ..said })
}

/// The codes of findings that an error message names, in brackets: `[joint-order]`. A section of a file has no hyphen.
fn codes_in_brackets(text: &str) -> String {
    let inside = text.split('[').skip(1).filter_map(|rest| rest.split_once(']').map(|(inside, _)| inside));
    let code = |s: &&str| s.contains('-') && s.chars().all(|c| c.is_ascii_lowercase() || c == '-');
    inside.filter(code).collect::<Vec<_>>().join(" ")
}

/// The program beside this one, as cargo puts them.
pub fn beside_this() -> Option<PathBuf> {
    let this = std::env::current_exe().ok()?;
    let name = format!("armcal{}", std::env::consts::EXE_SUFFIX);
    this.ancestors().skip(1).take(2).map(|folder| folder.join(&name)).find(|path| path.is_file())
}
