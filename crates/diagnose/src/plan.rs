//! Which dwells to record next so that the surviving explanations part (notes 4.12, formula 11).
//!
//! For k fitted at theta and a rival l, `Delta = |(I - P_X) G_k theta|^2`, X = [J, G_l] with prior rows, is twice the
//! log-likelihood ratio to expect in favour of k when both are refitted. A dwell with rows `x` of X and `g` of `G_k theta`
//! adds
//!
//! ```text
//! v' (I + x A^-1 x')^-1 v,   v = g - x A^-1 b,   A = X'X + P,  b = X'G_k theta
//! ```
//!
//! which is formula (11) one dwell at a time. The greedy choice (T-optimality: Atkinson and Fedorov 1975, symmetric as
//! in Harman and Mueller 2017) adds the dwell that helps most over all ordered pairs, each pair counting until it is
//! settled.

use crate::config::DiagnosisConfig;
use crate::crossval::EFFECT_PRECISION;
use nalgebra::{DMatrix, DVector};
use serde::Serialize;

/// A pair at this Delta is settled with about 95 % certainty; more does not count.
const SETTLED: f64 = 20.0;

/// One of the explanations that survived.
#[derive(Debug, Clone)]
pub struct Survivor {
    /// Its name.
    pub name: String,
    /// Whitened columns on the data at typical size.
    pub columns: DMatrix<f64>,
    /// Fitted amplitudes in typical sizes.
    pub theta: DVector<f64>,
}

/// A dwell that could be recorded.
#[derive(Debug, Clone)]
pub struct PoolDwell {
    /// Whitened geometry rows, columns as in the problem.
    pub geometry: DMatrix<f64>,
    /// Whitened rows of each survivor, columns as there.
    pub effects: Vec<DMatrix<f64>>,
}

/// What to record and how much it tells.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Plan {
    /// Chosen dwells of the pool, the most telling first.
    pub chosen: Vec<usize>,
    /// How far each pair is apart.
    pub pairs: Vec<PlannedPair>,
    /// Smallest Delta over all pairs after each chosen dwell.
    pub smallest_delta: Vec<f64>,
    /// One sentence.
    pub sentence: String,
}

/// A pair of explanations, before and after the proposed dwells.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlannedPair {
    /// The explanations.
    pub names: [String; 2],
    /// Delta with the data at hand, the smaller of both directions.
    pub delta_before: f64,
    /// Delta expected with the proposed dwells.
    pub delta_after: f64,
    /// Whether any motion of the pool tells them apart.
    pub separable: bool,
}

/// One ordered pair: k true at its size, l fitted instead.
struct Rivalry {
    k: usize,
    l: usize,
    inverse: DMatrix<f64>,
    beta: DVector<f64>,
    delta: f64,
}

/// Proposes up to `count` dwells of a pool.
///
/// `geometry` and `precision`: whitened columns of the free parameters on the data at hand, as in a
/// [`Problem`](crate::Problem). A survivor without columns stands for "nothing": it is a rival, never the truth.
pub fn plan(
    geometry: &DMatrix<f64>,
    precision: &DVector<f64>,
    survivors: &[Survivor],
    pool: &[PoolDwell],
    count: usize,
    config: &DiagnosisConfig,
) -> Plan {
    let mut rivalries = Vec::new();
    for k in 0..survivors.len() {
        for l in (0..survivors.len()).filter(|l| *l != k && !survivors[k].theta.is_empty()) {
            rivalries.push(Rivalry::new(geometry, precision, survivors, k, l));
        }
    }
    let before: Vec<f64> = rivalries.iter().map(|r| r.delta).collect();
    let (mut chosen, mut smallest_delta) = (Vec::new(), Vec::new());
    while chosen.len() < count && rivalries.iter().any(|r| r.delta < SETTLED) {
        let gain = |dwell: &PoolDwell| -> f64 {
            rivalries
                .iter()
                .map(|r| (r.delta + r.gain(dwell, survivors)).min(SETTLED) - r.delta.min(SETTLED))
                .sum()
        };
        let gains: Vec<f64> = pool.iter().map(gain).collect();
        let Some(best) = (0..pool.len()).max_by(|a, b| gains[*a].total_cmp(&gains[*b]).then(b.cmp(a))) else {
            break;
        };
        if gains[best].is_nan() || gains[best] < 1e-3 {
            break;
        }
        rivalries.iter_mut().for_each(|r| r.add(&pool[best], survivors));
        chosen.push(best);
        smallest_delta.push(rivalries.iter().map(|r| r.delta).fold(f64::INFINITY, f64::min));
    }
    let pairs = pairs(survivors, &rivalries, &before, config);
    let sentence = sentence(&pairs, chosen.len(), config);
    Plan { chosen, pairs, smallest_delta, sentence }
}

