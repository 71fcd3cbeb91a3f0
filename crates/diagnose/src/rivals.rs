//! Names against their rivals, each refitted: a linearised model proposes, what is left after a fit decides.
//!
//! ```text
//! ln E = -(r'r + x'Px) / 2 s^2 - 1/2 ln det(I + P^-1 J'J / s^2)
//! ```
//!
//! at the fitted point, x the parameters and P their prior precision (Laplace's approximation: MacKay, Information Theory,
//! Inference, and Learning Algorithms, 27), `s^2` the variance that the best of them leaves, at least the declared one.

use crate::DiagnoseError;
use crate::config::DiagnosisConfig;
use crate::forward::Accepted;
use crate::judge::Grade;
use crate::noise::Noise;
use crate::problem::Candidate;
use crate::rooms::{Room, Rooms};
use crate::search::Search;
use nalgebra::DMatrix;

/// Entries that are no part of the answer and are refitted all the same, the best of them.
const RIVALS: usize = 3;
/// What the linearised fit puts further behind cannot come back [nats], nor what it puts further behind than this share of
/// the evidence: around a geometry that has gone to its bounds, a slip of 2 deg in one recording is 11 % behind what it is.
const OUT_OF_REACH: f64 = 40.0;
const REACH_SHARE: f64 = 0.5;
/// A name that the linearised fit left in the answer leaves it so many margins behind the best refit, if that is more than
/// the detail of its shape.
const FAR_BEHIND: f64 = 2.0;
/// Where noise repeats, what leaves less than this many times the squared error leaves no more.
const NO_MORE: f64 = 1.01;

/// What a refit leaves.
#[derive(Debug, Clone)]
pub struct AfterRefit {
    /// Squared whitened residual and squared distance from the priors.
    pub square: f64,
    /// Rows of the residual.
    pub rows: usize,
    /// `P^-1/2 J'J P^-1/2` of the free parameters.
    pub normal: DMatrix<f64>,
}

impl AfterRefit {
    /// Variance that it leaves, declared noise = 1.
    fn variance(&self) -> f64 {
        self.square / self.rows.saturating_sub(self.normal.nrows()).max(1) as f64
    }

    /// ln evidence at a noise variance; none of a model that no fit settles.
    fn ln_evidence(&self, variance: f64) -> Option<f64> {
        let n = self.normal.nrows();
        let factor = (DMatrix::identity(n, n) + &self.normal / variance).cholesky()?;
        let half_ln_det: f64 = factor.l_dirty().diagonal().iter().map(|v| v.ln()).sum();
        Some(-0.5 * self.square / variance - half_ln_det)
    }
}

/// Settles the names of what was found: a rival that explains more after the refit takes the place of a name, one that
/// explains as much stands beside it, and one that is far behind leaves the answer.
pub(crate) fn settle(
    search: &mut Search,
    rooms: &mut Rooms<'_>,
    config: &DiagnosisConfig,
) -> Result<(), DiagnoseError> {
    for i in 0..search.accepted.len() {
        let others: Vec<Candidate> = search
            .accepted
            .iter()
            .enumerate()
            .filter(|(k, _)| *k != i)
            .map(|(_, a)| a.candidate.clone())
            .collect();
        if let Some(settled) = settled(&search.accepted[i], &others, rooms, config)? {
            search.accepted[i] = settled;
        }
    }
    Ok(())
}

/// One of them; none where it stays as it is.
fn settled(
    found: &Accepted,
    others: &[Candidate],
    rooms: &mut Rooms<'_>,
    config: &DiagnosisConfig,
) -> Result<Option<Accepted>, DiagnoseError> {
    let room = found.room.clone();
    if found.candidate.known.is_some() || !found.judged.impossible.is_empty() {
        return Ok(None);
    }
    let mut refitted = |k: usize| {
        let with = [others, std::slice::from_ref(&room.weighed.entries[k].candidate)].concat();
        rooms.refitted(&with)
    };
    if !room.weighed.probably(&[Noise::White]) {
        return beside_simpler(found, &mut refitted);
    }
    let mut refits = Vec::new();
    for k in found.judged.set.iter().copied().chain(rivals(found, &room)) {
        refits.extend(refitted(k)?.map(|refit| (k, refit)));
    }
    let variance = refits.iter().map(|(_, r)| r.variance()).fold(f64::INFINITY, f64::min).max(1.0);
    let evidence: Vec<(usize, f64)> =
        refits.iter().filter_map(|(k, r)| Some((*k, r.ln_evidence(variance)?))).collect();
    Ok(decided(found, &evidence, config))
}

