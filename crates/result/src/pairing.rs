//! Which dwells of two results are the same dwell.
//!
//! Names and indices say little: two recordings may share a name, and other settings number dwells anew. A recording is the
//! same where its files hold the same bytes, or, re-encoded or cut, the same dwells; a dwell is the same where its time is.

use crate::stored::{StoredDwell, StoredRecording, StoredResidual, StoredRun};
use crate::{DwellMark, also_in};
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt;

/// One of two results.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Side {
    /// The first.
    Before,
    /// The second.
    After,
}

/// Dwells of one result that have no partner in the other.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Unpaired {
    /// The result they are in.
    pub only_in: Side,
    /// Their recording.
    pub recording: String,
    /// How many.
    pub dwells: usize,
    /// Why they have none.
    pub why: String,
}

impl fmt::Display for Unpaired {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Unpaired { only_in, recording, dwells, why } = self;
        let side = match only_in {
            Side::Before => "before",
            Side::After => "after",
        };
        let noun = if *dwells == 1 { "dwell" } else { "dwells" };
        write!(f, "{dwells} {noun} of `{recording}` ({side}): {why}")
    }
}

/// What two results have in common.
pub struct Paired<'r> {
    /// Before and after, in the order of the second.
    pub pairs: Vec<(&'r StoredResidual, &'r StoredResidual)>,
    /// Everything else.
    pub unpaired: Vec<Unpaired>,
}

/// Pairs dwells by recording and time, each once.
pub fn pair_dwells<'r>(before: &'r StoredRun, after: &'r StoredRun) -> Paired<'r> {
    let (one, other) = (Times::of(before), Times::of(after));
    let same = |b: &StoredRecording| after.recordings.iter().map(|a| is_same(a, b)).collect::<Vec<bool>>();
    let same: Vec<Vec<bool>> = before.recordings.iter().map(same).collect();
    let is = |b: usize, a: usize| same.get(b).and_then(|same| same.get(a)).is_some_and(|same| *same);
    let mut used = vec![false; before.residuals.len()];
    let mut pairs = Vec::new();
    let mut left = Left::default();
    for (at, a) in after.residuals.iter().enumerate() {
        match one.partner(&other, at, a.feature.as_deref(), |b| is(b, a.dwell.recording)) {
            Ok(partner) if !used[partner] => {
                used[partner] = true;
                pairs.push((&before.residuals[partner], a));
            }
            Ok(_) => left.add(Side::After, a, TWICE),
            Err(why) => left.add(Side::After, a, why),
        }
    }
    for (at, b) in before.residuals.iter().enumerate().filter(|(at, _)| !used[*at]) {
        let partner = other.partner(&one, at, b.feature.as_deref(), |a| is(b.dwell.recording, a));
        left.add(Side::Before, b, partner.map_or_else(|why| why, |_| TWICE));
    }
    Paired { pairs, unpaired: left.told }
}

/// Why a copy of a dwell within one result has no partner.
const TWICE: &str = "the result has them twice, and they count once";

/// Dwells in the order of time, each with the index of its residual.
type InTime<'r> = Vec<(&'r StoredDwell, usize)>;

/// The observed dwells of a result by time.
struct Times<'r> {
    /// Times of the dwell of each residual.
    dwell_of: Vec<Option<&'r StoredDwell>>,
    /// Residuals of each recording with their dwells, by what was measured, by time.
    by_recording: Vec<BTreeMap<Option<&'r str>, InTime<'r>>>,
}

impl<'r> Times<'r> {
    fn of(run: &'r StoredRun) -> Times<'r> {
        let known: BTreeMap<(usize, usize), &StoredDwell> = (run.recordings.iter().enumerate())
            .flat_map(|(r, recording)| recording.dwells.iter().map(move |d| ((r, d.index), d)))
            .collect();
        let dwell_of: Vec<_> =
            (run.residuals.iter()).map(|r| known.get(&(r.dwell.recording, r.dwell.dwell)).copied()).collect();
        let mut by_recording = vec![BTreeMap::<_, InTime<'r>>::new(); run.recordings.len()];
        for (at, (residual, dwell)) in run.residuals.iter().zip(&dwell_of).enumerate() {
            if let (Some(own), Some(dwell)) = (by_recording.get_mut(residual.dwell.recording), dwell) {
                own.entry(residual.feature.as_deref()).or_default().push((*dwell, at));
            }
        }
        let all = by_recording.iter_mut().flat_map(BTreeMap::values_mut);
        all.for_each(|own| own.sort_by_key(|(dwell, at)| (dwell.start_ns, *at)));
        Times { dwell_of, by_recording }
    }

    /// The residual here of this feature in the dwell that is residual `at` of `other`, or why there is none; `same` says which
    /// recordings here are the same as its own.
    fn partner(
        &self,
        other: &Times<'_>,
        at: usize,
        feature: Option<&str>,
        same: impl Fn(usize) -> bool,
    ) -> Result<usize, &'static str> {
        let Some(dwell) = other.dwell_of[at] else { return Err("their result does not say when they were") };
        let own: Vec<usize> = (0..self.by_recording.len()).filter(|r| same(*r)).collect();
        if own.is_empty() {
            return Err("the other result is not made from this recording");
        }
        let found = own.iter().find_map(|r| at_time(self.by_recording[*r].get(&feature)?, dwell));
        found.map(|(_, at)| *at).ok_or("the other result used no dwell of this recording at their times")
    }
}

/// The dwell whose middle lies in this one, and the middle of this one in it.
fn at_time<'d, 'r>(
    observed: &'d [(&'r StoredDwell, usize)],
    dwell: &StoredDwell,
) -> Option<&'d (&'r StoredDwell, usize)> {
    let time_ns = dwell.mark.time_ns;
    let next = observed.partition_point(|(d, _)| d.start_ns <= time_ns);
    let found = &observed[next.checked_sub(1)?];
    let covers = |d: &StoredDwell, time_ns: i64| (d.start_ns..=d.end_ns).contains(&time_ns);
    (covers(found.0, time_ns) && covers(dwell, found.0.mark.time_ns)).then_some(found)
}

/// Whether two recordings hold the same: a file, or dwells.
fn is_same(a: &StoredRecording, b: &StoredRecording) -> bool {
    let marks = |r: &StoredRecording| r.dwells.iter().map(|d| d.mark).collect::<Vec<DwellMark>>();
    a.identities.iter().any(|file| !file.is_empty() && b.identities.contains(file))
        || also_in(&marks(a), &marks(b)).contains(&true)
}

/// Dwells left over, counted by recording and reason in the order in which they are met.
#[derive(Default)]
struct Left {
    told: Vec<Unpaired>,
}

impl Left {
    fn add(&mut self, only_in: Side, residual: &StoredResidual, why: &str) {
        let same =
            |u: &&mut Unpaired| u.only_in == only_in && u.recording == residual.recording && u.why == why;
        match self.told.iter_mut().find(same) {
            Some(known) => known.dwells += 1,
            None => self.told.push(Unpaired {
                only_in,
                recording: residual.recording.clone(),
                dwells: 1,
                why: why.to_owned(),
            }),
        }
    }
}
