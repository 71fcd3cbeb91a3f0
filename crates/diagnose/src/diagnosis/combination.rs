//! What data determine of several amplitudes that they cannot tell apart: the combination with the clearest value.

use crate::problem::Amplitude;
use crate::weigh::confusion::half_width;
use armcal_calibrate::tails::Z_975;
use armcal_core::Unit;
use nalgebra::{DMatrix, DVector};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Terms below this share of the largest one are left out, where the rest is as clear.
const SMALL_TERM: f64 = 0.1;

/// A weighted sum of amplitudes, determined where the amplitudes by themselves are not.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Combination {
    /// Its terms; the largest, at typical sizes, has the weight 1.
    pub terms: Vec<Term>,
    /// Unit of the sum: that of the term of weight 1.
    pub unit: Unit,
    /// The sum, SI.
    pub value: f64,
    /// Its 95 % interval, SI.
    pub ci95: [f64; 2],
}

/// One term of a combination.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Term {
    /// The amplitude.
    pub name: String,
    /// Its unit.
    pub unit: Unit,
    /// Its weight, SI: unit of the sum over its own.
    pub weight: f64,
}

/// The clearest combination of amplitudes of which at least one has an interval wider than its value; none where each is
/// determined, or nothing is. Estimate and covariance are in typical sizes.
pub(crate) fn combination(
    amplitudes: &[Amplitude],
    estimate: &DVector<f64>,
    covariance: &DMatrix<f64>,
) -> Option<Combination> {
    let wide = |k: usize| half_width(covariance[(k, k)].max(0.0).sqrt()) > estimate[k].abs();
    if amplitudes.len() < 2 || !(0..amplitudes.len()).any(wide) {
        return None;
    }
    let axes = covariance.clone().symmetric_eigen().eigenvectors;
    let clear =
        |v: &DVector<f64>| v.dot(estimate).abs() / v.dot(&(covariance * v)).max(f64::MIN_POSITIVE).sqrt();
    let best = axes.column_iter().map(|v| v.into_owned()).max_by(|a, b| clear(a).total_cmp(&clear(b)))?;
    let least = SMALL_TERM * best.amax();
    let short = best.map(|w| if w.abs() < least { 0.0 } else { w });
    let weights = if clear(&short) >= clear(&best).min(2.0 * Z_975) { short } else { best };
    let of_several = weights.iter().filter(|w| **w != 0.0).count() > 1;
    if clear(&weights) <= Z_975 || !of_several {
        return None;
    }
    let first = weights.iamax();
    let unit_size = amplitudes[first].typical / weights[first];
    let value = weights.dot(estimate) * unit_size;
    let half = half_width(weights.dot(&(covariance * &weights)).max(0.0).sqrt()) * unit_size.abs();
    let terms = amplitudes.iter().zip(weights.iter()).filter(|(_, w)| **w != 0.0);
    Some(Combination {
        terms: terms
            .map(|(a, w)| Term { name: a.name.clone(), unit: a.unit, weight: w / a.typical * unit_size })
            .collect(),
        unit: amplitudes[first].unit,
        value,
        ci95: [value - half, value + half],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{dmatrix, dvector};

    fn amplitude(name: &str, unit: Unit, typical: f64) -> Amplitude {
        Amplitude { name: name.to_owned(), unit, typical, never_negative: false }
    }

    #[test]
    fn the_sum_of_two_that_trade_against_each_other_is_determined() {
        // a + b = 2 within 0.1, a - b = 0 within 100: in typical sizes of 1 mm and 2 mm.
        let amplitudes = [amplitude("a", Unit::Metre, 1e-3), amplitude("b", Unit::Metre, 2e-3)];
        let (sum, difference) = (0.005, 5000.0);
        let covariance =
            dmatrix![sum + difference, sum - difference; sum - difference, sum + difference] / 2.0;
        let found = combination(&amplitudes, &dvector![1.0, 1.0], &covariance).expect("one is determined");
        // By typical sizes the weights are equal: a / 1 mm + b / 2 mm.
        let weight = |name: &str| found.terms.iter().find(|t| t.name == name).map(|t| t.weight);
        let (a, b) = (weight("a").expect("a term"), weight("b").expect("a term"));
        assert!((a / b - 2.0).abs() < 1e-9, "{found:?}");
        let is = a * 1e-3 + b * 2e-3;
        assert!((found.value - is).abs() < 1e-12, "{found:?}");
        // Standard error of (a + b) in typical sizes: sqrt(2 * 0.005) = 0.1, so 1.96 * 0.1 of 2.
        let relative = (found.ci95[1] - found.ci95[0]) / 2.0 / found.value.abs();
        assert!((relative - 1.959_964 * 0.1 / 2.0).abs() < 1e-6, "{relative}");
    }

    #[test]
    fn amplitudes_that_are_determined_or_not_at_all_have_none() {
        let amplitudes = [amplitude("a", Unit::Metre, 1e-3), amplitude("b", Unit::Radian, 1e-2)];
        let of = |estimate: DVector<f64>, variance: [f64; 2]| {
            combination(&amplitudes, &estimate, &DMatrix::from_diagonal(&DVector::from_row_slice(&variance)))
        };
        assert_eq!(of(dvector![1.0, 1.0], [1e-4, 1e-4]), None, "each is determined");
        assert_eq!(of(dvector![0.1, 0.1], [1.0, 1.0]), None, "nothing is");
        assert_eq!(of(dvector![1.0, 0.1], [1e-4, 1.0]), None, "one of them, by itself");
        assert_eq!(combination(&amplitudes[..1], &dvector![0.1], &dmatrix![1.0]), None);
    }
}
