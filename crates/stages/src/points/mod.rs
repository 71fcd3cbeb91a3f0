//! Points that a laser tracker measured while the arm stood still, as its software exports them: a CSV file beside the recording.
//!
//! Without times the rows are dwells in their order: those in a row at which the nominal arm, with its base anywhere and the target
//! anywhere on its last link, comes closest to them. With times each row is in the dwell that holds it, once one offset between the
//! clocks is known: the one at which the most dwells have a row, and where several do, the one that the nominal arm explains.

mod clock;
pub mod rows;

use crate::RunError;
use crate::links::place_on_link;
use armcal_config::{PointsFile, read_text};
use armcal_core::robust::median;
use armcal_core::{Code, Dwell, Pose, Severity, Stage, TipMeasurement, Warning, list_names};
use armcal_model::Model;
use armcal_recording::input::Kind;
use clock::Offset;
use nalgebra::{Matrix3, Vector3};
use rows::{Row, Table};
use std::collections::BTreeMap;
use std::path::Path;

/// A pairing of rows and dwells must explain the rows so many times better than the next.
const CLEAR: f64 = 2.0;
/// Rows that are off by more than this share of how far they are apart were measured in other dwells.
const DOUBTFUL: f64 = 0.25;
/// Points of one dwell lie within so many of their standard errors.
const SAME: f64 = 6.0;
/// More rows a dwell than this are no points but a stream.
const STREAM: usize = 10;

/// Gives each dwell of a recording the point of its row.
pub fn assign_to_dwells(
    points: &PointsFile,
    (path, recording): (&Path, &str),
    model: &Model,
    dwells: &mut [Dwell],
) -> Result<Warning, RunError> {
    let bad = |problem: String| RunError::InRecording {
        recording: recording.to_owned(),
        problem: format!("{}: {problem}", path.display()),
    };
    let text = read_text("CSV of points", Kind::Data, path)?;
    let table = rows::parse(&text, points.unit.to_m(), points.time.as_deref()).map_err(bad)?;
    let fit = Fit::of(&table.rows, model, dwells);
    let (dwell_of, how) = match &table.began {
        Some(began) => fit.by_time(began, points.first_dwell, dwells),
        None => fit.in_order(points.first_dwell),
    }
    .map_err(bad)?;
    let off_m = fit.off_m(&dwell_of);
    let is_doubtful = off_m.is_finite() && off_m > DOUBTFUL * fit.spread_m();
    write_measurements(dwells, &table, &dwell_of, points.sigma_mm * 1e-3).map_err(bad)?;
    let without = dwells.iter().filter(|d| d.tip.is_none()).count();
    let severity = if is_doubtful { Severity::Inadequate } else { Severity::Notice };
    let doubt = match (is_doubtful, &table.began) {
        (false, _) => "",
        (true, None) => " only: are the rows in the order of the dwells, and is the unit right?",
        (true, Some(_)) => " only: are these the times of the points, and is the unit right?",
    };
    let fits = match off_m.is_finite() {
        true => format!("; half of them fit the nominal arm to {:.1} mm{doubt}", off_m * 1e3),
        false => String::new(),
    };
    let all = dwells.len();
    let said = format!("{how}; {without} of {all} dwells have no point{fits}");
    Ok(Warning::new(severity, Stage::Dwell, Code::PointsFile, path.display().to_string(), said))
}

