//! What repeats in a joint's error curve: the teeth, lines and pole pairs of what turns with it.

use nalgebra::{DMatrix, DVector};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Fewest periods that a joint must have gone through, and fewest in a turn: the first two harmonics are called by other
/// names.
const FEWEST_PERIODS: f64 = 4.0;
const FEWEST_A_TURN: f64 = 3.0;
/// A period needs so many angles.
const A_PERIOD: f64 = 4.0;
/// Least share of a curve, beside its slow part, that is called a ripple.
const LEAST_SHARE: f64 = 0.55;
/// Once it is taken out, no other period is more than this share of the ripple. Of curves that only vary, 1 in 100 has a
/// period that stands alone like that.
const NEXT_AT_MOST: f64 = 0.2;
/// Share at which the strongest period of a curve is a ripple because another joint has one of the same frequency, and how
/// near the two must be, in periods over the whole range.
const SHARED_SHARE: f64 = 0.35;
const SHARED_WITHIN: f64 = 0.5;
/// Steps of the search, in periods over the whole range: a fraction of what the range resolves.
const STEP: f64 = 0.05;
/// Multiples of the ripple that give it a shape.
const MULTIPLES: usize = 3;

/// A periodic part of an error curve over a joint's own angle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Ripple {
    /// Periods in one turn of the joint.
    pub periods_per_turn: f64,
    /// Amplitude of its sine, in the unit of the curve.
    pub amplitude: f64,
    /// Share of the curve's squares, beside the slow part, that the sine is.
    pub share: f64,
    /// Share with twice and three times its frequency.
    pub share_with_multiples: f64,
}

/// The period of a curve that stands out most.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Peak {
    /// What it would be as a ripple.
    pub ripple: Ripple,
    /// Share of the strongest other period once this one is taken out.
    next: f64,
    /// Periods a turn that go once through the range: frequencies nearer than that are not told apart.
    once: f64,
}

impl Peak {
    /// Whether it stands alone and is most of what the curve is beside its slow part.
    pub fn is_alone(&self) -> bool {
        self.ripple.share >= LEAST_SHARE && self.next <= NEXT_AT_MOST * self.ripple.share
    }

    /// Whether it is what another joint of the same make does too.
    pub fn is_of_a_make_with(&self, other: &Peak) -> bool {
        let apart = (self.ripple.periods_per_turn - other.ripple.periods_per_turn).abs();
        self.ripple.share >= SHARED_SHARE && apart <= SHARED_WITHIN * self.once.max(other.once)
    }
}

/// Standard deviation of a curve, given at the angles [rad] where the joint was, beside its slow part: that has names of its
/// own (`gear_ratio`, `eccentricity`, `second_harmonic`), and the geometry has a share in it.
pub(crate) fn beside_slow(angles_rad: &[f64], curve: &[f64]) -> f64 {
    Waves::slow(angles_rad).without(&DVector::from_column_slice(curve)).norm() / (curve.len() as f64).sqrt()
}

/// The strongest period of a curve, given at the angles [rad] where the joint was, beside its slow part: a straight line and
/// the first two harmonics of the turn.
///
/// `functions` is how many the curve was put together from: it shows half as many periods at most.
pub(crate) fn peak(angles_rad: &[f64], curve: &[f64], functions: usize) -> Option<Peak> {
    let mut sorted = angles_rad.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.dedup();
    let range_rad = sorted.last()? - sorted.first()?;
    let mut gaps: Vec<f64> = sorted.windows(2).map(|w| w[1] - w[0]).collect();
    gaps.sort_by(f64::total_cmp);
    let usual_rad = *gaps.get(gaps.len() / 2)?;
    let slow = Waves::slow(angles_rad);
    let rest = slow.without(&DVector::from_column_slice(curve));
    let all = rest.norm_squared();
    let share_of = |waves: &Waves| 1.0 - waves.without(&rest).norm_squared() / all;
    let at = |n: f64, multiples: usize| share_of(&slow.joined(angles_rad, n, multiples));
    // Periods a turn that go once through the range.
    let once = TAU / range_rad;
    let least = FEWEST_A_TURN.max(FEWEST_PERIODS * once);
    let most = (TAU / (A_PERIOD * usual_rad)).min(0.5 * functions as f64 * once);
    let step = STEP * once;
    let steps = ((most - least) / step).floor();
    if !(steps >= 0.0 && all > 0.0) {
        return None;
    }
    let tried = || (0..=steps as usize).map(|k| least + step * k as f64);
    let (n, share) = tried().map(|n| (n, at(n, 1))).max_by(|a, b| a.1.total_cmp(&b.1))?;
    let with = slow.joined(angles_rad, n, 1);
    // A multiple is the shape of the ripple; nearer than what the range resolves it is the ripple itself.
    let another = |other: &f64| (1..=MULTIPLES).all(|m| (other - m as f64 * n).abs() > once);
    let next = tried().filter(another).map(|other| share_of(&with.joined(angles_rad, other, 1)) - share);
    let next = next.fold(0.0, f64::max);
    let multiples = MULTIPLES.min((most / n) as usize).max(1);
    let share_with_multiples = at(n, multiples).max(share);
    let amplitude = with.last_amplitude(&rest);
    let ripple = Ripple { periods_per_turn: n, amplitude, share, share_with_multiples };
    Some(Peak { ripple, next, once })
}

/// Columns that are fitted together.
struct Waves(DMatrix<f64>);

impl Waves {
    /// A straight line and the first two harmonics.
    fn slow(angles_rad: &[f64]) -> Waves {
        let column = |q: f64| [1.0, q, q.sin(), q.cos(), (2.0 * q).sin(), (2.0 * q).cos()];
        Waves(DMatrix::from_fn(angles_rad.len(), 6, |i, k| column(angles_rad[i])[k]))
    }

