//! The one score of an explanation: what it says of dwells that its fit did not see.
//!
//! ```text
//! elpd = sum_g ln p(errors of group g | fit without them),   se(a - b) = sqrt(G/(G-1) sum_g (d_g - mean d)^2)
//! ```
//!
//! (Vehtari, Gelman, Gabry, Stat. Comput. 27:1413, 2017; Sivula, Magnusson, Vehtari, arXiv 2008.10296.) Whatever ranks, ties or
//! names explanations asks for such a difference; weights that look like probabilities are those of a Bayesian bootstrap of the
//! groups (pseudo-BMA+: Yao, Vehtari, Simpson, Gelman, Bayesian Anal. 13:917, 2018).

use crate::config::DiagnosisConfig;
use crate::judge::density::ln_by_group;
use crate::problem::Problem;
use crate::weigh::crossval::Group;
use armcal_calibrate::tails::ln_sum_exp;
use nalgebra::DVector;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Groups over which a difference of two scores is told with its standard error, at most: a power of two.
const GROUPS: usize = 16;
/// Standard errors from which a difference is clear (one-sided 99 %).
const CLEAR: f64 = 2.33;
/// A smaller difference is none, whatever its standard error [nats] (Sivula et al., section 3).
const SMALL_NATS: f64 = 4.0;

/// Which dwells every explanation predicts without having seen them, and which of these stand for one another.
#[derive(Debug, Clone)]
pub(crate) struct Exam {
    /// Dwells that are left out together.
    pub folds: Vec<Group>,
    /// Dwells of folds that are near each other, whose errors may be alike.
    pub groups: Vec<Vec<usize>>,
}

impl Exam {
    /// Of folds at places: those near each other in joint space are a group.
    pub fn by_pose(problem: &Problem, folds: Vec<Group>) -> Exam {
        Exam::new(folds, problem.joints(), |i| problem.dwells[i].joint_rad.clone())
    }

    /// Of folds that are stretches of time: those that follow each other are a group.
    pub fn by_time(problem: &Problem, folds: Vec<Group>) -> Exam {
        Exam::new(folds, 1, |i| vec![problem.dwells[i].time_s])
    }

    fn new(folds: Vec<Group>, axes: usize, place: impl Fn(usize) -> Vec<f64>) -> Exam {
        let centre = |fold: &Group| -> Vec<f64> {
            let all: Vec<Vec<f64>> = fold.scored.iter().map(|i| place(*i)).collect();
            (0..axes).map(|k| all.iter().map(|p| p[k]).sum::<f64>() / all.len().max(1) as f64).collect()
        };
        let centres: Vec<Vec<f64>> = folds.iter().map(centre).collect();
        let mut parts = vec![(0..folds.len()).collect::<Vec<usize>>()];
        while parts.len() < GROUPS && parts.iter().any(|part| part.len() > 1) {
            parts = parts.iter().flat_map(|part| halves(part, &centres)).collect();
        }
        let dwells = |part: Vec<usize>| part.into_iter().flat_map(|f| folds[f].scored.clone()).collect();
        let groups = parts.into_iter().map(dwells).collect();
        Exam { folds, groups }
    }
}

/// A set of folds in two halves, along the axis in which they differ most; as it is where it is one.
fn halves(part: &[usize], centres: &[Vec<f64>]) -> Vec<Vec<usize>> {
    if part.len() < 2 {
        return vec![part.to_vec()];
    }
    let spread = |k: &usize| {
        let of = || part.iter().map(|f| centres[*f][*k]);
        of().fold(f64::NEG_INFINITY, f64::max) - of().fold(f64::INFINITY, f64::min)
    };
    let widest = (0..centres[part[0]].len()).max_by(|a, b| spread(a).total_cmp(&spread(b))).unwrap_or(0);
    let mut sorted = part.to_vec();
    sorted.sort_by(|a, b| {
        let rest = || centres[*a].iter().zip(&centres[*b]).map(|(a, b)| a.total_cmp(b));
        let by_rest = || rest().find(|order| order.is_ne()).unwrap_or(std::cmp::Ordering::Equal);
        centres[*a][widest].total_cmp(&centres[*b][widest]).then_with(by_rest)
    });
    let rest = sorted.split_off(sorted.len() / 2);
    vec![sorted, rest]
}

/// What an explanation says of dwells that it did not see: ln predictive density, group by group [nats].
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Score {
    by_group: Vec<f64>,
}

impl Score {
    /// From whitened rows of errors, each dwell predicted without itself.
    pub fn of(problem: &Problem, left_out: &DVector<f64>, exam: &Exam) -> Score {
        Score { by_group: ln_by_group(problem, left_out, &exam.groups) }
    }

    /// What it is worth: less what its explanation costs [nats].
    pub fn worth(&self, cost: f64) -> f64 {
        self.by_group.iter().sum::<f64>() - cost
    }

    /// By how much it says more than another one.
    pub fn above(&self, other: &Score) -> Difference {
        let n = self.by_group.len() as f64;
        let each = || self.by_group.iter().zip(&other.by_group).map(|(a, b)| a - b);
        let nats: f64 = each().sum();
        let scatter: f64 = each().map(|d| (d - nats / n).powi(2)).sum();
        Difference { nats, se: (scatter * n / (n - 1.0).max(1.0)).sqrt() }
    }
}

/// A difference of two scores.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Difference {
    /// In favour of the first [nats].
    pub nats: f64,
    /// Its standard error over the groups.
    pub se: f64,
}

impl Difference {
    /// Less so many nats.
    pub fn less(self, nats: f64) -> Difference {
        Difference { nats: self.nats - nats, ..self }
    }

    /// Whether the first is better by more than chance, and by more than `detail` [nats].
    pub fn is_clear(self, detail: f64) -> bool {
        is_clear(self.nats, self.se, detail)
    }
}

/// Whether a difference of scores with its standard error is more than chance, and more than `detail` [nats].
pub fn is_clear(nats: f64, se: f64, detail: f64) -> bool {
    nats > (CLEAR * se).max(SMALL_NATS).max(detail)
}

/// Weights of explanations that look like probabilities: their shares in copies of the data whose groups are drawn anew. Each
/// comes with what it costs [nats]: of what predicts alike, the simpler is the more probable.
pub(crate) fn bootstrap_weights(scores: &[(&Score, f64)], config: &DiagnosisConfig) -> Vec<f64> {
    let groups = scores.first().map_or(0, |(score, _)| score.by_group.len());
    let mut rng = ChaCha8Rng::seed_from_u64(config.seed ^ 0x00b3_a0b0);
    let mut weights = vec![0.0; scores.len()];
    for _ in 0..config.resamplings {
        // Weights of a Dirichlet distribution: exponential ones over their sum, in which their sign cancels.
        let drawn: Vec<f64> = (0..groups).map(|_| (1.0 - rng.random::<f64>()).ln()).collect();
        let scale = groups as f64 / drawn.iter().sum::<f64>();
        let ln = |(score, cost): &(&Score, f64)| {
            let each = score.by_group.iter().zip(&drawn).map(|(ln, weight)| ln * weight);
            scale * each.sum::<f64>() - cost
        };
        let all: Vec<f64> = scores.iter().map(ln).collect();
        let total = ln_sum_exp(all.iter().copied());
        weights.iter_mut().zip(all).for_each(|(weight, ln)| *weight += (ln - total).exp());
    }
    weights.iter_mut().for_each(|weight| *weight /= config.resamplings as f64);
    weights
}

#[cfg(test)]
#[path = "../tests/score.rs"]
pub(crate) mod tests;
