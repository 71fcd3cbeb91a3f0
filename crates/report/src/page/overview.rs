//! The page of a calibration without a diagnosis: of a pool.
//!
//! It says what [`Overview`] holds, in the frame and with the scripts of all pages.

use super::embed;
use super::groups::{Group, Table};
use super::numbers::Column;
use super::shell::Shell;
use super::shown::{ParameterRow, parameter};
use crate::ReportError;
use crate::recorded_time::RecordedTime;
use crate::story::Story;
use crate::terminal::summarised;
use crate::text::millimetres;
use crate::told_warning::ToldWarning;
use armcal_calibrate::{Calibration, Estimate, Residual, SideErrors, independent_groups};
use armcal_core::ErrorStats;
use askama::Template;
use serde::Serialize;

/// Dwells drawn over time; more are thinned out evenly.
const MOST_POINTS: usize = 5000;
/// Recordings whose means are drawn, and parameters of single recordings that are listed; files for programs have all.
const MOST_ROWS: usize = 200;

/// What the page shows.
pub(crate) struct Overview<'a> {
    pub pipeline: &'a str,
    pub pipeline_text: &'a str,
    /// What was calibrated, in a few words.
    pub about: String,
    /// What an error is: `position error`, `closing error`.
    pub error: &'static str,
    pub story: Story,
    pub calibration: &'a Calibration,
    /// The same observations by calibrations that never saw their recording, where there are any.
    pub unseen: Option<&'a Calibration>,
    /// In the order of the calibration's residuals.
    pub dwells: Vec<DwellPlace>,
    pub recordings: Vec<RecordingLine>,
    /// Parameters that all recordings share, and those of single ones.
    pub shared: Vec<&'a Estimate>,
    pub own: Vec<&'a Estimate>,
}

/// Where a dwell belongs.
pub(crate) struct DwellPlace {
    pub time_ns: i64,
    pub cavity: Option<String>,
}

/// One recording in the table of what the data are.
pub(crate) struct RecordingLine {
    pub name: String,
    pub dwells: usize,
    pub used: usize,
    /// What was left out, and why.
    pub left_out: String,
    pub files: Vec<(String, String)>,
}

#[derive(Template)]
#[template(path = "overview.html")]
struct OverviewPage<'a> {
    shell: Shell,
    of: &'a Overview<'a>,
    errors: Vec<[String; 7]>,
    parameters: Vec<ParameterRow>,
    own: Vec<ParameterRow>,
    more_own: usize,
    summary: String,
    next: &'a [String],
    warnings: &'a [ToldWarning],
}

/// The page.
///
/// # Errors
/// A template or document that cannot be written.
pub(crate) fn overview_html(of: &Overview) -> Result<String, ReportError> {
    let scripts = [embed::TEXT, embed::CHART, embed::TIME, include_str!("assets/overview.js")];
    let names = (of.pipeline.to_owned(), format!("{} · {}", of.pipeline, of.about));
    let shell = Shell::new("overview-page", names, &scripts, &Document::of(of), "'none'")?;
    let free = |all: &[&Estimate]| -> Vec<ParameterRow> {
        all.iter().filter(|e| e.parameter.free).map(|e| parameter(e)).collect()
    };
    let mut own = free(&of.own);
    let more_own = own.len().saturating_sub(MOST_ROWS);
    own.truncate(MOST_ROWS);
    let page = OverviewPage {
        shell: shell.telling(&of.story),
        errors: error_rows(of),
        parameters: free(&of.shared),
        own,
        more_own,
        summary: summarised(of.calibration).unwrap_or_default(),
        next: &of.story.next,
        warnings: &of.story.warnings,
        of,
    };
    Ok(page.render()?)
}