    /// The same with the sines and cosines of `n` a turn and its multiples.
    fn joined(&self, angles_rad: &[f64], n: f64, multiples: usize) -> Waves {
        let slow = self.0.ncols();
        Waves(DMatrix::from_fn(angles_rad.len(), slow + 2 * multiples, |i, k| match k.checked_sub(slow) {
            None => self.0[(i, k)],
            Some(k) => {
                let (sine, cosine) = (n * (k / 2 + 1) as f64 * angles_rad[i]).sin_cos();
                if k % 2 == 0 { sine } else { cosine }
            }
        }))
    }

    fn fitted(&self, curve: &DVector<f64>) -> DVector<f64> {
        let svd = self.0.clone().svd(true, true);
        let floor = 1e-9 * svd.singular_values.max();
        svd.solve(curve, floor).unwrap_or_else(|_| DVector::zeros(self.0.ncols()))
    }

    fn without(&self, curve: &DVector<f64>) -> DVector<f64> {
        curve - &self.0 * self.fitted(curve)
    }

    /// Length of the last two coefficients.
    fn last_amplitude(&self, curve: &DVector<f64>) -> f64 {
        let fitted = self.fitted(curve);
        let last = fitted.len();
        fitted[last - 1].hypot(fitted[last - 2])
    }
}

#[cfg(test)]
mod tests {
    use super::{Peak, Ripple, peak};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use std::f64::consts::TAU;

    fn ripple(angles_rad: &[f64], curve: &[f64], functions: usize) -> Option<Ripple> {
        peak(angles_rad, curve, functions).filter(Peak::is_alone).map(|p| p.ripple)
    }

    /// Angles as a session has them: uneven, over 130 deg.
    fn angles(seed: u64, count: usize) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        (0..count).map(|_| rng.random_range(-2.3..0.0)).collect()
    }

    #[test]
    fn a_planted_ripple_is_found_with_its_order_and_size() {
        let q = angles(1, 300);
        let slow = |q: f64| 0.3 * q + 2.0 * (q + 0.4).cos();
        let sine: Vec<f64> = q.iter().map(|q| slow(*q) + 1.5 * (17.0 * q + 0.2).sin()).collect();
        let found = ripple(&q, &sine, 60).expect("a ripple");
        assert!((found.periods_per_turn - 17.0).abs() < 0.1, "{found:?}");
        assert!((found.amplitude - 1.5).abs() < 0.03 && found.share > 0.98, "{found:?}");
        // A sawtooth: its sine is 6/pi^2 of its squares, three harmonics 6/pi^2 (1 + 1/4 + 1/9).
        let saw: Vec<f64> = q.iter().map(|q| slow(*q) + (17.0 * q / TAU).fract()).collect();
        let found = ripple(&q, &saw, 60).expect("a ripple");
        let of_sine = 6.0 / std::f64::consts::PI.powi(2);
        assert!((found.periods_per_turn - 17.0).abs() < 0.1, "{found:?}");
        assert!((found.share - of_sine).abs() < 0.06, "{found:?}");
        assert!((found.share_with_multiples - of_sine * (1.0 + 0.25 + 1.0 / 9.0)).abs() < 0.06, "{found:?}");
    }

    #[test]
    fn a_ripple_is_found_through_a_hole_in_the_angles() {
        // What a hole makes of one sine looks like other sines beside it.
        let q: Vec<f64> = angles(5, 400).into_iter().filter(|q| !(-1.5..-0.9).contains(q)).collect();
        let sine: Vec<f64> = q.iter().map(|q| (17.0 * q + 0.2).sin()).collect();
        let found = ripple(&q, &sine, 60).expect("a ripple");
        assert!((found.periods_per_turn - 17.0).abs() < 0.1, "{found:?}");
    }

    #[test]
    fn gears_of_one_make_lend_each_other_their_frequency() {
        let q = angles(6, 300);
        let of = |n: f64, other: f64| -> Peak {
            let curve: Vec<f64> = q.iter().map(|q| (n * q).sin() + other * (29.5 * q).sin()).collect();
            peak(&q, &curve, 60).expect("a peak")
        };
        let (clear, blurred, elsewhere) = (of(17.0, 0.0), of(17.4, 0.95), of(12.0, 0.95));
        assert!(clear.is_alone() && !blurred.is_alone() && !elsewhere.is_alone());
        assert!(blurred.is_of_a_make_with(&clear), "{blurred:?}");
        assert!(!elsewhere.is_of_a_make_with(&clear), "{elsewhere:?}");
    }

    /// Random smooth curves, sums of waves of every length from a tenth of the range: a ripple is seldom claimed.
    #[test]
    fn what_only_varies_is_seldom_a_ripple() {
        let mut claimed = 0;
        for seed in 0..40 {
            let q = angles(seed, 200);
            let mut rng = ChaCha8Rng::seed_from_u64(100 + seed);
            let waves: Vec<[f64; 3]> = (0..60)
                .map(|_| {
                    [rng.random_range(-1.0..1.0), rng.random_range(0.0..27.0), rng.random_range(0.0..TAU)]
                })
                .collect();
            let curve: Vec<f64> =
                q.iter().map(|q| waves.iter().map(|[a, n, phase]| a * (n * q + phase).sin()).sum()).collect();
            claimed += usize::from(ripple(&q, &curve, 60).is_some());
        }
        assert!(claimed <= 2, "{claimed} of 40");
        assert_eq!(ripple(&angles(3, 60), &[0.0; 60], 60), None, "a curve of nothing");
        assert_eq!(ripple(&[0.3; 9], &[1.0; 9], 60), None, "it never turned");
    }
}
