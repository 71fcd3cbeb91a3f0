//! What stamps say of the clock that made them: that it was set while it ran, or that rows were stamped when they arrived.

use armcal_core::robust::percentile;

/// A clock was set by at least this [s], and by this many times what its delay scatters by.
const LEAST_STEP_S: f64 = 0.03;
const BEYOND_SCATTER: f64 = 8.0;
/// Rows before and after a step whose delay is compared, and the fewest of them.
const BESIDE: usize = 50;
const FEWEST: usize = 10;
/// Steps that are looked at, the largest first: a recorder's jitter is many small ones.
const LOOKED_AT: usize = 8;

/// Rows that follow each other faster than any sensor sends [s], and than this share of the mean period, came together ..
const TOGETHER_S: f64 = 6e-4;
const TOGETHER_SHARE: f64 = 0.1;
/// .. if so large a share of all did, in at least so many bursts of so many rows whose number matches the time before them to
/// such a share.
const SHARE: f64 = 0.4;
const BURSTS: usize = 20;
const MANY: usize = 5;
const MATCHES: f64 = 0.5;
/// What took so many times as long as its rows has lost some.
const LOST: f64 = 3.0;

/// A clock that was set while it ran.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ClockStep {
    /// By how much it was put forward [s].
    pub by_s: f64,
    /// When, after the first row, by log time [s].
    pub after_s: f64,
    /// Log time of the first row after it [ns].
    pub from_log_ns: i64,
}

impl ClockStep {
    /// For people.
    pub fn told(&self) -> String {
        format!(
            "header stamps step by {:+.3} s against log time, {:.1} s after the first row",
            self.by_s, self.after_s
        )
    }
}

/// The largest step of the header's clock against log time, from rows in log order; none where it is log time that steps.
pub(crate) fn find_clock_step(rows: &[(i64, i64)]) -> Option<ClockStep> {
    let ahead_s: Vec<f64> =
        rows.iter().map(|(header, log)| header.saturating_sub(*log) as f64 * 1e-9).collect();
    let mut steps: Vec<(usize, f64)> = ahead_s
        .windows(2)
        .map(|w| w[1] - w[0])
        .enumerate()
        .filter(|(_, by)| by.abs() > LEAST_STEP_S)
        .collect();
    steps.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
    let after =
        |i: usize, of: fn(&(i64, i64)) -> i64| of(&rows[i + 1]).saturating_sub(of(&rows[i])) as f64 * 1e-9;
    let lasting = |&(i, jump_s): &(usize, f64)| {
        let (before, behind) =
            (&ahead_s[(i + 1).saturating_sub(BESIDE)..=i], &ahead_s[i + 1..(i + 1 + BESIDE).min(rows.len())]);
        if before.len().min(behind.len()) < FEWEST {
            return None;
        }
        let by_s = percentile(behind, 0.5) - percentile(before, 0.5);
        let scatter_s = [before, behind]
            .map(|side| percentile(side, 0.9) - percentile(side, 0.1))
            .into_iter()
            .fold(0.0, f64::max);
        let lasts = by_s.abs() > LEAST_STEP_S
            && by_s.abs() > BEYOND_SCATTER * scatter_s
            && (by_s - jump_s).abs() < 0.2 * by_s.abs();
        let of_header =
            (after(i, |r| r.0) - by_s).abs() < 0.5 * by_s.abs() && after(i, |r| r.1).abs() < 0.5 * by_s.abs();
        (lasts && of_header).then(|| ClockStep {
            by_s,
            after_s: rows[i + 1].1.saturating_sub(rows[0].1) as f64 * 1e-9,
            from_log_ns: rows[i + 1].1,
        })
    };
    steps.iter().take(LOOKED_AT).find_map(lasting)
}

/// Rows that were stamped when they arrived, many at once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bursts {
    /// How many bursts.
    pub count: usize,
    /// Typical rows in one.
    pub rows: usize,
    /// Typical time between them [s].
    pub apart_s: f64,
}

impl Bursts {
    /// For people.
    pub fn told(&self) -> String {
        let Bursts { rows, apart_s, .. } = self;
        format!(
            "rows were stamped when they arrived, about {rows} at once every {apart_s:.2} s: they are spread evenly over the time \
             between; have the sensor stamp them, or set `clock` to keep the stamps"
        )
    }
}