fn pairs(
    survivors: &[Survivor],
    rivalries: &[Rivalry],
    before: &[f64],
    config: &DiagnosisConfig,
) -> Vec<PlannedPair> {
    let mut pairs = Vec::new();
    for (i, r) in rivalries.iter().enumerate() {
        let back = rivalries.iter().position(|o| o.k == r.l && o.l == r.k).unwrap_or(i);
        if back < i {
            continue;
        }
        let delta_after = r.delta.min(rivalries[back].delta);
        pairs.push(PlannedPair {
            names: [survivors[r.k].name.clone(), survivors[r.l].name.clone()],
            delta_before: before[i].min(before[back]),
            delta_after,
            separable: delta_after >= config.min_delta,
        });
    }
    pairs
}

fn sentence(pairs: &[PlannedPair], dwells: usize, config: &DiagnosisConfig) -> String {
    let stuck: Vec<String> = pairs.iter().filter(|p| !p.separable).map(|p| p.names.join(" and ")).collect();
    let rest = match stuck.is_empty() {
        true => String::new(),
        false => format!(
            "no motion will tell {} apart (expected log-likelihood ratio below {}): put a marker on the base or on a link, \
             or measure a motor current",
            stuck.join("; "),
            config.min_delta / 2.0
        ),
    };
    match (pairs.is_empty(), dwells) {
        (true, _) => "there is only one explanation; nothing is left to tell apart".to_string(),
        (false, 0) if stuck.is_empty() => "the data at hand tell the explanations apart already".to_string(),
        (false, _) if stuck.len() == pairs.len() => rest,
        (false, _) => {
            let told = format!("{dwells} more dwells tell the explanations apart");
            if rest.is_empty() { told } else { format!("{told}, except: {rest}") }
        }
    }
}

impl Rivalry {
    fn new(
        geometry: &DMatrix<f64>,
        precision: &DVector<f64>,
        survivors: &[Survivor],
        k: usize,
        l: usize,
    ) -> Rivalry {
        let x = joined(geometry, &survivors[l].columns);
        let signature = &survivors[k].columns * &survivors[k].theta;
        let mut a = x.tr_mul(&x);
        let p = geometry.ncols();
        for j in 0..a.nrows() {
            a[(j, j)] += if j < p { precision[j] } else { EFFECT_PRECISION };
        }
        let size = a.nrows();
        let inverse = a.cholesky().map_or_else(|| DMatrix::zeros(size, size), |c| c.inverse());
        let b = x.tr_mul(&signature);
        let beta = &inverse * &b;
        let delta = (signature.norm_squared() - b.dot(&beta)).max(0.0);
        Rivalry { k, l, inverse, beta, delta }
    }

    /// Rows x, innovation v, and the inverse of its covariance.
    fn innovation(
        &self,
        dwell: &PoolDwell,
        survivors: &[Survivor],
    ) -> Option<(DMatrix<f64>, DVector<f64>, DMatrix<f64>)> {
        let x = joined(&dwell.geometry, &dwell.effects[self.l]);
        let v = &dwell.effects[self.k] * &survivors[self.k].theta - &x * &self.beta;
        let s = DMatrix::identity(v.len(), v.len()) + &x * &self.inverse * x.transpose();
        Some((x, v, s.try_inverse()?))
    }

    fn gain(&self, dwell: &PoolDwell, survivors: &[Survivor]) -> f64 {
        self.innovation(dwell, survivors).map_or(0.0, |(_, v, s)| v.dot(&(s * &v)).max(0.0))
    }

    fn add(&mut self, dwell: &PoolDwell, survivors: &[Survivor]) {
        if let Some((x, v, s)) = self.innovation(dwell, survivors) {
            let spread = &self.inverse * x.transpose();
            self.delta += v.dot(&(&s * &v)).max(0.0);
            self.beta += &spread * (&s * v);
            self.inverse -= &spread * s * spread.transpose();
        }
    }
}

fn joined(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    let mut all = DMatrix::zeros(a.nrows(), a.ncols() + b.ncols());
    all.columns_mut(0, a.ncols()).copy_from(a);
    all.columns_mut(a.ncols(), b.ncols()).copy_from(b);
    all
}
