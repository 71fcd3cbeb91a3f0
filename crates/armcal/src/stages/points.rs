//! Points that a laser tracker measured while the arm stood still, as its software exports them: a CSV file beside the recording,
//! one row a dwell, in their order.
//!
//! No clock joins the two: the rows are those dwells in a row at which the nominal arm, with its base anywhere and the target
//! anywhere on its last link, comes closest to them.

use crate::error::Error;
use crate::pipeline::{PointsFile, read_text};
use crate::stages::links::place;
use armcal_core::robust::median;
use armcal_core::{Dwell, Pose, Severity, Stage, TipMeasurement, Warning};
use armcal_model::Model;
use nalgebra::{Matrix3, Vector3};
use std::path::Path;

/// A run of dwells must explain the rows so many times better than the next.
const CLEAR: f64 = 2.0;
/// Rows that are off by more than this share of how far they are apart were measured in other dwells.
const DOUBTFUL: f64 = 0.25;

/// Gives each dwell of a recording the point of its row.
pub fn add(
    points: &PointsFile,
    (path, recording): (&Path, &str),
    model: &Model,
    dwells: &mut [Dwell],
) -> Result<Warning, Error> {
    let bad = |problem: String| Error::InRecording {
        recording: recording.to_owned(),
        problem: format!("{}: {problem}", path.display()),
    };
    let rows = parse(&read_text("CSV of points", path)?, points.unit.to_m()).map_err(bad)?;
    let fit = Fit::of(&rows, model, dwells);
    let first = match points.first_dwell {
        Some(first) if first + rows.len() <= dwells.len() => first,
        Some(first) => {
            let (rows, all) = (rows.len(), dwells.len());
            let said =
                format!("{rows} rows from dwell {first} on are more than the {all} dwells of the recording");
            return Err(bad(said));
        }
        None => fit.first().map_err(bad)?,
    };
    let off_m = fit.off_m(first);
    let is_doubtful = off_m.is_finite() && off_m > DOUBTFUL * fit.spread_m();
    let variance_m2 = (points.sigma_mm * 1e-3).powi(2);
    for (dwell, row) in dwells[first..].iter_mut().zip(&rows) {
        dwell.tip = row.map(|position_m| TipMeasurement {
            position_m,
            covariance_m2: Matrix3::identity() * variance_m2,
            orientation: None,
            orientation_sigma_rad: f64::INFINITY,
            samples: 1,
            effective_samples: 1.0,
        });
    }
    let without = dwells.iter().filter(|d| d.tip.is_none()).count();
    let (rows, all, last) = (rows.len(), dwells.len(), first + rows.len() - 1);
    let (severity, doubt) = match is_doubtful {
        true => {
            (Severity::Inadequate, " only: are the rows in the order of the dwells, and is the unit right?")
        }
        false => (Severity::Notice, ""),
    };
    let fits = match off_m.is_finite() {
        true => format!("; half of them fit the nominal arm to {:.1} mm{doubt}", off_m * 1e3),
        false => String::new(),
    };
    let said = format!(
        "its {rows} rows are the dwells {first} to {last}; {without} of {all} dwells have no point{fits}"
    );
    Ok(Warning::new(severity, Stage::Dwell, "points-file", path.display().to_string(), said))
}

/// Rows, and where the nominal arm was in every dwell.
struct Fit<'a> {
    rows: &'a [Option<Vector3<f64>>],
    poses: Vec<Pose>,
}

impl Fit<'_> {
    fn of<'a>(rows: &'a [Option<Vector3<f64>>], model: &Model, dwells: &[Dwell]) -> Fit<'a> {
        let nominal = model.nominal();
        Fit { rows, poses: dwells.iter().map(|d| model.tip_in_base(&nominal, &d.joint_rad)).collect() }
    }

    /// How far the rows are off the nominal arm as the dwells from one on, the median [m]; infinite for fewer than six.
    fn off_m(&self, first: usize) -> f64 {
        let seen = self.poses[first..].iter().zip(self.rows).filter_map(|(pose, row)| Some((*pose, (*row)?)));
        let (poses, seen_m): (Vec<_>, Vec<_>) = seen.unzip();
        place(&poses, &seen_m).map_or(f64::INFINITY, |placed| placed.off_m)
    }

    /// How far half of the points are from their middle [m].
    fn spread_m(&self) -> f64 {
        let points: Vec<Vector3<f64>> = self.rows.iter().flatten().copied().collect();
        let middle = points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64;
        median(&points.iter().map(|p| (p - middle).norm()).collect::<Vec<_>>())
    }

    /// The dwell of the first row: of all runs of dwells that are as long, the one that explains the rows.
    fn first(&self) -> Result<usize, String> {
        let (n, m) = (self.rows.len(), self.poses.len());
        if n > m {
            return Err(format!(
                "{n} rows are more than the {m} dwells of the recording: leave out points at which the arm did not pause; [dwell] says \
                 what is a pause"
            ));
        }
        let mut all: Vec<(f64, usize)> = (0..=m - n).map(|first| (self.off_m(first), first)).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        match all.as_slice() {
            [] => Ok(0),
            [(_, only)] => Ok(*only),
            [(best_m, _), ..] if best_m.is_infinite() => Err(format!(
                "so few points do not tell which {n} of the {m} dwells they were measured in: set first_dwell"
            )),
            [(best_m, first), (next_m, _), ..] if *best_m * CLEAR < *next_m => Ok(*first),
            [(best_m, first), (next_m, next), ..] => Err(format!(
                "{n} rows and {m} dwells: from dwell {first} on they fit the nominal arm to {:.2} mm, from {next} on to {:.2} mm, \
                 which does not tell; set first_dwell, and leave a row without coordinates for a dwell that was not measured",
                best_m * 1e3,
                next_m * 1e3
            )),
        }
    }
}