/// Spreads rows that came in bursts evenly over the time in which they were measured. `time_ns` is sorted.
pub(crate) fn spread_bursts(time_ns: &mut [i64]) -> Option<Bursts> {
    let since_s = |from: usize, to: usize| time_ns[to].saturating_sub(time_ns[from]) as f64 * 1e-9;
    let last = time_ns.len().checked_sub(1)?;
    let mean_s = since_s(0, last) / last.max(1) as f64;
    let together_s = TOGETHER_S.min(TOGETHER_SHARE * mean_s);
    // The last row of every burst.
    let ends: Vec<usize> = (0..last).filter(|i| since_s(*i, i + 1) > together_s).chain([last]).collect();
    if ends.len() as f64 > (1.0 - SHARE) * time_ns.len() as f64 {
        return None;
    }
    // From the end of a burst to that of the next, the rows of the next were measured.
    let bursts = ends.windows(2).map(|w| (w[1] - w[0], since_s(w[0], w[1])));
    let large: Vec<(usize, f64)> = bursts.filter(|(rows, _)| *rows >= MANY).collect();
    let periods: Vec<f64> = large.iter().map(|(rows, s)| s / *rows as f64).collect();
    let (period_s, apart_s) =
        (percentile(&periods, 0.5), percentile(&large.iter().map(|b| b.1).collect::<Vec<_>>(), 0.5));
    let even = percentile(&periods, 0.9) - percentile(&periods, 0.1) < MATCHES * period_s;
    if large.len() < BURSTS || !even {
        return None;
    }
    let rows = percentile(&large.iter().map(|b| b.0 as f64).collect::<Vec<_>>(), 0.5) as usize;
    let arrived: Vec<i64> = ends.iter().map(|end| time_ns[*end]).collect();
    for (k, end) in ends.iter().enumerate() {
        let first = k.checked_sub(1).map_or(0, |before| ends[before] + 1);
        let count = (end + 1 - first) as f64;
        let since_ns = k.checked_sub(1).map(|before| (arrived[k] - arrived[before]) as f64);
        let usual_ns = period_s * 1e9;
        let step_ns = since_ns.filter(|ns| *ns < LOST * count * usual_ns).map_or(usual_ns, |ns| ns / count);
        for (row, time) in time_ns[first..=*end].iter_mut().enumerate() {
            *time = arrived[k] - ((count - 1.0 - row as f64) * step_ns) as i64;
        }
    }
    Some(Bursts { count: ends.len(), rows, apart_s })
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: i64 = 1_000_000_000;

    /// Rows at 100 Hz: header and log time.
    fn rows(header: impl Fn(i64) -> i64, log: impl Fn(i64) -> i64) -> Vec<(i64, i64)> {
        (0..6000).map(|i| 1_700_000_000 * SECOND + i * SECOND / 100).map(|t| (header(t), log(t))).collect()
    }

    #[test]
    fn a_clock_that_was_set_is_found_with_its_size_and_moment() {
        let at = 1_700_000_020 * SECOND;
        for by_s in [-1.432, 0.8, 0.05, 3600.0] {
            let set = |t: i64| if t < at { t - 7 * SECOND } else { t - 7 * SECOND + (by_s * 1e9) as i64 };
            let found = find_clock_step(&rows(set, |t| t)).expect("it was set");
            assert!(
                (found.by_s - by_s).abs() < 1e-3 && (found.after_s - 20.0).abs() < 0.02,
                "{by_s}: {found:?}"
            );
        }
    }

    #[test]
    fn a_recorder_that_stalls_steps_or_jitters_is_no_clock_that_was_set() {
        let at = 1_700_000_020 * SECOND;
        // For half a second nothing is written, then all at once.
        let stalls = |t: i64| if (at..at + SECOND / 2).contains(&t) { at + SECOND / 2 } else { t };
        assert_eq!(find_clock_step(&rows(|t| t, stalls)), None);
        // The recorder's own clock is set.
        assert_eq!(find_clock_step(&rows(|t| t, |t| if t < at { t } else { t + SECOND })), None);
        // Log times that are late by up to 0.2 s, each otherwise.
        let late = |t: i64| t + (t / 10_000_000).wrapping_mul(2_654_435_761).rem_euclid(200) * 1_000_000;
        assert_eq!(find_clock_step(&rows(|t| t, late)), None);
        assert_eq!(find_clock_step(&rows(|t| t, |t| t)), None);
    }

    #[test]
    fn rows_that_came_in_bursts_go_back_to_when_they_were_measured() {
        let measured: Vec<i64> = (0..6000).map(|i| i * SECOND / 100).collect();
        // Handed over about three times a second, each time a little earlier or later.
        let mut arrived = Vec::new();
        let mut next = SECOND / 3;
        for t in &measured {
            if *t > next {
                next += SECOND / 3 + (t / 7) % 60_000_000 - 30_000_000;
            }
            arrived.push(next.max(*t));
        }
        let mut rank = 0;
        for i in 1..arrived.len() {
            rank = if arrived[i] / 1000 == (arrived[i - 1] - rank) / 1000 { rank + 20_000 } else { 0 };
            arrived[i] += rank;
        }
        let found = spread_bursts(&mut arrived).expect("bursts");
        assert!(found.count > 150 && (20..45).contains(&found.rows), "{found:?}");
        let off: Vec<f64> = measured.iter().zip(&arrived).map(|(m, a)| (a - m) as f64 * 1e-9).collect();
        let spread = percentile(&off, 0.95) - percentile(&off, 0.05);
        assert!(spread < 0.06 && arrived.is_sorted(), "{spread}");
    }

    #[test]
    fn even_rows_and_a_recorder_switched_on_for_each_pose_stay_as_they_are() {
        let mut even: Vec<i64> = (0..6000).map(|i| i * SECOND / 100).collect();
        assert_eq!(spread_bursts(&mut even), None);
        let mut poses: Vec<i64> =
            (0..60).flat_map(|p| (0..100).map(move |i| p * 5 * SECOND + i * SECOND / 100)).collect();
        assert_eq!(spread_bursts(&mut poses), None);
        let mut fast: Vec<i64> = (0..60_000).map(|i| i * SECOND / 4000).collect();
        assert_eq!(spread_bursts(&mut fast), None);
    }
}
