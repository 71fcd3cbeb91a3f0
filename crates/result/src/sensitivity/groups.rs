//! Where the error is large: its mean by recording, direction of arrival, joint range, time and load.

use super::basis::Basis;
use crate::by_marker::{self, is_told};
use crate::run::Run;
use armcal_calibrate::{grouped_ci95, independent_groups};
use serde::Serialize;
use std::collections::BTreeMap;

/// Parts into which the range of a joint is cut.
const THIRDS: [&str; 3] = ["low", "middle", "high"];

/// Mean error of some dwells.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Group {
    /// What the dwells are grouped by.
    pub by: &'static str,
    /// Which of its groups.
    pub name: String,
    /// Dwells in it.
    pub n: usize,
    /// Mean error [mm].
    pub mean_mm: f64,
    /// 95 % interval of the mean [mm]; `null` for one place alone.
    pub ci95_mm: Option<[f64; 2]>,
}

/// Groups of the dwells whose error counts: `None` for the others.
pub fn groups(run: &Run, basis: &Basis, error_mm: &[Option<f64>]) -> Vec<Group> {
    let dwells: Vec<(String, Option<&str>)> =
        run.observations.iter().map(|o| (o.dwell.to_string(), o.cavity())).collect();
    let table = Table { places: independent_groups(&dwells), error_mm };
    let mut all = Vec::new();
    for (index, recording) in run.recordings.iter().enumerate() {
        let own = |i: usize| run.observations[i].dwell.recording == index;
        all.extend(table.group("recording", recording.name.clone(), own));
    }
    let measured: BTreeMap<_, _> = run.observations.iter().map(|o| (o.what(), o)).collect();
    for (what, o) in measured.into_iter().filter(|_| is_told(run)) {
        all.extend(
            table.group("marker", by_marker::marker_name(run, o), |i| run.observations[i].what() == what),
        );
    }
    let names = run.model.chain().joint_names();
    for (j, name) in names.iter().enumerate() {
        for (sign, word) in [(1, "+"), (-1, "−")] {
            all.extend(table.group("arrival", format!("{name} {word}"), |i| basis.arrival[j][i] == sign));
        }
    }
    for (j, name) in names.iter().enumerate() {
        let part = thirds(&run.observations.iter().map(|o| o.joint_rad[j]).collect::<Vec<f64>>());
        for (k, word) in THIRDS.iter().enumerate() {
            all.extend(table.group("joint angle", format!("{name} {word}"), |i| part[i] == k));
        }
    }
    let time = run.recorded_time();
    let part = thirds(&run.observations.iter().map(|o| time.at_min(o)).collect::<Vec<f64>>());
    for (k, word) in ["first", "second", "last"].iter().enumerate() {
        all.extend(table.group("time", format!("{word} third"), |i| part[i] == k));
    }
    let seated = |i: usize| run.observations[i].cavity().is_some();
    if (0..run.observations.len()).any(seated) && !(0..run.observations.len()).all(seated) {
        all.extend(table.group("place", "seated in a cavity".into(), seated));
        all.extend(table.group("place", "free, tracked".into(), |i| !seated(i)));
    }
    all
}

/// Errors, and what each shares its luck with.
pub struct Table<'a> {
    pub places: Vec<String>,
    /// `None` for an error that does not count.
    pub error_mm: &'a [Option<f64>],
}

impl Table<'_> {
    /// The mean of those in a group; none where it is empty.
    pub fn group(&self, by: &'static str, name: String, is_in: impl Fn(usize) -> bool) -> Option<Group> {
        let mut sums: BTreeMap<&str, (f64, f64)> = BTreeMap::new();
        for (i, error) in self.error_mm.iter().enumerate() {
            if let Some(error) = error.filter(|_| is_in(i)) {
                let (sum, size) = sums.entry(&self.places[i]).or_default();
                *sum += error;
                *size += 1.0;
            }
        }
        let sums: Vec<(f64, f64)> = sums.into_values().collect();
        let n: f64 = sums.iter().map(|s| s.1).sum();
        if n == 0.0 {
            return None;
        }
        let mean_mm = sums.iter().map(|s| s.0).sum::<f64>() / n;
        let ci95 = grouped_ci95(&sums);
        Some(Group { by, name, n: n as usize, mean_mm, ci95_mm: ci95[0].is_finite().then_some(ci95) })
    }
}

/// The third of its range that each value lies in.
fn thirds(values: &[f64]) -> Vec<usize> {
    let (low, high) =
        values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    let of = |v: &f64| (((v - low) / (high - low) * 3.0) as usize).min(2);
    values.iter().map(of).collect()
}
