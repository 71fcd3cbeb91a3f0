//! Errors along paths: Table 6 of the source paper, and its figures 6, 7 and 10.

use crate::compared::{Compared, Error, Estimate};
use crate::plane::Plane;
use crate::polyline::Polyline;
use armcal_core::DwellId;
use nalgebra::Vector3;
use rayon::prelude::*;
use serde::Serialize;
use std::collections::BTreeMap;

/// Neighbouring samples of a path share their error; stretches of this length are taken to be independent [s]: longer
/// than a joint stays in one gap or on one flank, much shorter than a recording.
const STRETCH_S: f64 = 2.0;
/// 97.5 % quantile of the normal distribution, for the error of the clock.
const NORMAL_95: f64 = 1.959_964;

/// Where the tip was at one moment of a motion, and where it should have been. All in the robot's base frame [m].
#[derive(Debug, Clone, PartialEq)]
pub struct PathError {
    /// Recording, and motion within it.
    pub motion: DwellId,
    /// Time on the robot's clock [ns].
    pub time_ns: i64,
    /// Where the sensor saw the tip.
    pub measured_m: Vector3<f64>,
    /// Where the nominal model puts it, from the encoder readings of that moment.
    pub before_m: Vector3<f64>,
    /// Where the calibrated model puts it.
    pub after_m: Vector3<f64>,
}

/// What one standard error of the sensor's clock changes in the mean errors of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ClockError {
    /// Standard error of the clock's offset, the recording's middle [s].
    pub sigma_s: f64,
    /// Change of the mean error before [m].
    pub before_m: f64,
    /// Change of the mean error after [m].
    pub after_m: f64,
}

/// Paths as the controller planned them: set-points, through the nominal and through the calibrated model.
#[derive(Debug, Clone, PartialEq)]
pub struct Planned {
    /// The path that the nominal model believes it commands.
    pub before: Polyline,
    /// The path that the calibrated model says was commanded.
    pub after: Polyline,
}

/// One row of the table.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PathRow {
    /// Recording; `all` for all of them.
    pub subject: String,
    /// In space, or in a plane of the base frame.
    pub plane: Plane,
    /// What is compared with what.
    pub against: Against,
    /// Errors before and after, the clock's uncertainty in the intervals.
    #[serde(flatten)]
    pub errors: Compared,
    /// What the clock's uncertainty changes; absent where one clock stamped everything.
    pub clock: Option<ClockError>,
}

/// What the measured path is compared with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Against {
    /// The position that the model predicts from the encoders at the same moment.
    Encoders,
    /// The nearest place of the path that the set-points command.
    Planned,
}

/// A moment as the rows see it.
struct Sample<'a> {
    error: &'a PathError,
    /// Name of its stretch.
    stretch: String,
    /// Distances from the planned paths before and after, by [`Plane`] [m]; `None` where nothing was planned.
    planned_m: Option<[[f64; 2]; 4]>,
}

impl<'a> Sample<'a> {
    fn of(error: &'a PathError, planned: &BTreeMap<DwellId, Planned>) -> Sample<'a> {
        let planned_m = planned.get(&error.motion).map(|path| {
            Plane::ALL
                .map(|plane| [&path.before, &path.after].map(|way| way.distance_m(&error.measured_m, plane)))
        });
        Sample { error, stretch: stretch_name(error.motion, error.time_ns), planned_m }
    }

    /// Errors before and after [m] in a view.
    fn errors_m(&self, plane: Plane, against: Against) -> Option<[f64; 2]> {
        let PathError { measured_m, before_m, after_m, .. } = self.error;
        match against {
            Against::Encoders => {
                Some([before_m, after_m].map(|model_m| plane.seen(&(measured_m - model_m)).norm()))
            }
            Against::Planned => self.planned_m.map(|distances_m| distances_m[plane as usize]),
        }
    }
}

/// Rows for all recordings together and each alone, in every view. `clocks` has one entry a recording.
///
/// Rows against the planned path exist for the motions in `planned`.
pub fn compare_paths(
    errors: &[PathError],
    recordings: &[String],
    clocks: &[Option<ClockError>],
    planned: &BTreeMap<DwellId, Planned>,
) -> Vec<PathRow> {
    let samples: Vec<Sample<'_>> = errors.par_iter().map(|error| Sample::of(error, planned)).collect();
    let one = (0..recordings.len()).map(Some);
    let subjects = std::iter::once(None).chain(one.filter(|_| recordings.len() > 1));
    let rows = subjects.flat_map(|recording| {
        let of_it = |s: &&Sample<'_>| recording.is_none_or(|r| s.error.motion.recording == r);
        let chosen: Vec<&Sample<'_>> = samples.iter().filter(of_it).collect();
        let clock = match recording {
            Some(r) => clocks.get(r).copied().flatten(),
            None => combine_clock_errors(&chosen, clocks),
        };
        let subject = recording.map_or("all", |r| recordings[r].as_str());
        let views = |against| Plane::ALL.map(|plane| (plane, against));
        let views = views(Against::Encoders).into_iter().chain(views(Against::Planned));
        views.filter_map(move |(plane, against)| table_row(subject, plane, against, &chosen, clock))
    });
    rows.collect()
}

fn table_row<'a>(
    subject: &str,
    plane: Plane,
    against: Against,
    samples: &[&'a Sample<'_>],
    clock: Option<ClockError>,
) -> Option<PathRow> {
    let pair = |s: &&'a Sample<'_>| {
        let [before_m, after_m] = s.errors_m(plane, against)?;
        Some(Error { group: &s.stretch, before_m, after_m })
    };
    let pairs: Vec<Error<'_>> = samples.iter().filter_map(pair).collect();
    let mut compared = Compared::of(&pairs)?;
    // Where a path lies in space does not depend on when.
    let clock = clock.filter(|_| against == Against::Encoders);
    if let Some(clock) = clock {
        widen_estimate(&mut compared.before, clock.before_m);
        widen_estimate(&mut compared.after, clock.after_m);
        let change_m = clock.after_m - clock.before_m;
        compared.difference_ci95_m = compared.difference_ci95_m.map(|i| widen_interval(i, change_m));
    }
    Some(PathRow { subject: subject.to_owned(), plane, against, errors: compared, clock })
}

