//! The page of `armcal verify`: the tables, and the source paper's figures 6, 7 and 10 for the longest motions.

use super::terminal::conclusion;
use super::{PathSample, Verification};
use crate::ReportError;
use crate::page::embed;
use crate::run::VERSION;
use crate::text::millimetres;
use armcal_verify::{Against, By, Compared, PathRow, Plane, PointsRow};
use askama::Template;
use nalgebra::Vector3;
use serde::Serialize;

/// Motions drawn, and points of each: enough to see a path, few enough to open at once.
const MOTIONS: usize = 12;
const POINTS: usize = 400;

/// A verification as one offline HTML page.
///
/// # Errors
/// A template or document that cannot be written.
pub fn verification_html(v: &Verification) -> Result<String, ReportError> {
    let script = embed::script(&[embed::TEXT, embed::CHART, include_str!("../page/assets/verified.js")]);
    let page = VerificationPage {
        policy: embed::policy(&[embed::PLOTLY, &script], "'none'"),
        style: embed::STYLE,
        plotly: embed::PLOTLY,
        data: embed::json_for_html(&Document { motions: motions(&v.samples) })?,
        script: &script,
        version: VERSION,
        pipeline: &v.pipeline,
        effects: v.effects.join(", "),
        sentence: conclusion(v),
        tables: vec![
            ("Error at points", v.points.iter().map(point_row).collect()),
            ("Error along paths", v.paths.iter().map(path_row).collect()),
        ],
        warnings: v.warnings.iter().map(ToString::to_string).collect(),
    };
    Ok(page.render()?)
}

#[derive(Template)]
#[template(path = "verification.html")]
struct VerificationPage<'a> {
    policy: String,
    style: &'a str,
    plotly: &'a str,
    data: String,
    script: &'a str,
    version: &'a str,
    pipeline: &'a str,
    effects: String,
    sentence: String,
    tables: Vec<(&'static str, Vec<Row>)>,
    warnings: Vec<String>,
}

struct Row {
    subject: String,
    n: usize,
    before: String,
    after: String,
    difference: String,
    better: String,
}

fn point_row(r: &PointsRow) -> Row {
    let subject = match r.by {
        By::Axis => format!("along {} (signed)", r.subject),
        By::Arrival => format!("arriving {}", r.subject),
        _ => r.subject.clone(),
    };
    row(subject, &r.errors, r.by != By::Axis)
}

fn path_row(r: &PathRow) -> Row {
    let against = match r.against {
        Against::Encoders => "at each moment",
        Against::Planned => "from the planned path",
    };
    let seen = if r.plane == Plane::Space { "in space".into() } else { format!("in {}", r.plane.word()) };
    row(format!("{}, {against}, {seen}", r.subject), &r.errors, true)
}

fn row(subject: String, c: &Compared, sizes: bool) -> Row {
    let with_interval = |mean_m: f64, interval: Option<[f64; 2]>| {
        let half =
            interval.map_or(String::new(), |[low, high]| format!(" ± {}", millimetres(0.5 * (high - low))));
        format!("{}{half}", millimetres(mean_m))
    };
    Row {
        subject,
        n: c.n,
        before: with_interval(c.before.mean_m, c.before.ci95_m),
        after: with_interval(c.after.mean_m, c.after.ci95_m),
        difference: c
            .difference_ci95_m
            .map_or("–".into(), |[low, high]| format!("{} to {}", millimetres(low), millimetres(high))),
        better: if sizes { format!("{:.1} %", 100.0 * c.improvement) } else { String::new() },
    }
}

/// What the page's script draws.
#[derive(Serialize)]
struct Document {
    motions: Vec<MotionDrawn>,
}

/// One motion, in millimetres and seconds.
#[derive(Serialize)]
struct MotionDrawn {
    name: String,
    time_s: Vec<f64>,
    measured_mm: [Vec<f64>; 3],
    nominal_mm: [Vec<f64>; 3],
    calibrated_mm: [Vec<f64>; 3],
    before_mm: Vec<f64>,
    after_mm: Vec<f64>,
}

/// The longest motions, the longest first, thinned evenly.
fn motions(samples: &[PathSample]) -> Vec<MotionDrawn> {
    let same = |a: &PathSample, b: &PathSample| a.recording == b.recording && a.motion == b.motion;
    let length_m = |motion: &[PathSample]| -> f64 {
        motion.windows(2).map(|w| (w[1].calibrated_m - w[0].calibrated_m).norm()).sum()
    };
    let mut all: Vec<&[PathSample]> = samples.chunk_by(same).filter(|m| m.len() > 2).collect();
    all.sort_by(|a, b| length_m(b).total_cmp(&length_m(a)));
    all.into_iter().take(MOTIONS).map(drawn).collect()
}

fn drawn(motion: &[PathSample]) -> MotionDrawn {
    let stride = motion.len().div_ceil(POINTS).max(1);
    let shown: Vec<&PathSample> = motion.iter().step_by(stride).collect();
    // A hundredth of a millimetre is below what any of it is worth, and the page stays small.
    let round = |mm: f64| (mm * 100.0).round() / 100.0;
    let axes = |of: fn(&PathSample) -> &Vector3<f64>| {
        [0, 1, 2].map(|k| shown.iter().map(|s| round(of(s)[k] * 1e3)).collect::<Vec<f64>>())
    };
    let error = |of: fn(&PathSample) -> &Vector3<f64>| {
        shown.iter().map(|s| round((s.measured_m - of(s)).norm() * 1e3)).collect::<Vec<f64>>()
    };
    let since_s = |s: &PathSample| (s.time_ns - motion[0].time_ns) as f64 * 1e-9;
    MotionDrawn {
        name: format!("{}, motion {}", motion[0].recording, motion[0].motion),
        time_s: shown.iter().map(|s| (since_s(s) * 1e3).round() / 1e3).collect(),
        measured_mm: axes(|s| &s.measured_m),
        nominal_mm: axes(|s| &s.nominal_m),
        calibrated_mm: axes(|s| &s.calibrated_m),
        before_mm: error(|s| &s.nominal_m),
        after_mm: error(|s| &s.calibrated_m),
    }
}
