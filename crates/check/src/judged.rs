//! All limits of a pipeline, judged.

use super::limits::Limits;
use super::measured::Check;
use super::numbers;
use super::reference::Calibrated;
use super::told::{Told, all_warnings};
use super::{frame_shifts, shifts, verdict};
use crate::error::CheckError;
use armcal_core::Severity;
use armcal_core::printable_name;
use armcal_diagnose::Verdict;
use armcal_result::{Run, VERSION};
use serde::Serialize;

/// Version of the JSON.
pub const SCHEMA: &str = "armcal.check/1";

/// The result of all checks.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Judged {
    schema: &'static str,
    version: &'static str,
    /// Name of the pipeline.
    pub pipeline: String,
    /// The answer.
    pub judgement: Judgement,
    /// The answer in one line.
    pub line: String,
    /// One a limit, in the order of the keys' documentation.
    pub checks: Vec<Check>,
    /// Warnings that make a result doubtful and that no limit of `max_warnings` speaks of.
    pub doubts: Vec<String>,
}

/// The answer, and with it the exit code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Judgement {
    /// Every limit holds: 0.
    Holds,
    /// Every limit holds, but there are doubts: 3.
    CompletedWithWarnings,
    /// A limit is broken: 1.
    LimitExceeded,
}

/// Judges a diagnosed run.
pub fn judge(run: &Run, limits: &Limits) -> Result<Judged, CheckError> {
    let mut checks = numbers::check_errors(run, limits);
    checks.extend(numbers::check_dwells(run, limits));
    checks.extend(verdict::check_verdict(run, limits));
    checks.extend(numbers::check_warnings(run, limits));
    if limits.reference.is_some() {
        let now = Calibrated::of(run)?;
        checks.extend(shifts::check_parameter_shifts(run, &now, limits));
        checks.extend(frame_shifts::frame_shifts(run, &now, limits));
    }
    let doubts = unlimited_warnings(run, limits);
    let judgement = match (checks.iter().all(|c| c.holds), doubts.is_empty()) {
        (false, _) => Judgement::LimitExceeded,
        (true, false) => Judgement::CompletedWithWarnings,
        (true, true) => Judgement::Holds,
    };
    let line = summary_line(run, &checks, &doubts);
    let pipeline = run.pipeline_name.clone();
    Ok(Judged { schema: SCHEMA, version: VERSION, pipeline, judgement, line, checks, doubts })
}

/// A limit on the number of warnings of a severity says how many are accepted; only the others are doubts.
fn unlimited_warnings(run: &Run, limits: &Limits) -> Vec<String> {
    let most = limits.section.max_warnings.unwrap_or_default();
    let doubtful = |w: &Told| w.severity > Severity::Notice && most.of(w.severity).is_none();
    all_warnings(run).into_iter().filter(doubtful).map(|w| w.text).collect()
}

/// `paper: 7 of 7 checks hold; held out 0.13 mm (floor 0.13), nothing missing`.
fn summary_line(run: &Run, checks: &[Check], doubts: &[String]) -> String {
    let held = checks.iter().filter(|c| c.holds).count();
    let broken: Vec<&str> = checks.iter().filter(|c| !c.holds).map(|c| c.name.as_str()).collect();
    let broken = if broken.is_empty() { String::new() } else { format!(", broken: {}", broken.join(", ")) };
    let stats = run.calibration.holdout.fitted;
    let floor_mm = run.calibration.noise_floor_m * 1e3;
    let error = match stats.n {
        0 => "nothing held out".to_owned(),
        _ => format!("held out {:.2} mm (floor {floor_mm:.2})", stats.mean_m * 1e3),
    };
    let doubts = match doubts.len() {
        0 => String::new(),
        1 => "; 1 warning makes it doubtful".to_owned(),
        n => format!("; {n} warnings make it doubtful"),
    };
    let missing = missing_effects_text(run, held == checks.len());
    printable_name(&format!(
        "{}: {held} of {} checks hold{broken}; {error}, {missing}{doubts}",
        run.pipeline_name,
        checks.len()
    ))
}

/// What the diagnosis says. Beside a broken limit `nothing missing` would read as a contradiction: it is about effects.
fn missing_effects_text(run: &Run, all_hold: bool) -> String {
    match &run.diagnosis {
        None => {
            run.setup.mistakes().next().map_or("not diagnosed".to_owned(), |f| format!("setup: {}", f.code))
        }
        Some(d) => match d.verdict {
            Verdict::NothingMissing if all_hold => "nothing missing".to_owned(),
            Verdict::NothingMissing => "no effect found missing".to_owned(),
            Verdict::Identified => run.in_words(&format!("missing {}", d.names.join(", "))),
            Verdict::Ambiguous => {
                let sets = d.effects.iter().map(|e| e.set.join(" or ")).collect::<Vec<_>>();
                run.in_words(&format!("missing {}", sets.join(", and ")))
            }
            Verdict::Unknown => "something unlisted missing".to_owned(),
            Verdict::Unexplained => {
                format!("unexplained at {:.1} times the floor", run.calibration.times_floor())
            }
        },
    }
}