/// Name of the stretch of a motion that a moment belongs to: what is independent of other stretches.
pub fn stretch_name(motion: DwellId, time_ns: i64) -> String {
    let at = time_ns.div_euclid((STRETCH_S * 1e9) as i64);
    format!("{motion}.{at}")
}

/// Clocks of different recordings err independently: their effects on the common mean add in square.
fn combine_clock_errors(samples: &[&Sample<'_>], clocks: &[Option<ClockError>]) -> Option<ClockError> {
    let mut sizes: BTreeMap<usize, f64> = BTreeMap::new();
    samples.iter().for_each(|s| *sizes.entry(s.error.motion.recording).or_default() += 1.0);
    let n = samples.len() as f64;
    let known: Vec<(f64, ClockError)> = sizes
        .into_iter()
        .filter_map(|(r, size)| clocks.get(r).copied().flatten().map(|c| (size / n, c)))
        .collect();
    let sum = |of: fn(&ClockError) -> f64| known.iter().map(|(w, c)| (w * of(c)).powi(2)).sum::<f64>().sqrt();
    let largest = known.iter().map(|(_, c)| c.sigma_s).fold(0.0, f64::max);
    (!known.is_empty()).then(|| ClockError {
        sigma_s: largest,
        before_m: sum(|c| c.before_m),
        after_m: sum(|c| c.after_m),
    })
}

fn widen_estimate(estimate: &mut Estimate, clock_m: f64) {
    estimate.ci95_m = estimate.ci95_m.map(|interval| widen_interval(interval, clock_m));
}

/// An interval with an independent normal error of standard deviation `sigma_m` added.
fn widen_interval([low, high]: [f64; 2], sigma_m: f64) -> [f64; 2] {
    let (centre, half) = (0.5 * (low + high), 0.5 * (high - low));
    let half = half.hypot(NORMAL_95 * sigma_m);
    [centre - half, centre + half]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A straight path along x, seen 3 mm to the left and 4 mm above where the nominal model has it.
    fn straight() -> Vec<PathError> {
        (0..1000)
            .map(|i| {
                let on = Vector3::new(1e-3 * f64::from(i), 0.0, 0.0);
                PathError {
                    motion: DwellId { recording: 0, dwell: 0 },
                    time_ns: i64::from(i) * 10_000_000,
                    measured_m: on + Vector3::new(0.0, 3e-3, 4e-3),
                    before_m: on,
                    after_m: on + Vector3::new(0.0, 3e-3, 3e-3),
                }
            })
            .collect()
    }

    fn find(rows: &[PathRow], plane: Plane, against: Against) -> Compared {
        rows.iter().find(|r| r.plane == plane && r.against == against).expect("a row").errors
    }

    #[test]
    fn planes_see_their_part_of_an_offset() {
        let rows = compare_paths(&straight(), &["one".into()], &[None], &BTreeMap::new());
        let mean = |plane| find(&rows, plane, Against::Encoders).before.mean_m;
        assert!((mean(Plane::Space) - 5e-3).abs() < 1e-12);
        assert!((mean(Plane::Xy) - 3e-3).abs() < 1e-12);
        assert!((mean(Plane::Yz) - 5e-3).abs() < 1e-12);
        assert!((mean(Plane::Xz) - 4e-3).abs() < 1e-12);
        let space = find(&rows, Plane::Space, Against::Encoders);
        assert!((space.improvement - 0.8).abs() < 1e-12);
        // 10 s are five stretches, not a thousand samples.
        assert_eq!((space.n, space.groups), (1000, 5));
        assert!(rows.iter().all(|r| r.against == Against::Encoders));
    }

    #[test]
    fn a_lag_is_an_error_at_the_moment_but_not_of_the_path() {
        let mut errors = straight();
        let planned_m: Vec<Vector3<f64>> = errors.iter().map(|e| e.before_m).collect();
        errors.iter_mut().for_each(|e| e.measured_m = e.before_m - Vector3::new(2e-3, 0.0, 0.0));
        let path = Polyline::through(planned_m).expect("points");
        let planned = BTreeMap::from([(errors[0].motion, Planned { before: path.clone(), after: path })]);
        let rows = compare_paths(&errors, &["one".into()], &[None], &planned);
        assert!((find(&rows, Plane::Space, Against::Encoders).before.mean_m - 2e-3).abs() < 1e-12);
        // Only the first two samples lie before the beginning of the path.
        assert!(find(&rows, Plane::Space, Against::Planned).before.mean_m < 5e-6);
    }

    #[test]
    fn an_uncertain_clock_widens_the_interval() {
        let clock = ClockError { sigma_s: 1e-3, before_m: 0.0, after_m: 2e-4 };
        let rows = compare_paths(&straight(), &["one".into()], &[Some(clock)], &BTreeMap::new());
        let [low, high] = find(&rows, Plane::Space, Against::Encoders).after.ci95_m.expect("five stretches");
        assert!((0.5 * (high - low) - NORMAL_95 * 2e-4).abs() < 1e-9, "{low} {high}");
    }
}
