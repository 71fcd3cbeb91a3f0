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
//!
//! `J`, `G` and rows of dwells are whitened: in standard deviations of the declared noise, geometry by its parameters,
//! effects by amplitudes in typical sizes. So `Delta` has no unit, and none of it knows of arms.

use nalgebra::{DMatrix, DVector};

/// Precision of an amplitude's prior, in typical sizes: ten of them, so that it hardly holds it back.
pub const AMPLITUDE_PRECISION: f64 = 0.01;

/// A pair at this Delta is settled with about 95 % certainty; more does not count.
const SETTLED: f64 = 20.0;
/// A dwell that adds less than this to all pairs together is not worth the time.
const NOTHING_GAINED: f64 = 1e-3;

/// What the data at hand say of the parameters that are free under every explanation.
#[derive(Debug, Clone)]
pub struct Geometry {
    /// Whitened columns on the data.
    pub columns: DMatrix<f64>,
    /// Prior precision of each.
    pub precision: DVector<f64>,
}

/// One of the explanations that survived. One without columns stands for "nothing": it is a rival, never the truth.
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
    /// Whitened geometry rows, columns as in the data.
    pub geometry: DMatrix<f64>,
    /// Whitened rows of each survivor, columns as there.
    pub effects: Vec<DMatrix<f64>>,
}

/// What to record and how much it tells.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Chosen dwells of the pool, the most telling first.
    pub chosen: Vec<usize>,
    /// Smallest Delta over all pairs after each chosen dwell.
    pub smallest_delta: Vec<f64>,
}

/// Proposes up to `count` dwells of a pool.
pub fn choose_dwells(geometry: &Geometry, survivors: &[Survivor], pool: &[PoolDwell], count: usize) -> Plan {
    let mut rivalries = Vec::new();
    for k in 0..survivors.len() {
        for l in (0..survivors.len()).filter(|l| *l != k && !survivors[k].theta.is_empty()) {
            rivalries.push(Rivalry::new(geometry, survivors, k, l));
        }
    }
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
        if gains[best].is_nan() || gains[best] < NOTHING_GAINED {
            break;
        }
        rivalries.iter_mut().for_each(|r| r.add(&pool[best], survivors));
        chosen.push(best);
        smallest_delta.push(rivalries.iter().map(|r| r.delta).fold(f64::INFINITY, f64::min));
    }
    Plan { chosen, smallest_delta }
}

/// Delta of a pair with some dwells of the pool beside the data, the smaller of both directions that there are; infinite
/// where there is none.
pub fn pair_delta(
    geometry: &Geometry,
    survivors: &[Survivor],
    dwells: &[&PoolDwell],
    (a, b): (usize, usize),
) -> f64 {
    [(a, b), (b, a)]
        .into_iter()
        .filter(|(true_one, _)| !survivors[*true_one].theta.is_empty())
        .map(|(true_one, rival)| one_way_delta(geometry, survivors, dwells, true_one, rival))
        .fold(f64::INFINITY, f64::min)
}

/// `|(I - P) G theta|^2`: what the rival and the geometry leave of the true one's signature.
fn one_way_delta(
    geometry: &Geometry,
    survivors: &[Survivor],
    dwells: &[&PoolDwell],
    true_one: usize,
    rival: usize,
) -> f64 {
    let size = geometry.columns.ncols() + survivors[rival].columns.ncols();
    let mut a = DMatrix::zeros(size, size);
    for j in 0..size {
        a[(j, j)] = geometry.precision_of(j);
    }
    let (mut b, mut c) = (DVector::zeros(size), 0.0);
    let mut add = |geometry: &DMatrix<f64>, own: &DMatrix<f64>, other: &DMatrix<f64>| {
        let x = join_columns(geometry, other);
        let signature = own * &survivors[true_one].theta;
        a += x.tr_mul(&x);
        b += x.tr_mul(&signature);
        c += signature.norm_squared();
    };
    add(&geometry.columns, &survivors[true_one].columns, &survivors[rival].columns);
    for dwell in dwells {
        add(&dwell.geometry, &dwell.effects[true_one], &dwell.effects[rival]);
    }
    let explained = a.cholesky().map_or(c, |a| b.dot(&a.solve(&b)));
    (c - explained).max(0.0)
}

impl Geometry {
    /// Prior precision of column `j`, those of an effect after those of the geometry.
    fn precision_of(&self, j: usize) -> f64 {
        self.precision.get(j).copied().unwrap_or(AMPLITUDE_PRECISION)
    }
}

/// One ordered pair: k true at its size, l fitted instead.
struct Rivalry {
    k: usize,
    l: usize,
    /// `A^-1`.
    inverse: DMatrix<f64>,
    /// `A^-1 b`.
    beta: DVector<f64>,
    delta: f64,
}

impl Rivalry {
    fn new(geometry: &Geometry, survivors: &[Survivor], k: usize, l: usize) -> Rivalry {
        let x = join_columns(&geometry.columns, &survivors[l].columns);
        let signature = &survivors[k].columns * &survivors[k].theta;
        let mut a = x.tr_mul(&x);
        for j in 0..a.nrows() {
            a[(j, j)] += geometry.precision_of(j);
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
        let x = join_columns(&dwell.geometry, &dwell.effects[self.l]);
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

/// Columns side by side.
fn join_columns(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    let mut all = DMatrix::zeros(a.nrows(), a.ncols() + b.ncols());
    all.columns_mut(0, a.ncols()).copy_from(a);
    all.columns_mut(a.ncols(), b.ncols()).copy_from(b);
    all
}

#[cfg(test)]
#[path = "discrimination_tests.rs"]
#[allow(clippy::unwrap_used, reason = "a test may stop")]
mod tests;