/// Noise that repeats counts the same error more than once: the weighing knows, the evidence of a refit does not. What has no
/// more amplitudes than the name and leaves no more is no worse an answer whatever the noise: it stands beside it.
fn beside_simpler(
    found: &Accepted,
    refitted: &mut dyn FnMut(usize) -> Result<Option<AfterRefit>, DiagnoseError>,
) -> Result<Option<Accepted>, DiagnoseError> {
    let amplitudes = |k: usize| found.room.weighed.entries[k].candidate.amplitudes.len();
    let own = found.judged.entry;
    let simpler: Vec<usize> =
        rivals(found, &found.room).into_iter().filter(|k| amplitudes(*k) <= amplitudes(own)).collect();
    let left = if simpler.is_empty() { None } else { refitted(own)? };
    let Some(left) = left else { return Ok(None) };
    let mut with_rivals = found.clone();
    for k in simpler {
        if refitted(k)?.is_some_and(|rival| rival.square < NO_MORE * left.square) {
            with_rivals.judged.set.push(k);
        }
    }
    Ok((with_rivals.judged.set != found.judged.set).then_some(with_rivals))
}

/// The best entries that are not in the answer: neither by another value of their shape, nor as a group that holds it.
fn rivals(found: &Accepted, room: &Room) -> Vec<usize> {
    let weighed = &room.weighed;
    let own = weighed.entries[found.judged.entry].ln_evidence;
    let another = |k: &usize| {
        let entry = &weighed.entries[*k];
        !entry.candidate.is_group()
            && entry.ln_evidence > own - OUT_OF_REACH.max(REACH_SHARE * own)
            && found.judged.set.iter().all(|s| !weighed.one_name(*s, *k))
    };
    weighed.ranking().into_iter().filter(another).take(RIVALS).collect()
}

/// The answer by the evidence of the refits, ln; none where it stays as it is.
fn decided(found: &Accepted, evidence: &[(usize, f64)], config: &DiagnosisConfig) -> Option<Accepted> {
    let of = |k: usize| evidence.iter().find(|(l, _)| *l == k).map(|(_, ln)| *ln);
    let own = of(found.judged.entry)?;
    let (best, best_ln) = evidence.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let mut judged = found.judged.clone();
    let mut grade = found.grade;
    if best_ln > own + config.margin_nats {
        judged = found.room.judge(best, config);
        grade = judged.grade(&found.room.weighed, config);
        if !judged.impossible.is_empty() {
            // What came out as no such mechanism can does not take a name.
            (judged, grade) = (found.judged.clone(), found.grade);
        } else if grade == Grade::Refused {
            // What explains more after the refit cannot be named, so neither can the other alone.
            (judged, grade) = (found.judged.clone(), Grade::OrUnlisted);
        }
    }
    let lead = of(judged.entry)?.max(best_ln);
    let weighed = &found.room.weighed;
    let far_behind = (FAR_BEHIND * config.margin_nats).max(weighed.detail_nats(judged.entry, config));
    let kept = found.judged.set.iter().copied().filter(|k| of(*k).is_none_or(|ln| ln > lead - far_behind));
    let mut alike: Vec<(usize, f64)> =
        evidence.iter().copied().filter(|(_, ln)| *ln > lead - config.margin_nats).collect();
    alike.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut set = vec![judged.entry];
    for k in alike.into_iter().map(|(k, _)| k).chain(kept) {
        if set.iter().all(|s| !weighed.one_name(*s, k)) {
            set.push(k);
        }
    }
    judged.set = set;
    let candidate = weighed.entries[judged.entry].candidate.clone();
    let same = judged.set == found.judged.set && grade == found.grade;
    (!same).then(|| Accepted { candidate, judged, grade, refits: evidence.to_vec(), ..found.clone() })
}

#[cfg(test)]
#[path = "tests/rivals.rs"]
mod tests;
