//! Two results on the same dwells: by how much the error differs, and whether that is more than chance.

use crate::outcome::Calibration;
use crate::precision::statistics::t95;
use armcal_core::Observation;
use std::collections::{BTreeMap, BTreeSet};

/// Fewer cavities than this are no sample of cavities: dwells then stand for themselves.
pub const MIN_CAVITIES: usize = 12;

/// What each dwell shares its luck with: its cavity, whose machining error it shares, where there are enough of them;
/// itself otherwise. `dwells` are (name of the dwell, cavity; empty or absent when tracked).
pub fn independent_groups(dwells: &[(String, Option<&str>)]) -> Vec<String> {
    let cavity = |c: &Option<&str>| c.filter(|name| !name.is_empty()).map(str::to_owned);
    let distinct: BTreeSet<String> = dwells.iter().filter_map(|(_, c)| cavity(c)).collect();
    let by_cavity = distinct.len() >= MIN_CAVITIES;
    dwells.iter().map(|(dwell, c)| cavity(c).filter(|_| by_cavity).unwrap_or_else(|| dwell.clone())).collect()
}

/// 95 % interval of `sum of changes / sum of sizes` over independent groups, each (change summed over it, its size);
/// infinite with fewer than two.
///
/// The variance is that of the group sums (cluster-robust, CR1 with Student's t on G - 1 degrees of freedom: Cameron and
/// Miller, J. Human Resources 50, 2015, eq. 11-12).
pub fn grouped_ci95(changes: &[(f64, f64)]) -> [f64; 2] {
    let groups = changes.len() as f64;
    if groups < 2.0 {
        return [f64::NEG_INFINITY, f64::INFINITY];
    }
    let size: f64 = changes.iter().map(|(_, size)| size).sum();
    let mean = changes.iter().map(|(change, _)| change).sum::<f64>() / size;
    let square: f64 = changes.iter().map(|(change, size)| (change - mean * size).powi(2)).sum();
    let half = t95(groups - 1.0) * (groups / (groups - 1.0) * square).sqrt() / size;
    [mean - half, mean + half]
}

/// The error of one dwell under two models.
#[derive(Debug, Clone, PartialEq)]
pub struct Pair {
    /// What the dwell shares its luck with ([`independent_groups`]).
    pub group: String,
    /// Norm of the error before [m].
    pub before_m: f64,
    /// Norm of the error after [m].
    pub after_m: f64,
}

/// Mean errors before and after, and the interval on their difference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairedDifference {
    /// Dwells compared.
    pub n: usize,
    /// Groups they fall into; the interval treats groups, not dwells, as independent.
    pub groups: usize,
    /// Mean error before [m].
    pub before_m: f64,
    /// Mean error after [m].
    pub after_m: f64,
    /// Mean of after minus before [m]: negative when the error fell.
    pub difference_m: f64,
    /// 95 % interval of that mean [m]; infinite with fewer than two groups.
    pub ci95_m: [f64; 2],
    /// Dwells whose error fell.
    pub better: usize,
    /// Dwells whose error rose.
    pub worse: usize,
}

impl PairedDifference {
    /// Compares pair by pair; `None` without a pair.
    ///
    /// The interval is [`grouped_ci95`], because dwells in one cavity share its machining error.
    pub fn of(pairs: &[Pair]) -> Option<PairedDifference> {
        if pairs.is_empty() {
            return None;
        }
        let n = pairs.len() as f64;
        let mean = |value: fn(&Pair) -> f64| pairs.iter().map(value).sum::<f64>() / n;
        let difference_m = mean(|p| p.after_m - p.before_m);
        let mut groups: BTreeMap<&str, (f64, f64)> = BTreeMap::new();
        for pair in pairs {
            let (sum, size) = groups.entry(&pair.group).or_default();
            *sum += pair.after_m - pair.before_m;
            *size += 1.0;
        }
        let changes: Vec<(f64, f64)> = groups.into_values().collect();
        Some(PairedDifference {
            n: pairs.len(),
            groups: changes.len(),
            before_m: mean(|p| p.before_m),
            after_m: mean(|p| p.after_m),
            difference_m,
            ci95_m: grouped_ci95(&changes),
            better: pairs.iter().filter(|p| p.after_m < p.before_m).count(),
            worse: pairs.iter().filter(|p| p.after_m > p.before_m).count(),
        })
    }

