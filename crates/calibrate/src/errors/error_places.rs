//! In which dwells errors are largest: the place in a session that a person would look at first.

use armcal_core::{DwellId, Observation, list_names};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// Fewest dwells on either side of a comparison.
const FEWEST: usize = 5;
/// A side is worth naming when its errors are this many times those elsewhere.
const FACTOR: f64 = 1.5;
/// And when chance would make so large a difference of mean logarithms less often than normal errors exceed this.
const SIGMAS: f64 = 5.0;
/// Places named at most.
const MOST: usize = 2;
/// A dwell whose error is so many times what noise would give is gross: of three coordinates noise alone does that once in 10^13.
const GROSS: f64 = 5.0;
/// So many of the dwells may be gross and still be single ones; so many where each of them errs this many times as much, against
/// its noise, as any other: a mixture of two kinds of dwells, as of a marker that flips in some.
const FEW: f64 = 0.1;
const SOME: f64 = 0.25;
const APART: f64 = 3.0;
/// Single dwells that are named one by one, at most.
const NAMED: usize = 20;

/// Dwells in which the error is larger than elsewhere.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ErrorPlace {
    /// Which: `recording 2` (by its index), `shoulder from 10 to 25 deg`, `recording 1 dwell 96, recording 1 dwell 97`.
    pub place: String,
    /// How many dwells that are.
    pub dwells: usize,
    /// Their mean error [mm].
    pub error_mm: f64,
    /// The mean error of all others [mm].
    pub elsewhere_mm: f64,
    /// How many times the errors are what the declared noise gives, in the geometric mean: what makes it a place.
    pub times_noise: f64,
    /// The same of all others.
    pub elsewhere_times_noise: f64,
}

/// The error of one dwell, and what the declared noise would give.
#[derive(Debug, Clone, Copy)]
pub struct DwellError<'a> {
    /// What was observed in it.
    pub observation: &'a Observation,
    /// Its error [m].
    pub error_m: f64,
    /// The mean error that the declared noise alone would give there [m].
    pub expected_m: f64,
}

impl DwellError<'_> {
    fn ln_times_noise(&self) -> f64 {
        (self.error_m.max(1e-12) / self.expected_m.max(1e-12)).ln()
    }
}