/// Points, n, parameters, mean, RMS, 95th percentile and largest error, as the terminal has them.
fn error_rows(of: &Overview) -> Vec<[String; 7]> {
    let sides = [("seen by the fit", &of.calibration.train), ("held out", &of.calibration.holdout)];
    let unseen = of.unseen.map(|c| ("recordings never seen", &c.holdout));
    let row = |points: &str, parameters: &str, e: &ErrorStats| {
        let [mean, rms, p95, max] = [e.mean_m, e.rms_m, e.p95_m, e.max_m].map(millimetres);
        [points.to_owned(), e.n.to_string(), parameters.to_owned(), mean, rms, p95, max]
    };
    let rows = |(points, side): (&str, &SideErrors)| {
        [row(points, "nominal", &side.nominal), row(points, "calibrated", &side.fitted)]
    };
    sides.into_iter().chain(unseen).filter(|(_, side)| side.fitted.n > 0).flat_map(rows).collect()
}

/// What the page's script draws.
#[derive(Serialize)]
struct Document<'a> {
    error: &'static str,
    recordings: Vec<&'a str>,
    begin_min: Column,
    noise_floor_mm: Option<f64>,
    dwells: Dwells,
    /// Mean errors of each recording, by whose parameters they are.
    groups: Vec<Group>,
}

/// Columns over dwells.
#[derive(Serialize)]
struct Dwells {
    recording: Vec<usize>,
    dwell: Vec<usize>,
    held_out: Vec<u8>,
    time_min: Column,
    nominal_mm: Column,
    fitted_mm: Column,
}

impl<'a> Document<'a> {
    fn of(of: &'a Overview<'a>) -> Document<'a> {
        let residuals = &of.calibration.residuals;
        let times = || residuals.iter().zip(&of.dwells).map(|(r, d)| (r.dwell.recording, d.time_ns));
        let time = RecordedTime::of_times(times(), of.recordings.len());
        let stride = residuals.len().div_ceil(MOST_POINTS).max(1);
        let drawn = || residuals.iter().step_by(stride);
        Document {
            error: of.error,
            recordings: of.recordings.iter().map(|r| r.name.as_str()).collect(),
            begin_min: time.begins(),
            noise_floor_mm: Some(of.calibration.noise_floor_m * 1e3).filter(|mm| mm.is_finite()),
            dwells: Dwells {
                recording: drawn().map(|r| r.dwell.recording).collect(),
                dwell: drawn().map(|r| r.dwell.dwell).collect(),
                held_out: drawn().map(|r| u8::from(r.held_out)).collect(),
                time_min: Column::of_all(times().step_by(stride).map(|(r, ns)| time.time_min(r, ns))),
                nominal_mm: Column::of_all(drawn().map(|r| r.nominal_m.norm() * 1e3)),
                fitted_mm: Column::of_all(drawn().map(|r| r.fitted_m.norm() * 1e3)),
            },
            groups: groups(of),
        }
    }
}

/// Means by recording, on the points by which the calibration is judged.
fn groups(of: &Overview) -> Vec<Group> {
    let judged = |c: &Calibration, norm: fn(&Residual) -> f64| -> Vec<Option<f64>> {
        let held_out = c.held_out();
        c.residuals.iter().map(|r| (r.held_out == held_out).then(|| norm(r) * 1e3)).collect()
    };
    let mut kinds = vec![
        ("nominal", judged(of.calibration, |r| r.nominal_m.norm())),
        ("calibrated", judged(of.calibration, |r| r.fitted_m.norm())),
    ];
    kinds.extend(of.unseen.map(|c| ("never seen", judged(c, |r| r.fitted_m.norm()))));
    let residuals = &of.calibration.residuals;
    let dwells: Vec<(String, Option<&str>)> =
        residuals.iter().zip(&of.dwells).map(|(r, d)| (r.dwell.to_string(), d.cavity.as_deref())).collect();
    let places = independent_groups(&dwells);
    let of_kind = |(by, error_mm): &(&'static str, Vec<Option<f64>>)| -> Vec<Group> {
        let table = Table { places: places.clone(), error_mm };
        let own = |(at, r): (usize, &RecordingLine)| {
            table.group(by, r.name.clone(), |i| residuals[i].dwell.recording == at)
        };
        of.recordings.iter().enumerate().take(MOST_ROWS).filter_map(own).collect()
    };
    kinds.iter().flat_map(of_kind).collect()
}