/// Writes the points into their dwells, the mean where there are several; such errors go together, so it is no better than one.
fn write_measurements(
    dwells: &mut [Dwell],
    table: &Table,
    dwell_of: &[Option<usize>],
    sigma_m: f64,
) -> Result<(), String> {
    let mut of_dwell: BTreeMap<usize, Vec<(u64, Vector3<f64>)>> = BTreeMap::new();
    for (row, dwell) in table.rows.iter().zip(dwell_of) {
        if let (Some(dwell), Some(point_m)) = (dwell, row.point_m) {
            of_dwell.entry(*dwell).or_default().push((row.line, point_m));
        }
    }
    for (dwell, seen) in of_dwell {
        let mean = seen.iter().map(|(_, p)| p).sum::<Vector3<f64>>() / seen.len() as f64;
        if let Some((line, point_m)) = seen.iter().find(|(_, p)| (p - mean).amax() > SAME * sigma_m) {
            return Err(format!(
                "line {line}: its point is {:.3} mm off the mean of the {} that were measured in dwell {dwell} at {:.2} s of the \
                 recording, whose sigma_mm is {}: leave out those that are wrong",
                (point_m - mean).norm() * 1e3,
                seen.len(),
                dwells[dwell].start_ns as f64 * 1e-9,
                sigma_m * 1e3
            ));
        }
        dwells[dwell].tip = Some(TipMeasurement {
            position_m: mean,
            covariance_m2: Matrix3::identity() * sigma_m.powi(2),
            orientation: None,
            orientation_sigma_rad: f64::INFINITY,
            samples: seen.len(),
            effective_samples: 1.0,
        });
    }
    Ok(())
}

/// For every row its dwell, and how it was found, in words.
type Paired = (Vec<Option<usize>>, String);

/// Rows, and where the nominal arm was in every dwell.
struct Fit<'a> {
    rows: &'a [Row],
    poses: Vec<Pose>,
}

