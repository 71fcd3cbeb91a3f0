//! Milestones and warnings as `foxglove.Log`.

use super::{Messages, run_end_ns, run_start_ns, start_ns, timestamp};
use crate::findings::Findings;
use armcal_core::{DwellId, Severity, Stage, Warning};
use armcal_result::{Run, VERSION};
use armcal_wording::conclusion;
use foxglove::messages as fox;
use foxglove::messages::log::Level;
use std::collections::BTreeMap;

const TOPIC: &str = "/armcal/log";

pub(super) fn put_milestones(run: &Run, findings: &Findings, out: &mut Messages) {
    let begin_ns = run_start_ns(run);
    let opening = format!("armcal {VERSION}, pipeline {}", run.pipeline_name);
    put_line(out, begin_ns, Level::Info, "armcal", &run.pipeline_name, opening);
    let names = run.recording_names();
    for warning in run.overall_warnings() {
        put_warning(out, begin_ns, &names.warning(&warning));
    }
    for recording in &run.recordings {
        let start_ns = start_ns(recording);
        let found = format!(
            "{}: {} dwells, {} associated, {} rejected",
            recording.name,
            recording.found(),
            run.associated(recording),
            recording.rejected()
        );
        put_line(out, start_ns, Level::Info, "armcal.dwell", &recording.name, found);
        for warning in recording.all_warnings() {
            put_warning(out, start_ns, &names.warning(warning));
        }
        let mid_ns: BTreeMap<DwellId, i64> = recording.dwells.iter().map(|d| (d.id, d.mid_ns())).collect();
        for rejection in &recording.rejections {
            let time_ns = mid_ns.get(&rejection.dwell).copied().unwrap_or(start_ns);
            let why = format!("dwell {} not used: {}", rejection.dwell.dwell, rejection.why);
            put_line(out, time_ns, Level::Debug, "armcal.dwell", &recording.name, why);
        }
    }
    put_line(out, run_end_ns(run), Level::Info, "armcal.calibrate", "", conclusion(&run.calibration));
    put_verdict(run_end_ns(run), findings, out);
}

/// What the diagnosis says, what each step brought, and what to record next.
fn put_verdict(time_ns: i64, findings: &Findings, out: &mut Messages) {
    let Some((diagnosis, _)) = &findings.diagnosis else { return };
    let mut say =
        |level, subject: &str, words| put_line(out, time_ns, level, "armcal.diagnose", subject, words);
    let level = if diagnosis.verdict == "nothing_missing" { Level::Info } else { Level::Warning };
    say(level, &diagnosis.verdict, diagnosis.sentence.clone());
    for step in findings.steps.steps.iter().skip(2) {
        let falls = format!(
            "with {} the mean error is {:.3} mm ({:.1} % less)",
            step.adds, step.mean_mm, step.falls_by_percent
        );
        say(Level::Info, &step.adds, falls);
    }
    for next in &diagnosis.record_next {
        say(Level::Info, "record next", next.clone());
    }
}

/// A warning as a line of the log.
pub(super) fn put_warning(out: &mut Messages, time_ns: i64, warning: &Warning) {
    let level = match warning.severity {
        Severity::Notice => Level::Info,
        Severity::Inadequate => Level::Warning,
        Severity::DataLost => Level::Error,
    };
    let name = match warning.stage {
        Stage::Recording => "armcal.recording",
        Stage::Dwell => "armcal.dwell",
        Stage::Table => "armcal.table",
        Stage::Setup => "armcal.setup",
        Stage::Calibrate => "armcal.calibrate",
        Stage::Diagnose => "armcal.diagnose",
        Stage::Output => "armcal.report",
    };
    let message = format!("{warning} [{}]", warning.code);
    put_line(out, time_ns, level, name, &warning.subject, message);
}

/// `subject` goes where a log has its source file: the thing the message is about.
pub(super) fn put_line(
    out: &mut Messages,
    time_ns: i64,
    level: Level,
    name: &str,
    subject: &str,
    message: String,
) {
    let log = fox::Log {
        timestamp: Some(timestamp(time_ns)),
        level: level as i32,
        message,
        name: name.into(),
        file: subject.into(),
        line: 0,
    };
    out.put(TOPIC, time_ns, &log);
}