/// The rows: x, y, z by the header, or the last three of three or four columns; without coordinates a dwell without a point.
fn parse(text: &str, to_m: f64) -> Result<Vec<Option<Vector3<f64>>>, String> {
    let head = text.lines().find(|l| !l.trim().is_empty() && !l.starts_with('#')).unwrap_or_default();
    let delimiter = [b'\t', b';', b','].into_iter().find(|d| head.contains(*d as char)).unwrap_or(b',');
    let mut reader = csv::ReaderBuilder::new();
    reader.trim(csv::Trim::All).comment(Some(b'#')).has_headers(false).flexible(true).delimiter(delimiter);
    let mut columns: Option<[usize; 3]> = None;
    let mut rows = Vec::new();
    for record in reader.from_reader(text.as_bytes()).records() {
        let record = record.map_err(|e| e.to_string())?;
        let line = record.position().map_or(0, csv::Position::line);
        let number = |column: usize| {
            let text = record.get(column).unwrap_or_default();
            // A decimal comma where commas part nothing.
            let text = if delimiter == b',' { text.to_owned() } else { text.replace(',', ".") };
            text.parse::<f64>().ok().filter(|x| x.is_finite())
        };
        let at = match columns {
            Some(at) => at,
            None => {
                let named = |axis: &str| record.iter().position(|name| is_axis(name, axis));
                let last = record.len().checked_sub(3).filter(|_| record.len() < 5);
                let (at, is_header) = match (named("x"), named("y"), named("z"), last) {
                    (Some(x), Some(y), Some(z), _) => ([x, y, z], true),
                    (.., Some(last)) if number(last + 1).is_some() => ([last, last + 1, last + 2], false),
                    _ => {
                        return Err(format!(
                            "line {line}: a header with the columns x, y, z is missing (name, x, y, z do without)"
                        ));
                    }
                };
                columns = Some(at);
                if is_header {
                    continue;
                }
                at
            }
        };
        if at.iter().all(|c| ["", "-"].contains(&record.get(*c).unwrap_or_default())) {
            rows.push(None);
            continue;
        }
        let [x, y, z] = at.map(number);
        let Some(((x, y), z)) = x.zip(y).zip(z) else {
            let read: Vec<&str> = at.iter().map(|c| record.get(*c).unwrap_or_default()).collect();
            return Err(format!("line {line}: `{}` are no three numbers", read.join(" ")));
        };
        rows.push(Some(Vector3::new(x, y, z) * to_m));
    }
    if rows.iter().all(Option::is_none) {
        return Err("there is no point in it".to_owned());
    }
    Ok(rows)
}

/// `X`, `x_mm`, `X [mm]`, `X(mm)`.
fn is_axis(name: &str, axis: &str) -> bool {
    let plain = name.trim_matches('"').to_lowercase();
    plain.split(['_', ' ', '[', '(', '/']).next() == Some(axis)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may stop")]
mod tests {
    use super::*;

    #[test]
    fn what_trackers_export_is_read_and_what_is_wrong_is_told_by_its_line() {
        let expected = [Some(Vector3::new(1.0, -0.2, 0.0305)), None];
        for text in [
            "Name,X [mm],Y [mm],Z [mm]\nP1,1000,-200,30.5\nP2,,,\n",
            "# exported\nP1, 1000.0, -200.0, 30.5\nP2, -, -, -\n",
            "1000;-200;30,5\n;;\n",
            "time\tz_mm\ty_mm\tx_mm\n9:01\t30.5\t-200\t1e3\n9:02\t\t\t\n",
        ] {
            assert_eq!(parse(text, 1e-3).unwrap(), expected, "{text}");
        }
        for (text, words) in [
            ("a,b,c,d,e\n1,2,3,4,5\n", "line 1: a header"),
            ("x,y,z\n1,2,3\n1,2\n", "line 3: `1 2 ` are no three"),
            ("x,y,z\n1,2,nan\n", "line 2"),
            ("x,y,z\n", "no point"),
            ("", "no point"),
        ] {
            let said = parse(text, 1e-3).unwrap_err();
            assert!(said.contains(words), "{text}: {said}");
        }
    }
}