impl Fit<'_> {
    fn of<'a>(rows: &'a [Row], model: &Model, dwells: &[Dwell]) -> Fit<'a> {
        let nominal = model.nominal();
        Fit { rows, poses: dwells.iter().map(|d| model.tip_in_base(&nominal, &d.joint_rad)).collect() }
    }

    /// How far the rows are off the nominal arm in their dwells, the median [m]; infinite for fewer than six.
    fn off_m(&self, dwell_of: &[Option<usize>]) -> f64 {
        let seen = dwell_of.iter().zip(self.rows);
        let seen = seen.filter_map(|(dwell, row)| Some((self.poses[(*dwell)?], row.point_m?)));
        let (poses, seen_m): (Vec<_>, Vec<_>) = seen.unzip();
        place_on_link(&poses, &seen_m).map_or(f64::INFINITY, |placed| placed.off_m)
    }

    /// How far half of the points are from their middle [m].
    fn spread_m(&self) -> f64 {
        let points: Vec<Vector3<f64>> = self.rows.iter().filter_map(|row| row.point_m).collect();
        let middle = points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64;
        median(&points.iter().map(|p| (p - middle).norm()).collect::<Vec<_>>())
    }

    /// The rows as dwells in their order, from one on: of all runs of dwells that are as long, the one that explains the rows.
    fn in_order(&self, first: Option<usize>) -> Result<Paired, String> {
        let (n, m) = (self.rows.len(), self.poses.len());
        let from = |first: usize| (first..first + n).map(Some).collect::<Vec<_>>();
        let first = match first {
            Some(first) if first + n <= m => first,
            Some(first) => {
                return Err(format!(
                    "{n} rows from dwell {first} on are more than the {m} dwells of the recording"
                ));
            }
            None if n > m => {
                return Err(format!(
                    "{n} rows are more than the {m} dwells of the recording: leave out points at which the arm did not pause, or name the \
                     column of their times (`time`); [dwell] says what is a pause"
                ));
            }
            None => {
                let found =
                    clearest_fit((0..=m - n).map(|first| (self.off_m(&from(first)), first)).collect());
                found.map_err(|rivals| match rivals {
                    None => format!(
                        "so few points do not tell which {n} of the {m} dwells they were measured in: set first_dwell"
                    ),
                    Some([(best_m, first), (next_m, next)]) => format!(
                        "{n} rows and {m} dwells: from dwell {first} on they fit the nominal arm to {:.2} mm, from {next} on to {:.2} mm, \
                         which does not tell; set first_dwell, and leave a row without coordinates for a dwell that was not measured",
                        best_m * 1e3,
                        next_m * 1e3
                    ),
                })?
            }
        };
        let last = first + n - 1;
        Ok((from(first), format!("its {n} rows are the dwells {first} to {last}")))
    }

    /// The rows in the dwells that hold their times.
    fn by_time(&self, began: &str, first: Option<usize>, dwells: &[Dwell]) -> Result<Paired, String> {
        let start_ns = dwells.first().map_or(0, |d| d.start_ns);
        let lasted_ns: Vec<(i64, i64)> =
            dwells.iter().map(|d| (d.start_ns - start_ns, d.end_ns - start_ns)).collect();
        let with_point: Vec<&Row> = self.rows.iter().filter(|row| row.point_m.is_some()).collect();
        let times_ns: Vec<i64> = with_point.iter().map(|row| row.time_ns).collect();
        let (n, m) = (times_ns.len(), dwells.len());
        if n > STREAM * m {
            return Err(format!(
                "{n} points for {m} dwells: a stream, not a point a dwell; leave one row for each time that the arm stood still"
            ));
        }
        let earliest_ns = times_ns.iter().copied().min().unwrap_or(0);
        let mut offsets = clock::offset_candidates(&times_ns, &lasted_ns);
        offsets.retain(|o| first.is_none_or(|first| o.dwell(earliest_ns, &lasted_ns) == Some(first)));
        let pair = |offset: &Offset| -> Vec<Option<usize>> {
            let dwell = |row: &Row| row.point_m.and_then(|_| offset.dwell(row.time_ns, &lasted_ns));
            self.rows.iter().map(dwell).collect()
        };
        let clock_s = |offset: &Offset| start_ns.saturating_add(offset.ns) as f64 * 1e-9;
        if let (None, Some(first)) = (offsets.first(), first) {
            return Err(format!(
                "with its first point in dwell {first} fewer dwells have one than with another offset of its clock"
            ));
        }
        let found = clearest_fit(offsets.iter().map(|offset| (self.off_m(&pair(offset)), offset)).collect());
        let offset = found.map_err(|rivals| match rivals {
            None => format!(
                "so few points do not tell by how much the clocks are apart ({} offsets would do): set first_dwell, the dwell of the \
                 first point",
                offsets.len()
            ),
            Some([(best_m, best), (next_m, next)]) => format!(
                "`{began}` may be {:.2} s or {:.2} s of the recording: {} and {} dwells have a point then, which fit the nominal arm to \
                 {:.2} and {:.2} mm, which does not tell; set first_dwell, the dwell of the first point",
                clock_s(best),
                clock_s(next),
                best.dwells,
                next.dwells,
                best_m * 1e3,
                next_m * 1e3
            ),
        })?;
        let dwell_of = pair(offset);
        let lost =
            self.rows.iter().zip(&dwell_of).filter(|(row, dwell)| row.point_m.is_some() && dwell.is_none());
        let lost: Vec<String> = lost.map(|(row, _)| row.line.to_string()).collect();
        if 2 * lost.len() > n {
            return Err(format!(
                "whatever the offset of its clock, {} of its {n} points are in no dwell: is `time` the time of the point, and is this the \
                 recording?",
                lost.len()
            ));
        }
        let outside = match lost.is_empty() {
            true => String::new(),
            false => format!(", {} in none and left out (line {})", lost.len(), list_names(&lost)),
        };
        let how = format!(
            "of its {n} points {} were measured in dwells{outside}: its time `{began}` is {:.2} s of the recording's clock, give or take \
             {:.2} s",
            n - lost.len(),
            clock_s(offset),
            offset.within_ns as f64 * 1e-9
        );
        Ok((dwell_of, how))
    }
}

/// What fits clearly better than all else, or the two that come closest; nothing where too few points are in dwells to say.
#[allow(clippy::type_complexity, reason = "two of what came in")]
fn clearest_fit<T: Copy>(mut all: Vec<(f64, T)>) -> Result<T, Option<[(f64, T); 2]>> {
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    match all.as_slice() {
        [(_, only)] => Ok(*only),
        [best, next, ..] if best.0.is_finite() => match best.0 * CLEAR < next.0 {
            true => Ok(best.1),
            false => Err(Some([*best, *next])),
        },
        _ => Err(None),
    }
}
