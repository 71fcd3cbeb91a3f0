//! What the stamps of a stream show of its rows: some are missing, or they were stamped in bursts after a stall.

use armcal_core::robust::percentile;

use crate::series::seconds_between;

/// A step this many times the period is a gap.
const GAP_PERIODS: f64 = 2.5;
/// Steps shorter than this share of the period are those of a burst.
const BURST_SHARE: f64 = 0.4;
/// A burst makes up for a gap when it holds at least this share of the rows that the gap is short of.
const MADE_UP: f64 = 0.5;
/// Stalls shorter than this are the jitter of any recorder [s].
const LEAST_STALL_S: f64 = 0.1;
/// Share of rows that must be missing to be worth a word.
const MISSING_SHARE: f64 = 0.1;

/// What the stamps of one stream show.
#[derive(Debug, Default, Clone, PartialEq)]
pub(crate) struct Stamps {
    /// Stamp of the first row after a gap that a burst of rows makes up for [ns], and the length of the gap [s].
    pub stalls: Vec<(i64, f64)>,
    /// Share of the rows that are missing; none where the steps are no multiples of one period.
    pub missing: Option<f64>,
}

impl Stamps {
    pub(crate) fn of(time_ns: &[i64]) -> Stamps {
        let steps: Vec<f64> = time_ns.windows(2).map(|w| seconds_between(w[0], w[1])).collect();
        let period_s = percentile(&steps, 0.3);
        if steps.len() < 20 || period_s.is_nan() || period_s <= 0.0 {
            return Stamps::default();
        }
        let mut stalls = Vec::new();
        for (i, &step_s) in steps.iter().enumerate() {
            if step_s < LEAST_STALL_S.max(GAP_PERIODS * period_s) {
                continue;
            }
            let burst = steps[i + 1..].iter().take_while(|s| **s < BURST_SHARE * period_s).count();
            if burst as f64 >= MADE_UP * (step_s / period_s - 1.0) {
                stalls.push((time_ns[i + 1], step_s));
            }
        }
        let on_grid =
            |s: &&f64| (*s / period_s - (*s / period_s).round()).abs() < 0.2 && **s > 0.5 * period_s;
        let regular = steps.iter().filter(on_grid).count() as f64 >= 0.95 * steps.len() as f64;
        let wanted: f64 = steps.iter().map(|s| (s / period_s).round()).sum();
        let missing = (regular && wanted > 0.0).then(|| 1.0 - steps.len() as f64 / wanted);
        Stamps { stalls, missing }
    }

    /// Longest stall of those whose burst lies between two times [s].
    pub(crate) fn longest_stall_s(&self, from_ns: i64, to_ns: i64) -> Option<f64> {
        let within = self.stalls.iter().filter(|s| (from_ns..=to_ns).contains(&s.0));
        within.map(|s| s.1).max_by(f64::total_cmp)
    }

    /// In words, for an error about the stream; empty where nothing is wrong.
    pub(crate) fn in_words(&self, stream: &str) -> String {
        let mut words = String::new();
        if let Some(missing) = self.missing.filter(|m| *m > MISSING_SHARE) {
            words += &format!("; {:.0} % of the rows of the {stream} stream are missing", missing * 100.0);
        }
        if let Some(longest_s) = self.longest_stall_s(i64::MIN, i64::MAX) {
            words += &format!(
                "; rows of the {stream} stream come in bursts after stalls of up to {longest_s:.1} s, so its stamps are \
                 those of writing"
            );
        }
        words
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testkit::{Random, ns};

    fn even(rows: usize) -> Vec<i64> {
        (0..rows).map(|i| ns(i as f64 * 0.02)).collect()
    }

    #[test]
    fn an_even_stream_has_neither_stalls_nor_missing_rows() {
        let mut r = Random::new(1);
        let mut time_ns = even(2000);
        time_ns.iter_mut().for_each(|t| *t += (1e-3 * r.uniform() * 1e9) as i64);
        let found = Stamps::of(&time_ns);
        assert!(found.stalls.is_empty() && found.missing.is_none_or(|m| m < 0.001), "{found:?}");
        assert_eq!(found.in_words("tip"), "");
    }

    #[test]
    fn lost_rows_are_counted_and_are_no_stall() {
        let mut r = Random::new(2);
        let kept: Vec<i64> = even(4000).into_iter().filter(|_| r.uniform() > 0.5).collect();
        let found = Stamps::of(&kept);
        assert!(found.stalls.is_empty(), "{found:?}");
        assert!((found.missing.expect("regular") - 0.5).abs() < 0.03, "{found:?}");
        // A gap of ten seconds is a gap: nothing makes up for it.
        let gap: Vec<i64> = even(4000)
            .into_iter()
            .enumerate()
            .filter(|(i, _)| !(500..1000).contains(i))
            .map(|p| p.1)
            .collect();
        assert!(Stamps::of(&gap).stalls.is_empty());
    }

    #[test]
    fn a_recorder_that_stalls_writes_in_bursts() {
        // Nothing is written for 3 s; then what has waited comes at once.
        let mut time_ns = even(3000);
        let (stalled, over) = (ns(20.0), ns(23.0));
        let mut waited = 0;
        for t in &mut time_ns {
            if (stalled..over).contains(t) {
                *t = over + waited * 1000;
                waited += 1;
            }
        }
        let found = Stamps::of(&time_ns);
        assert_eq!(found.stalls.len(), 1, "{found:?}");
        assert!((found.stalls[0].1 - 3.0).abs() < 0.05, "{found:?}");
        assert!(found.longest_stall_s(ns(0.0), ns(19.0)).is_none());
    }
}
