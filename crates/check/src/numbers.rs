//! Checks of what is counted and measured: errors on held-out points, dwells, warnings.

use super::limits::Limits;
use super::measured::Check;
use super::reasons;
use super::told::{all_warnings, listed_up};
use armcal_core::{ErrorStats, Severity, Warning, printable_name};
use armcal_result::{RecordingRun, Run};

/// Errors on points that the fit did not see.
pub fn check_errors(run: &Run, limits: &Limits) -> Vec<Check> {
    let section = &limits.section;
    let stats = run.calibration.holdout.fitted;
    let mm = |value_m: f64| (stats.n > 0).then_some(value_m * 1e3);
    let (mean_mm, p95_mm) = (mm(stats.mean_m), mm(stats.p95_m));
    let over_floor = mean_mm.map(|mean| mean / (run.calibration.noise_floor_m * 1e3));
    let by_recording = by_recording(run);
    let rows = [
        ("max_holdout_mean_mm", "mean error", mean_mm, section.max_holdout_mean_mm, "mm"),
        ("max_holdout_p95_mm", "95th percentile of the error", p95_mm, section.max_holdout_p95_mm, "mm"),
        (
            "max_over_floor",
            "ratio of the mean error to the declared noise",
            over_floor,
            section.max_over_floor,
            "",
        ),
    ];
    rows.into_iter()
        .filter_map(|(name, what, measured, limit, unit)| {
            let check = Check::at_most(name, measured, limit?, unit);
            let points = format!("on {} held-out points the {what} is", stats.n);
            let said = match measured {
                Some(_) => format!("{points} {} ({by_recording})", check.measured_text()),
                None => "no point was held out of the fit, so there is no error to judge".to_owned(),
            };
            Some(check.saying(said, || reasons::of_run(run, limits)))
        })
        .collect()
}

/// `mean by recording: normal 0.13, roll 9.10 mm`, on the held-out points.
fn by_recording(run: &Run) -> String {
    let of = |(index, recording): (usize, &RecordingRun)| {
        let residuals = run.calibration.residuals.iter().filter(|r| r.held_out && r.dwell.recording == index);
        let norms_m: Vec<f64> = residuals.map(|r| r.fitted_m.norm()).collect();
        let mean_mm = ErrorStats::of_norms(&norms_m).mean_m * 1e3;
        (!norms_m.is_empty()).then(|| format!("{} {mean_mm:.2}", printable_name(&recording.name)))
    };
    let all: Vec<String> = run.recordings.iter().enumerate().filter_map(of).collect();
    format!("mean by recording: {} mm", all.join(", "))
}

/// Dwells found, and their share that the fit could not use, recording by recording.
pub fn check_dwells(run: &Run, limits: &Limits) -> Vec<Check> {
    let section = &limits.section;
    let mut checks = Vec::new();
    for recording in &run.recordings {
        let (name, found) = (printable_name(&recording.name), recording.dwells.len());
        let said = format!("`{name}` has {found} dwells");
        if let Some(least) = section.min_dwells {
            let check = Check::count(format!("min_dwells.{name}"), found, least, found >= least);
            checks.push(check.saying(said.clone(), || other_dwells(recording)));
        }
        if let Some(&exactly) = section.dwells.as_ref().and_then(|d| d.get(&recording.name)) {
            let check = Check::count(format!("dwells.{name}"), found, exactly, found == exactly);
            checks.push(check.saying(said, || other_dwells(recording)));
        }
        checks.extend(section.max_rejected_share.map(|limit| check_rejections(recording, &name, limit)));
    }
    checks
}

/// Why a recording may have another number of dwells than expected.
fn other_dwells(recording: &RecordingRun) -> Vec<String> {
    let mut why = severe_warnings(recording.all_warnings().into_iter());
    why.push(
        "Dwells were left out or added by hand, the recording is cut short, or [dwell] splits or joins them: \
         `armcal inspect` shows gaps, summary.json every dwell under `places`."
            .to_owned(),
    );
    why
}

fn check_rejections(recording: &RecordingRun, name: &str, limit: f64) -> Check {
    let (n, of) = (recording.rejections.len(), recording.dwells.len());
    let share = if of == 0 { 1.0 } else { n as f64 / of as f64 };
    let said = format!("{n} of the {of} dwells of `{name}` do not take part in the fit");
    let check = Check::at_most(&format!("max_rejected_share.{name}"), Some(share), limit, "");
    check.saying(said, || {
        let mut why: Vec<String> = Vec::new();
        for rejection in &recording.rejections {
            let sentence = format!("Dwell {}: {}.", rejection.dwell.dwell, printable_name(&rejection.why));
            why.push(sentence);
        }
        listed_up(why, "dwells")
    })
}

/// Warnings by severity.
pub fn check_warnings(run: &Run, limits: &Limits) -> Vec<Check> {
    let most = limits.section.max_warnings.unwrap_or_default();
    let all = all_warnings(run);
    let keys = [
        ("notice", Severity::Notice),
        ("inadequate", Severity::Inadequate),
        ("data_lost", Severity::DataLost),
    ];
    keys.into_iter()
        .filter_map(|(key, severity)| {
            let limit = most.of(severity)?;
            let own: Vec<String> =
                all.iter().filter(|w| w.severity == severity).map(|w| w.text.clone()).collect();
            let check = Check::count(format!("max_warnings.{key}"), own.len(), limit, own.len() <= limit);
            let said = match own.len() {
                1 => format!("1 warning of severity `{}`", severity.word()),
                n => format!("{n} warnings of severity `{}`", severity.word()),
            };
            Some(check.saying(said, || listed_up(own, "warnings")))
        })
        .collect()
}

fn severe_warnings<'w>(warnings: impl Iterator<Item = &'w Warning>) -> Vec<String> {
    let grave = warnings.filter(|w| w.severity > Severity::Notice);
    listed_up(grave.map(|w| printable_name(&format!("{w}."))).collect(), "warnings")
}