/// Where the errors are largest against what noise would give, the clearest place first. Dwells with larger noise are
/// no places: errors are compared in units of their own expectation, as logarithms, so that no single one decides.
pub fn error_places(errors: &[DwellError<'_>], joint_names: &[String]) -> Vec<ErrorPlace> {
    let log: Vec<f64> = errors.iter().map(DwellError::ln_times_noise).collect();
    let mut found: Vec<(f64, ErrorPlace)> = Vec::new();
    for (place, members) in named_groups(errors, joint_names) {
        let (inside, outside): (Vec<usize>, Vec<usize>) =
            (0..errors.len()).partition(|i| members.binary_search(i).is_ok());
        if inside.len() < FEWEST || outside.len() < FEWEST {
            continue;
        }
        let (mean_in, variance_in) = mean_and_variance(&log, &inside);
        let (mean_out, variance_out) = mean_and_variance(&log, &outside);
        let sigma = (variance_in / inside.len() as f64 + variance_out / outside.len() as f64).sqrt();
        let sigmas = (mean_in - mean_out) / sigma.max(1e-12);
        if sigmas < SIGMAS || (mean_in - mean_out).exp() < FACTOR {
            continue;
        }
        found.push((sigmas, ErrorPlace::of(place, errors, (&inside, &outside))));
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.into_iter().take(MOST).map(|(_, place)| place).collect()
}

/// The few gross dwells for which alone the mean error is not within `floor_factor` of what noise would give; none where it is, or
/// where that of the others is not either.
pub fn single_dwells(errors: &[DwellError<'_>], floor_factor: f64) -> Option<ErrorPlace> {
    let dwells_of = |of: &mut dyn Iterator<Item = &DwellError<'_>>| {
        of.map(|e| e.observation.dwell).collect::<BTreeSet<DwellId>>()
    };
    let all = dwells_of(&mut errors.iter());
    let gross = dwells_of(&mut errors.iter().filter(|e| e.error_m > GROSS * e.expected_m));
    let share = gross.len() as f64 / all.len().max(1) as f64;
    if gross.is_empty() || share > SOME {
        return None;
    }
    let (inside, outside): (Vec<usize>, Vec<usize>) =
        (0..errors.len()).partition(|i| gross.contains(&errors[*i].observation.dwell));
    let times = |i: &usize| errors[*i].ln_times_noise().exp();
    let least = inside.iter().map(times).fold(f64::INFINITY, f64::min);
    let most = outside.iter().map(times).fold(0.0, f64::max);
    if share > FEW && least < APART * most {
        return None;
    }
    let every: Vec<usize> = (0..errors.len()).collect();
    let at_floor = |of: &[usize]| {
        let sum = |value: fn(&DwellError<'_>) -> f64| of.iter().map(|i| value(&errors[*i])).sum::<f64>();
        sum(|e| e.error_m) <= floor_factor * sum(|e| e.expected_m)
    };
    let for_them_alone = at_floor(&outside) && !at_floor(&every);
    let names: Vec<String> = gross.iter().map(ToString::to_string).collect();
    let told = if names.len() > NAMED { list_names(&names) } else { names.join(", ") };
    for_them_alone.then(|| ErrorPlace::of(told, errors, (&inside, &outside)))
}

impl ErrorPlace {
    /// Of the errors on either side.
    fn of(place: String, errors: &[DwellError<'_>], (inside, outside): (&[usize], &[usize])) -> ErrorPlace {
        let mean = |of: &[usize], value: fn(&DwellError<'_>) -> f64| {
            of.iter().map(|i| value(&errors[*i])).sum::<f64>() / of.len() as f64
        };
        let mean_mm = |of: &[usize]| mean(of, |e| e.error_m) * 1e3;
        let times = |of: &[usize]| mean(of, |e| e.ln_times_noise()).exp();
        ErrorPlace {
            place,
            dwells: inside.iter().map(|i| errors[*i].observation.dwell).collect::<BTreeSet<_>>().len(),
            error_mm: mean_mm(inside),
            elsewhere_mm: mean_mm(outside),
            times_noise: times(inside),
            elsewhere_times_noise: times(outside),
        }
    }
}

/// Every group of dwells that has a name: recordings, seated or tracked, halves and ends of the time, thirds of each
/// joint's range, directions of arrival, cavities. Members in rising order.
fn named_groups(errors: &[DwellError<'_>], joint_names: &[String]) -> BTreeMap<String, Vec<usize>> {
    let mut all: BTreeMap<String, Vec<usize>> = BTreeMap::new();
    let mut add = |name: String, i: usize| all.entry(name).or_default().push(i);
    let mut in_time: Vec<(usize, i64, DwellId)> =
        errors.iter().enumerate().map(|(i, e)| (i, e.observation.time_ns, e.observation.dwell)).collect();
    in_time.sort_by_key(|(_, time_ns, dwell)| (*time_ns, *dwell));
    let mut rank = vec![0; errors.len()];
    in_time.iter().enumerate().for_each(|(position, (i, ..))| rank[*i] = position);
    let ranges: Vec<(f64, f64)> = (0..joint_names.len()).map(|j| joint_range(errors, j)).collect();
    for (i, e) in errors.iter().enumerate() {
        let o = e.observation;
        add(format!("recording {}", o.dwell.recording), i);
        match o.cavity() {
            Some(cavity) => {
                add("the seated dwells".to_owned(), i);
                add(format!("cavity {cavity}"), i);
            }
            None => add("the tracked dwells".to_owned(), i),
        }
        match 4 * rank[i] / errors.len() {
            0 => add("the first quarter of the session".to_owned(), i),
            3 => add("the last quarter of the session".to_owned(), i),
            _ => {}
        }
        if 2 * rank[i] >= errors.len() {
            add("the second half of the session".to_owned(), i);
        }
        for (j, name) in joint_names.iter().enumerate() {
            let (low, high) = ranges[j];
            let third = (high - low) / 3.0;
            if third > 0.0 {
                let k = (((o.joint_rad[j] - low) / third) as usize).min(2) as f64;
                let edge = |n: f64| (low + n * third).to_degrees();
                add(format!("{name} from {:.0} to {:.0} deg", edge(k), edge(k + 1.0)), i);
            }
            match o.arrival.get(j).map_or(0.0, |a| a.sign()) {
                1.0 => add(format!("{name} arriving upwards"), i),
                -1.0 => add(format!("{name} arriving downwards"), i),
                _ => {}
            }
        }
    }
    all
}

fn joint_range(errors: &[DwellError<'_>], joint: usize) -> (f64, f64) {
    let readings = errors.iter().map(|e| e.observation.joint_rad[joint]);
    readings.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), q| (low.min(q), high.max(q)))
}

/// Mean and variance of some values.
fn mean_and_variance(values: &[f64], of: &[usize]) -> (f64, f64) {
    let n = of.len() as f64;
    let mean = of.iter().map(|i| values[*i]).sum::<f64>() / n;
    (mean, of.iter().map(|i| (values[*i] - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use armcal_core::{Arrival, Reference};
    use nalgebra::Vector3;

    fn observations(n: usize) -> Vec<Observation> {
        (0..n)
            .map(|i| {
                let dwell = DwellId { recording: i % 3, dwell: i / 3 };
                let q = vec![(i as f64 * 0.37).sin(), (i as f64 * 1.93).cos()];
                let mut o = Observation::bare(dwell, q, Reference::position(Vector3::zeros()));
                o.time_ns = i as i64;
                o.arrival = vec![if i % 7 < 3 { Arrival::Positive } else { Arrival::Negative }; 2];
                o
            })
            .collect()
    }

    fn places(all: &[Observation], error_m: impl Fn(usize, &Observation) -> f64) -> Vec<ErrorPlace> {
        let of =
            |(i, observation)| DwellError { observation, error_m: error_m(i, observation), expected_m: 1e-4 };
        let errors: Vec<DwellError<'_>> = all.iter().enumerate().map(of).collect();
        error_places(&errors, &["shoulder".to_owned(), "elbow".to_owned()])
    }

    /// A spread that repeats with nothing that has a name.
    fn spread(i: usize) -> f64 {
        1e-3 * (1.0 + 0.5 * ((i * i) as f64 * 0.71).sin())
    }

    #[test]
    fn errors_that_are_alike_everywhere_have_no_place() {
        assert_eq!(places(&observations(120), |i, _| spread(i)), vec![]);
    }

    #[test]
    fn the_recording_the_range_and_the_direction_that_err_are_named() {
        let all = observations(120);
        let third = |i, o: &Observation| if o.dwell.recording == 2 { 5.0 * spread(i) } else { spread(i) };
        let named = places(&all, third);
        assert_eq!((named[0].place.as_str(), named[0].dwells), ("recording 2", 40));
        assert!((named[0].error_mm / named[0].elsewhere_mm - 5.0).abs() < 0.5, "{named:?}");
        assert!((named[0].times_noise / named[0].elsewhere_times_noise - 5.0).abs() < 0.5, "{named:?}");

        let far = |i, o: &Observation| if o.joint_rad[1] > 1.0 / 3.0 { 4.0 * spread(i) } else { spread(i) };
        assert_eq!(places(&all, far)[0].place, "elbow from 19 to 57 deg");

        let up = |i, o: &Observation| spread(i) * if o.arrival[0].sign() > 0.0 { 4.0 } else { 1.0 };
        assert!(places(&all, up)[0].place.ends_with("arriving upwards"));
    }

    #[test]
    fn single_dwells_are_told_where_all_others_are_at_the_floor_and_they_are_few() {
        let all = observations(120);
        let single = |gross: &[usize], elsewhere_m: f64| {
            let of = |(i, observation)| {
                let error_m = if gross.contains(&i) { 5e-3 } else { elsewhere_m };
                DwellError { observation, error_m, expected_m: 1e-4 }
            };
            single_dwells(&all.iter().enumerate().map(of).collect::<Vec<_>>(), 1.5)
        };
        let place = single(&[17, 18], 1.1e-4).expect("two of 120");
        let little = [DwellError { observation: &all[0], error_m: 6e-4, expected_m: 1e-4 }];
        let rest =
            all[1..].iter().map(|observation| DwellError { observation, error_m: 1e-4, expected_m: 1e-4 });
        let with_little: Vec<DwellError<'_>> = little.into_iter().chain(rest).collect();
        assert_eq!(single_dwells(&with_little, 1.5), None, "all of it is at the floor");
        assert_eq!((place.place.as_str(), place.dwells), ("recording 0 dwell 6, recording 2 dwell 5", 2));
        assert!((place.error_mm - 5.0).abs() < 1e-9 && (place.elsewhere_mm - 0.11).abs() < 1e-9);
        assert!((place.times_noise - 50.0).abs() < 1e-9 && (place.elsewhere_times_noise - 1.1).abs() < 1e-9);
        assert_eq!(single(&[17], 1.6e-4), None, "the others err too");
        assert_eq!(single(&[], 1e-4), None);
        let twelve: Vec<usize> = (0..12).collect();
        assert!(single(&twelve, 1e-4).is_some(), "a tenth");
        let more = |n: usize| single(&(0..n).collect::<Vec<_>>(), 1e-4);
        assert!(more(13).is_some() && more(30).is_some(), "more than a tenth, far apart from all others");
        assert_eq!(more(31), None, "more than a quarter are no single ones");
        // Some that err little more than the others are one kind with them.
        let graded = |n: usize| {
            let of = |(i, observation)| {
                let error_m =
                    if i < n { 6e-4 } else { 1e-4 * (1.0 + 2.0 * f64::from(u8::from(i % 40 == 39))) };
                DwellError { observation, error_m, expected_m: 1e-4 }
            };
            single_dwells(&all.iter().enumerate().map(of).collect::<Vec<_>>(), 1.5)
        };
        assert!(graded(12).is_some());
        assert_eq!(graded(13), None, "more than a tenth, and not far apart from the others");
    }

    #[test]
    fn one_gross_dwell_is_no_place() {
        let all = observations(120);
        assert_eq!(places(&all, |i, _| if i == 17 { 1.0 } else { spread(i) }), vec![]);
    }
}
