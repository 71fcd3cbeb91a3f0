//! Two results on the same dwells.

use crate::pairing::{Paired, Unpaired, pair_dwells};
use crate::proto;
use crate::stored::{StoredResidual, StoredRun};
use armcal_calibrate::{Pair, PairedDifference, independent_groups};
use serde::Serialize;

/// Dwells listed as most better and most worse.
const LISTED: usize = 5;

/// What changed from one result to another.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// Effects in the models, before and after.
    pub effects: [Vec<String>; 2],
    /// Points that neither fit saw.
    pub held_out: Option<Difference>,
    /// All points in both.
    pub all: Option<Difference>,
    /// By recording, on the points judged (held out where there are any).
    pub recordings: Vec<(String, Difference)>,
    /// Dwells in one result only.
    pub unmatched: usize,
    /// Which these are, and why.
    pub unpaired: Vec<Unpaired>,
    /// Dwells whose error changed most, most improved first.
    pub dwells: Vec<DwellChange>,
    /// Parameters that both have, free in one of them, largest change in standard errors first.
    pub moved: Vec<Moved>,
    /// Names of parameters that only the second has.
    pub added: Vec<String>,
    /// Names of parameters that only the first has.
    pub removed: Vec<String>,
}

/// A paired difference in millimetres.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Difference {
    /// Dwells compared.
    pub n: usize,
    /// Groups treated as independent: cavities, or single dwells where the tip was tracked or cavities are few.
    pub groups: usize,
    /// Mean error before [mm].
    pub before_mm: f64,
    /// Mean error after [mm].
    pub after_mm: f64,
    /// After minus before [mm].
    pub difference_mm: f64,
    /// 95 % interval of it [mm]; null where there are fewer than two groups.
    pub ci95_mm: Option<[f64; 2]>,
    /// Dwells whose error fell.
    pub better: usize,
    /// Dwells whose error rose.
    pub worse: usize,
}

/// The error of one dwell in both results.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DwellChange {
    /// Name of the recording.
    pub recording: String,
    /// Index of the dwell.
    pub dwell: usize,
    /// Cavity; empty when the tip was tracked.
    pub cavity: String,
    /// Error before [mm].
    pub before_mm: f64,
    /// Error after [mm].
    pub after_mm: f64,
}

/// A parameter in both results.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Moved {
    /// Its name.
    pub name: String,
    /// Unit of the numbers.
    pub unit: String,
    /// Before.
    pub before: f64,
    /// After.
    pub after: f64,
    /// Change in units of the joint 95 % half width; above 1 the intervals do not explain it.
    pub in_half_widths: f64,
}

impl Comparison {
    /// Compares dwell by dwell: the same time of the same recording, whatever it is called in each result.
    pub fn of(before: &StoredRun, after: &StoredRun) -> Comparison {
        let Paired { pairs: matched, unpaired } = pair_dwells(before, after);
        let held: Vec<_> = matched.iter().copied().filter(|(b, a)| b.held_out && a.held_out).collect();
        let judged = if held.is_empty() { &matched } else { &held };
        let (added, removed) = (only_in(after, before), only_in(before, after));
        Comparison {
            effects: [before.effects.clone(), after.effects.clone()],
            held_out: paired_difference(&held),
            all: paired_difference(&matched),
            recordings: by_recording(judged),
            unmatched: unpaired.iter().map(|u| u.dwells).sum(),
            unpaired,
            dwells: most_changed(judged),
            moved: parameter_changes(before, after),
            added,
            removed,
        }
    }

    /// Held out, all, then each recording.
    pub fn differences(&self) -> Vec<(String, Difference)> {
        let whole = [("held out", self.held_out), ("all", self.all)];
        let whole = whole.into_iter().filter_map(|(name, d)| Some((name.to_owned(), d?)));
        whole.chain(self.recordings.iter().cloned()).collect()
    }
}

fn paired_difference(rows: &[(&StoredResidual, &StoredResidual)]) -> Option<Difference> {
    let dwells: Vec<_> = rows.iter().map(|(_, a)| (a.dwell.to_string(), Some(a.cavity.as_str()))).collect();
    let pairs: Vec<Pair> = rows
        .iter()
        .zip(independent_groups(&dwells))
        .map(|((b, a), group)| Pair { group, before_m: b.error_m, after_m: a.error_m })
        .collect();
    let d = PairedDifference::of(&pairs)?;
    let mm = |m: f64| m * 1e3;
    Some(Difference {
        n: d.n,
        groups: d.groups,
        before_mm: mm(d.before_m),
        after_mm: mm(d.after_m),
        difference_mm: mm(d.difference_m),
        ci95_mm: d.ci95_m[0].is_finite().then_some(d.ci95_m.map(mm)),
        better: d.better,
        worse: d.worse,
    })
}

fn by_recording(rows: &[(&StoredResidual, &StoredResidual)]) -> Vec<(String, Difference)> {
    let mut names: Vec<&str> = Vec::new();
    for (_, a) in rows {
        if !names.contains(&a.recording.as_str()) {
            names.push(&a.recording);
        }
    }
    let of = |name: &str| rows.iter().copied().filter(|(_, a)| a.recording == name).collect::<Vec<_>>();
    names.iter().filter_map(|name| paired_difference(&of(name)).map(|d| ((*name).to_owned(), d))).collect()
}

/// The most improved dwells, then the most worsened.
fn most_changed(rows: &[(&StoredResidual, &StoredResidual)]) -> Vec<DwellChange> {
    let mut all: Vec<DwellChange> = rows
        .iter()
        .map(|(b, a)| DwellChange {
            recording: a.recording.clone(),
            dwell: a.dwell.dwell,
            cavity: a.cavity.clone(),
            before_mm: b.error_m * 1e3,
            after_mm: a.error_m * 1e3,
        })
        .collect();
    all.sort_by(|x, y| (x.after_mm - x.before_mm).total_cmp(&(y.after_mm - y.before_mm)));
    if all.len() > 2 * LISTED {
        all.drain(LISTED..all.len() - LISTED);
    }
    all
}

fn parameter_changes(before: &StoredRun, after: &StoredRun) -> Vec<Moved> {
    let mut moved: Vec<Moved> = after
        .parameters
        .iter()
        .filter_map(|a| before.parameters.iter().find(|b| b.name == a.name).map(|b| (b, a)))
        .filter(|(b, a)| b.free || a.free)
        .map(|(b, a)| Moved {
            name: a.name.clone(),
            unit: a.display_unit.clone(),
            before: b.display_value,
            after: a.display_value,
            in_half_widths: in_half_widths(b, a),
        })
        .collect();
    moved.sort_by(|x, y| y.in_half_widths.total_cmp(&x.in_half_widths));
    moved
}

fn in_half_widths(b: &proto::Parameter, a: &proto::Parameter) -> f64 {
    let change = (a.display_value - b.display_value).abs();
    let width = a.display_ci95_half.hypot(b.display_ci95_half);
    if change == 0.0 { 0.0 } else { change / width }
}

fn only_in(one: &StoredRun, other: &StoredRun) -> Vec<String> {
    let has = |run: &StoredRun, name: &str| run.parameters.iter().any(|p| p.name == name);
    one.parameters.iter().filter(|p| !has(other, &p.name)).map(|p| p.name.clone()).collect()
}
