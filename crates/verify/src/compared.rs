//! Mean errors of two models on the same measurements.

use armcal_calibrate::grouped_ci95;
use armcal_core::robust::percentile;
use serde::Serialize;
use std::collections::BTreeMap;

/// Size of one error under two models.
#[derive(Debug, Clone, PartialEq)]
pub struct Error<'a> {
    /// What it shares its luck with: a cavity, a stretch of a path. Groups are taken to be independent.
    pub group: &'a str,
    /// Under the nominal model [m]; a signed component where that is asked for.
    pub before_m: f64,
    /// Under the calibrated one [m].
    pub after_m: f64,
}

/// A mean with its interval, and the tail behind it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Estimate {
    /// Mean [m].
    pub mean_m: f64,
    /// 95 % interval of the mean [m], groups taken as independent; absent with fewer than two groups.
    pub ci95_m: Option<[f64; 2]>,
    /// 95 % of the errors are smaller in size [m].
    pub p95_m: f64,
    /// Largest size [m].
    pub max_m: f64,
}

/// Errors before and after calibration.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Compared {
    /// Measurements.
    pub n: usize,
    /// Independent groups of them.
    pub groups: usize,
    /// Nominal model.
    pub before: Estimate,
    /// Calibrated model.
    pub after: Estimate,
    /// Mean of after minus before [m].
    pub difference_m: f64,
    /// 95 % interval of it [m].
    pub difference_ci95_m: Option<[f64; 2]>,
    /// Share by which the mean error fell: 1 - after / before.
    pub improvement: f64,
}

impl Compared {
    /// Compares pair by pair; `None` without a pair.
    ///
    /// Intervals are cluster-robust ([`grouped_ci95`]): dwells in one cavity share its machining error, neighbouring
    /// samples of a path share everything.
    pub fn of(errors: &[Error<'_>]) -> Option<Compared> {
        if errors.is_empty() {
            return None;
        }
        let before = estimate_mean(errors, |e| e.before_m);
        let after = estimate_mean(errors, |e| e.after_m);
        let change = group_sums(errors, &|e| e.after_m - e.before_m);
        Some(Compared {
            n: errors.len(),
            groups: change.len(),
            before,
            after,
            difference_m: after.mean_m - before.mean_m,
            difference_ci95_m: mean_ci95_m(&change),
            improvement: 1.0 - after.mean_m / before.mean_m,
        })
    }
}

fn estimate_mean(errors: &[Error<'_>], value: fn(&Error<'_>) -> f64) -> Estimate {
    let sizes: Vec<f64> = errors.iter().map(|e| value(e).abs()).collect();
    Estimate {
        mean_m: errors.iter().map(value).sum::<f64>() / errors.len() as f64,
        ci95_m: mean_ci95_m(&group_sums(errors, &value)),
        p95_m: percentile(&sizes, 0.95),
        max_m: sizes.iter().copied().fold(0.0, f64::max),
    }
}

/// Sum and size of each group.
fn group_sums(errors: &[Error<'_>], value: &dyn Fn(&Error<'_>) -> f64) -> Vec<(f64, f64)> {
    let mut groups: BTreeMap<&str, (f64, f64)> = BTreeMap::new();
    for e in errors {
        let (sum, size) = groups.entry(e.group).or_default();
        *sum += value(e);
        *size += 1.0;
    }
    groups.into_values().collect()
}

fn mean_ci95_m(groups: &[(f64, f64)]) -> Option<[f64; 2]> {
    (groups.len() > 1).then(|| grouped_ci95(groups))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn singles_give_the_t_interval_of_a_mean() {
        // scipy.stats.ttest_1samp([2, 2.5, 1.5, 2.2, 1.9], 0).confidence_interval(): 1.561..2.479
        let before = [2.0, 2.5, 1.5, 2.2, 1.9];
        let names: Vec<String> = (0..5).map(|i| i.to_string()).collect();
        let errors: Vec<Error> = before
            .iter()
            .zip(&names)
            .map(|(b, g)| Error { group: g, before_m: *b, after_m: 0.5 * b })
            .collect();
        let c = Compared::of(&errors).expect("errors");
        let [low, high] = c.before.ci95_m.expect("five groups");
        assert!((low - 1.5612).abs() < 1e-3 && (high - 2.4788).abs() < 1e-3, "{low} {high}");
        assert!((c.improvement - 0.5).abs() < 1e-12);
        assert!(c.difference_ci95_m.is_some_and(|[_, high]| high < 0.0));
    }

    #[test]
    fn one_group_has_no_interval() {
        let errors = [1.0, 2.0].map(|m| Error { group: "a", before_m: m, after_m: m });
        let c = Compared::of(&errors).expect("errors");
        assert_eq!((c.groups, c.before.ci95_m, c.difference_ci95_m), (1, None, None));
        assert!(Compared::of(&[]).is_none());
    }
}