    /// Compares two calibrations of the same observations on the points that neither fit saw; on all points when
    /// nothing was held out.
    pub fn between(
        observations: &[Observation],
        before: &Calibration,
        after: &Calibration,
    ) -> Option<PairedDifference> {
        let rows = || observations.iter().zip(before.residuals.iter().zip(&after.residuals));
        let any_held_out = rows().any(|(_, (b, a))| b.held_out && a.held_out);
        let judged: Vec<_> =
            rows().filter(|(_, (b, a))| !any_held_out || (b.held_out && a.held_out)).collect();
        let dwells: Vec<_> = judged.iter().map(|(o, _)| (o.dwell.to_string(), o.cavity())).collect();
        let pairs: Vec<Pair> = judged
            .iter()
            .zip(independent_groups(&dwells))
            .map(|((_, (b, a)), group)| Pair {
                group,
                before_m: b.fitted_m.norm(),
                after_m: a.fitted_m.norm(),
            })
            .collect();
        PairedDifference::of(&pairs)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pair(group: &str, before_m: f64, after_m: f64) -> Pair {
        Pair { group: group.into(), before_m, after_m }
    }

    #[test]
    fn independent_pairs_give_the_paired_t_interval() {
        // scipy.stats.ttest_rel([1, 1.2, .7, .9, 1.1], [2, 2.5, 1.5, 2.2, 1.9]).confidence_interval()
        let before = [2.0, 2.5, 1.5, 2.2, 1.9];
        let after = [1.0, 1.2, 0.7, 0.9, 1.1];
        let pairs: Vec<Pair> =
            before.iter().zip(after).enumerate().map(|(i, (b, a))| pair(&i.to_string(), *b, a)).collect();
        let d = PairedDifference::of(&pairs).expect("pairs");
        assert!((d.difference_m + 1.04).abs() < 1e-12);
        assert!((d.ci95_m[0] + 1.351_655_190).abs() < 1e-6, "{:?}", d.ci95_m);
        assert!((d.ci95_m[1] + 0.728_344_810).abs() < 1e-6, "{:?}", d.ci95_m);
        assert!(d.better == 5 && d.worse == 0);
    }

    #[test]
    fn repeating_every_dwell_of_a_group_does_not_narrow_the_interval() {
        let once: Vec<Pair> = (0..6).map(|i| pair(&i.to_string(), 1.0, 0.5 + 0.1 * f64::from(i))).collect();
        let thrice: Vec<Pair> = once.iter().flat_map(|p| vec![p.clone(); 3]).collect();
        let (one, three) =
            (PairedDifference::of(&once).expect("pairs"), PairedDifference::of(&thrice).expect("pairs"));
        assert!((one.ci95_m[0] - three.ci95_m[0]).abs() < 1e-12, "{one:?} {three:?}");
    }

    #[test]
    fn two_sockets_are_no_sample_of_sockets() {
        let dwell = |i: usize| format!("dwell {i}");
        let few: Vec<_> = (0..40).map(|i| (dwell(i), Some(["a", "b"][i % 2]))).collect();
        assert_eq!(independent_groups(&few), (0..40).map(dwell).collect::<Vec<_>>());
        let names: Vec<String> = (0..20).map(|i| format!("circle{i}")).collect();
        let many: Vec<_> = (0..40).map(|i| (dwell(i), Some(names[i % 20].as_str()))).collect();
        assert_eq!(independent_groups(&many)[21], "circle1");
    }

    #[test]
    fn one_group_says_nothing_about_chance() {
        let d = PairedDifference::of(&[pair("a", 1.0, 0.1), pair("a", 1.0, 0.2)]).expect("pairs");
        assert!(d.ci95_m[1] == f64::INFINITY);
        assert!(PairedDifference::of(&[]).is_none());
    }
}
