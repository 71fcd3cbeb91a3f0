//! Whether a sum over groups is clear of zero: the share of sign flips of the groups that reach it.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Its own stream of the seed, so that nothing else that is drawn from it goes the same way.
const STREAM: u64 = 0x5167_f11b;

/// The draws of signs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SignFlips {
    /// How many; the smallest p-value is about one of so many.
    pub draws: usize,
    /// What they are drawn from.
    pub seed: u64,
}

impl SignFlips {
    /// P(sum >= observed) when the sign of every value, one a group, is chance.
    pub fn p(self, values: &[f64]) -> f64 {
        let observed: f64 = values.iter().sum();
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed ^ STREAM);
        let mut above = 0usize;
        for _ in 0..self.draws {
            let drawn: f64 = values.iter().map(|v| if rng.random::<bool>() { *v } else { -*v }).sum();
            above += usize::from(drawn >= observed);
        }
        (1.0 + above as f64) / (self.draws as f64 + 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::SignFlips;

    #[test]
    fn of_n_equal_groups_one_flip_in_two_to_the_n_is_as_large() {
        let flips = SignFlips { draws: 99_999, seed: 3 };
        for n in 1..8 {
            let (p, expected) = (flips.p(&vec![0.4; n]), 0.5f64.powi(n as i32));
            assert!((p - expected).abs() < 5.0 * (expected / 1e5).sqrt(), "{n}: {p}");
        }
        assert_eq!(flips.p(&[]), 1.0, "no group says nothing");
        assert!(flips.p(&[-1.0; 9]) > 0.999, "it falls");
    }
}
