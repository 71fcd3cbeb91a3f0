//! The signs that clusters of dwells are drawn with, and many numbers a cluster times all of them.
//!
//! Signs of independent draws would make every resampling a matrix product. These are Walsh functions: each cluster is given a
//! place x of `2^k`, drawn at random, and resampling b multiplies it by `(-1)^(b . x)`, the bits of b and x multiplied and
//! summed. All `2^k` of them are a group, so that the share of resamplings which are as large as what was observed is a
//! p-value exactly where signs are exchangeable (Hemerik and Goeman, TEST 27:811, 2018, theorems 1 and 2: a group, or draws
//! from one without repetition); any two clusters agree in half of them. And all sums are one fast transform, `2^k k` additions.

use crate::errors::sign_flips::SignFlips;
use nalgebra::DMatrix;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Of fewer clusters there are too few signs: weights of six points instead (Webb, Queen's Economics 1315).
const FEWEST: usize = 12;

/// What each cluster is multiplied by in every resampling.
#[derive(Debug, Clone)]
pub enum Signs {
    /// Weights: clusters x resamplings.
    Webb(DMatrix<f64>),
    /// The place of each cluster among so many, and the function of each resampling.
    Walsh {
        /// Number of places, and of functions: a power of two.
        order: usize,
        /// Of each cluster.
        places: Vec<usize>,
        /// Of each resampling.
        functions: Vec<usize>,
    },
}

impl Signs {
    /// Of so many clusters; drawn from a stream of the seed's own, so threads do not matter.
    pub fn new(clusters: usize, flips: SignFlips) -> Signs {
        let mut rng = ChaCha8Rng::seed_from_u64(flips.seed);
        if clusters < FEWEST {
            let points = [1.5f64, 1.0, 0.5].map(f64::sqrt);
            let mut weight = |_, _| {
                let k = rng.random_range(0..6usize);
                if k < 3 { points[k] } else { -points[k - 3] }
            };
            return Signs::Webb(DMatrix::from_fn(clusters, flips.draws, &mut weight));
        }
        let order = (flips.draws + 1).max(clusters).next_power_of_two();
        let mut drawn = |from: usize, count: usize| {
            let mut all: Vec<usize> = (from..order).collect();
            all.shuffle(&mut rng);
            all.truncate(count);
            all
        };
        let places = drawn(0, clusters);
        // The first function multiplies by one: it is what was observed.
        Signs::Walsh { order, places, functions: drawn(1, flips.draws) }
    }

    /// Sums over the clusters, each with its sign: rows of `clusters` numbers become rows x resamplings.
    pub fn times(&self, numbers: &DMatrix<f64>) -> DMatrix<f64> {
        match self {
            Signs::Webb(weights) => numbers * weights,
            Signs::Walsh { order, places, functions } => {
                let mut all = DMatrix::zeros(numbers.nrows(), *order);
                for (place, own) in places.iter().zip(numbers.column_iter()) {
                    all.set_column(*place, &own);
                }
                hadamard_transform(all.as_mut_slice(), numbers.nrows());
                all.select_columns(functions)
            }
        }
    }

    /// Sums over the clusters, each times the square of its weight.
    pub fn squared_times(&self, numbers: &DMatrix<f64>) -> Vec<f64> {
        match self {
            Signs::Webb(weights) => (numbers * weights.map(|w| w * w)).as_slice().to_vec(),
            Signs::Walsh { functions, .. } => vec![numbers.sum(); functions.len()],
        }
    }
}

/// Hadamard's transform of many rows at once: column b becomes the sum of all columns x, times `(-1)^(b . x)`.
fn hadamard_transform(columns: &mut [f64], rows: usize) {
    let mut half = rows;
    while half > 0 && half < columns.len() {
        for pair in columns.chunks_exact_mut(2 * half) {
            let (first, second) = pair.split_at_mut(half);
            for (a, b) in first.iter_mut().zip(second) {
                (*a, *b) = (*a + *b, *a - *b);
            }
        }
        half *= 2;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn signs(clusters: usize, resamplings: usize) -> Signs {
        Signs::new(clusters, SignFlips { draws: resamplings, seed: 5 })
    }

    /// Each cluster alone: clusters x resamplings.
    fn table(of: &Signs, clusters: usize) -> DMatrix<f64> {
        of.times(&DMatrix::identity(clusters, clusters))
    }

    #[test]
    fn sums_are_those_of_the_signs_one_by_one() {
        let numbers = DMatrix::from_fn(3, 37, |i, g| ((i + 1) * (g + 2)) as f64 % 7.5 - 3.0);
        for (clusters, resamplings) in [(37, 199), (8, 50)] {
            let numbers = numbers.columns(0, clusters).into_owned();
            let (of, row) = (signs(clusters, resamplings), numbers.rows(0, 1).into_owned());
            let table = table(&of, clusters);
            assert_eq!(table.shape(), (clusters, resamplings));
            assert!((of.times(&numbers) - &numbers * &table).amax() < 1e-12);
            let squares = &row * table.map(|w| w * w);
            assert!(of.squared_times(&row).iter().zip(squares.iter()).all(|(a, b)| (a - b).abs() < 1e-12));
        }
    }

    #[test]
    fn signs_are_a_group_in_which_any_two_clusters_agree_half_the_time() {
        let (clusters, resamplings) = (37, 63);
        let table = table(&signs(clusters, resamplings), clusters);
        assert!(table.iter().all(|sign| sign.abs() == 1.0));
        let columns: Vec<Vec<f64>> = table.column_iter().map(|c| c.iter().copied().collect()).collect();
        let observed = vec![1.0; clusters];
        for (k, a) in columns.iter().enumerate() {
            assert!(
                *a != observed && !columns[..k].contains(a),
                "each once, and none of them what was observed"
            );
            for b in &columns {
                let product: Vec<f64> = a.iter().zip(b).map(|(a, b)| a * b).collect();
                assert!(product == observed || columns.contains(&product));
            }
        }
        // With what was observed 32 of 64 agree.
        for a in 0..clusters {
            for b in 0..a {
                assert_eq!(table.row(a).dot(&table.row(b)), -1.0);
            }
        }
    }

    #[test]
    fn another_seed_draws_other_signs() {
        let of = |seed| table(&Signs::new(40, SignFlips { draws: 999, seed }), 40);
        assert_eq!(of(1), of(1));
        assert_ne!(of(1), of(2));
    }
}
