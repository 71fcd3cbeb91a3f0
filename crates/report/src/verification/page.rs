//! The page of `armcal verify`: the tables, and the source paper's figures 6, 7 and 10 for the longest motions.

use super::row::Row;
use super::terminal::verification_conclusion;
use super::{iso, no_criteria, points_are};
use crate::ReportError;
use crate::page::embed;
use crate::page::shell::Shell;
use armcal_result::{PathSample, RecordingNames, Verification};
use armcal_verify::{Against, PathRow, PointsRow};
use armcal_wording::{ToldWarning, gravest_first, status_sentence};
use askama::Template;
use nalgebra::Vector3;
use serde_json::{Value, json};

/// Motions drawn, and points of each: enough to see a path, few enough to open at once.
const MOTIONS: usize = 12;
const POINTS: usize = 400;

/// A verification as one offline HTML page.
///
/// # Errors
/// A template or document that cannot be written.
pub fn verification_html(v: &Verification) -> Result<String, ReportError> {
    let effects =
        if v.effects.is_empty() { " alone".to_owned() } else { format!(", {}", v.effects.join(", ")) };
    let names = (format!("{}, verified", v.pipeline), format!("{} · model: geometry{effects}", v.pipeline));
    let scripts = [embed::TEXT, embed::CHART, include_str!("../page/assets/verified.js")];
    // What the page's script draws.
    let document = json!({ "motions": longest_motions(&v.samples) });
    let shell = Shell::new("verification-page", names, &scripts, &document)?;
    let recordings = RecordingNames::new(v.recordings.iter().map(|r| r.name.clone()));
    let told = v.warnings.iter().map(|w| ToldWarning::new(&recordings, None, w)).collect();
    let page = VerificationPage {
        shell: Shell {
            status: Some((v.status(), status_sentence(v.status()).to_owned())),
            ..shell.saying(verification_conclusion(v))
        },
        tables: vec![
            (points_are(v), v.points.iter().map(point_row).collect()),
            ("Error along paths", v.paths.iter().map(path_row).collect()),
        ],
        iso_none: no_criteria(v),
        iso_header: iso::HEADER,
        iso_rows: iso::rows(&v.iso9283),
        iso_remarks: iso::remarks(&v.iso9283),
        warnings: gravest_first(told),
    };
    Ok(page.render()?)
}

#[derive(Template)]
#[template(path = "verification.html")]
struct VerificationPage {
    shell: Shell,
    tables: Vec<(&'static str, Vec<Shown>)>,
    iso_none: &'static str,
    iso_header: [&'static str; 9],
    iso_rows: Vec<[String; 9]>,
    iso_remarks: Vec<String>,
    warnings: Vec<ToldWarning>,
}

/// A row as the page shows it: a mean and its interval in one cell.
struct Shown {
    subject: String,
    n: usize,
    before: String,
    after: String,
    difference: String,
    better: String,
}

fn point_row(r: &PointsRow) -> Shown {
    Shown::from(Row::of_points(r))
}

fn path_row(r: &PathRow) -> Shown {
    let against = match r.against {
        Against::Encoders => "at each moment",
        Against::Planned => "from the planned path",
    };
    let row = Row::of_path(r);
    Shown::from(Row { subject: format!("{}, {against}", row.subject), ..row })
}

impl From<Row> for Shown {
    fn from(row: Row) -> Shown {
        let with_half = |[mean, half]: [String; 2]| {
            if half.is_empty() { mean } else { format!("{mean} ± {half}") }
        };
        let [low, high] = row.difference;
        Shown {
            subject: row.subject,
            n: row.n,
            before: with_half(row.before),
            after: with_half(row.after),
            difference: if low.is_empty() { "–".into() } else { format!("{low} to {high}") },
            better: row.better,
        }
    }
}

/// The longest motions, the longest first, thinned evenly.
fn longest_motions(samples: &[PathSample]) -> Value {
    let same = |a: &PathSample, b: &PathSample| a.recording == b.recording && a.motion == b.motion;
    let length_m = |motion: &[PathSample]| -> f64 {
        motion.windows(2).map(|w| (w[1].calibrated_m - w[0].calibrated_m).norm()).sum()
    };
    let mut all: Vec<&[PathSample]> = samples.chunk_by(same).filter(|m| m.len() > 2).collect();
    all.sort_by(|a, b| length_m(b).total_cmp(&length_m(a)));
    all.into_iter().take(MOTIONS).map(motion_json).collect()
}

/// One motion, in millimetres and seconds.
fn motion_json(motion: &[PathSample]) -> Value {
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
    json!({
        "name": format!("{}, motion {}", motion[0].recording, motion[0].motion),
        "time_s": shown.iter().map(|s| (since_s(s) * 1e3).round() / 1e3).collect::<Value>(),
        "measured_mm": axes(|s| &s.measured_m),
        "nominal_mm": axes(|s| &s.nominal_m),
        "calibrated_mm": axes(|s| &s.calibrated_m),
        "before_mm": error(|s| &s.nominal_m),
        "after_mm": error(|s| &s.calibrated_m),
    })
}
