//! Which stamp of a message is its time.
//!
//! The header stamp, where it is sane: it is when the sensor measured. Publish time, where it differs from log
//! time. Log time otherwise: in a real recording it jitters by tens of milliseconds. The choice and its reason are
//! part of every report.

use crate::Clock;
use crate::streams::columns::concat_parts;
use crate::streams::sensor_time::{ClockStep, find_clock_step};
use armcal_core::robust::{percentile, percentile_in};

/// Share of header stamps that must be set for the header clock to be used.
const SET_SHARE: f64 = 0.99;
/// Share of steps that may go backwards.
const BACKWARD_SHARE: f64 = 0.05;
/// Share of steps that may repeat the stamp before.
const REPEATED_SHARE: f64 = 0.5;
/// Spread of (log time - stamp) allowed at least [s]; congested recorders reach tenths.
const SPREAD_S: f64 = 1.0;
/// Spread allowed as a share of the recording's duration: a sensor's clock may drift.
const SPREAD_SHARE: f64 = 0.02;

/// Where the two clocks differ, one whose steps are off by less than this share of the other's goes on evenly.
const BLAMELESS: f64 = 0.1;

/// A clock is set no more often in a recording.
const MOST_STEPS: usize = 5;

const A_SECOND_NS: i64 = 1_000_000_000;

/// A stamp must be this many times the spread allowed away from its neighbours before it is called stray.
const STRAY_SPREADS: f64 = 10.0;

/// The stamps of the rows of a stream.
#[derive(Debug, Default, Clone)]
pub(crate) struct Stamps {
    pub header_ns: Vec<Option<i64>>,
    pub publish_ns: Vec<i64>,
    pub log_ns: Vec<i64>,
}

impl Stamps {
    /// Adds a row.
    pub fn push(&mut self, header_ns: Option<i64>, publish_ns: i64, log_ns: i64) {
        self.header_ns.push(header_ns);
        self.publish_ns.push(publish_ns);
        self.log_ns.push(log_ns);
    }

    /// Makes room for rows, if there is any.
    pub fn make_room(&mut self, rows: usize) {
        let _ = self.header_ns.try_reserve_exact(rows);
        let _ = self.publish_ns.try_reserve_exact(rows);
        let _ = self.log_ns.try_reserve_exact(rows);
    }

    /// The rows of part after part.
    pub fn of(parts: Vec<Stamps>) -> Stamps {
        let parts = parts.into_iter().map(|part| (part.header_ns, (part.publish_ns, part.log_ns)));
        let (header_ns, (publish_ns, log_ns)): (Vec<_>, (Vec<_>, Vec<_>)) = parts.unzip();
        Stamps {
            header_ns: concat_parts(header_ns),
            publish_ns: concat_parts(publish_ns),
            log_ns: concat_parts(log_ns),
        }
    }

    /// The least header that is a stamp [ns]: one of zero is none that was set, but for the first of a clock that starts with it.
    fn least_ns(&self) -> i64 {
        let zeros = self.header_ns.iter().flatten().filter(|ns| **ns == 0).count();
        let soon = |ns: &&i64| (1..A_SECOND_NS).contains(*ns);
        let starts = zeros == 1 && self.header_ns.iter().flatten().any(|ns| soon(&ns));
        i64::from(!starts)
    }

    /// Header and log time of the rows whose header is set, in the order of log time.
    fn in_log_order(&self) -> Vec<(i64, i64)> {
        let (both, least_ns) = (self.header_ns.iter().zip(&self.log_ns), self.least_ns());
        let set = both.filter_map(|(header, log)| Some((header.filter(|ns| *ns >= least_ns)?, *log)));
        let mut set: Vec<(i64, i64)> = set.collect();
        set.sort_by_key(|(_, log)| *log);
        set
    }

    /// Takes out the steps of a header clock that was set while log time went on evenly.
    pub fn take_out_steps(&mut self) -> Vec<ClockStep> {
        let mut steps = Vec::new();
        while steps.len() < MOST_STEPS
            && let Some(step) = find_clock_step(&self.in_log_order())
        {
            let by_ns = (step.by_s * 1e9).round() as i64;
            let later =
                self.header_ns.iter_mut().zip(&self.log_ns).filter(|(_, log)| **log >= step.from_log_ns);
            later.for_each(|(header, _)| *header = header.map(|ns| ns - by_ns));
            steps.push(step);
        }
        steps
    }

    /// How far the header's clock is ahead of log time, typically [s]; none where there is no header.
    pub fn ahead_of_log_s(&self) -> Option<f64> {
        let mut ahead: Vec<f64> = self
            .in_log_order()
            .iter()
            .map(|(header, log)| header.saturating_sub(*log) as f64 * 1e-9)
            .collect();
        (!ahead.is_empty()).then(|| percentile_in(&mut ahead, 0.5))
    }

    /// Takes out the time of each row on the given clock; `None` for a row without it.
    pub fn on(&mut self, clock: Clock) -> Vec<Option<i64>> {
        match clock {
            Clock::Header => {
                let least_ns = self.least_ns();
                let mut time = std::mem::take(&mut self.header_ns);
                time.iter_mut().filter(|t| t.is_some_and(|ns| ns < least_ns)).for_each(|t| *t = None);
                time
            }
            Clock::Publish => self.publish_ns.iter().copied().map(Some).collect(),
            Clock::Log => self.log_ns.iter().copied().map(Some).collect(),
        }
    }
}

/// Takes away single header stamps that cannot be right (1970, 2038, a flipped bit), and counts them.
///
/// A stamp is stray when it lies far outside the bulk of the header stamps and does not follow log time as they do:
/// a recorder that stalls, log times that are wrong, or a second session in the same file break only one of the two.
pub(crate) fn drop_stray(time_ns: &mut [Option<i64>], log_ns: &[i64]) -> u64 {
    let latency_s = |time: &Option<i64>, log: &i64| time.map(|t| log.saturating_sub(t) as f64 * 1e-9);
    let late = time_ns.iter().zip(log_ns).filter_map(|(t, log)| latency_s(t, log));
    let ends = (f64::INFINITY, f64::NEG_INFINITY);
    let (least_s, most_s) = late.clone().fold(ends, |(least, most), s| (least.min(s), most.max(s)));
    if most_s - least_s <= STRAY_SPREADS * SPREAD_S {
        // Nobody is further from the median than that, and it is the smallest margin.
        return 0;
    }
    let usual_s = percentile_in(&mut late.collect::<Vec<f64>>(), 0.5);
    let mut set: Vec<f64> = time_ns.iter().flatten().map(|t| *t as f64 * 1e-9).collect();
    let (first_s, last_s) = (percentile_in(&mut set, 0.01), percentile_in(&mut set, 0.99));
    let margin_s = STRAY_SPREADS * SPREAD_S.max(SPREAD_SHARE * (last_s - first_s));
    let mut strays = 0;
    for (time, log) in time_ns.iter_mut().zip(log_ns) {
        let outside = time.is_some_and(|t| {
            let t_s = t as f64 * 1e-9;
            t_s < first_s - margin_s || t_s > last_s + margin_s
        });
        if outside && latency_s(time, log).is_some_and(|s| (s - usual_s).abs() > margin_s) {
            *time = None;
            strays += 1;
        }
    }
    strays
}

/// The clock to use and why.
pub(crate) fn choose_clock(stamps: &Stamps) -> (Clock, String) {
    let why_not_header = match judge_header(stamps) {
        Ok(why) => return (Clock::Header, why),
        Err(why) => why,
    };
    match judge_publish(stamps) {
        Ok(why) => (Clock::Publish, format!("{why_not_header}; {why}")),
        Err(why) => (Clock::Log, format!("{why_not_header}; {why}")),
    }
}

/// Why the header stamps can be trusted, or why not.
pub(crate) fn judge_header(stamps: &Stamps) -> Result<String, String> {
    let rows = stamps.header_ns.len();
    let set = stamps.in_log_order();
    let (stamped, mut backward, mut repeated, mut before) = (set.len(), 0, 0, i64::MIN);
    for (header, _) in &set {
        backward += usize::from(*header < before);
        repeated += usize::from(*header == before);
        before = *header;
    }
    if stamped == 0 {
        let carried = stamps.header_ns.iter().any(Option::is_some);
        return Err(if carried { "header stamps are all zero" } else { "messages carry no stamp" }.to_owned());
    }
    if (stamped as f64) < SET_SHARE * rows as f64 {
        return Err(format!("{} of {rows} header stamps are missing or zero", rows - stamped));
    }
    if backward as f64 > BACKWARD_SHARE * rows as f64 {
        return Err(format!("header stamps go backwards {backward} times in {rows} rows"));
    }
    if repeated as f64 > REPEATED_SHARE * rows as f64 {
        return Err(format!("{repeated} of {rows} header stamps repeat the one before"));
    }
    judge_spread(&set)
}

/// Stamps must run like the log clock, whatever their offset from it.
fn judge_spread(set: &[(i64, i64)]) -> Result<String, String> {
    let duration_s = span_s(set.first().map(|s| s.1), set.last().map(|s| s.1));
    if duration_s == 0.0 {
        return Ok("header stamps are set and increase; log time stands still".to_owned());
    }
    let mut latency_s: Vec<f64> = set.iter().map(|(h, log)| log.saturating_sub(*h) as f64 * 1e-9).collect();
    let spread_s = percentile_in(&mut latency_s, 0.99) - percentile_in(&mut latency_s, 0.01);
    if spread_s > SPREAD_S.max(SPREAD_SHARE * duration_s) {
        let rate = clock_rate(set, duration_s);
        if rate.is_none() && log_is_to_blame(set) {
            return Ok(format!(
                "header stamps are set and evenly spaced; log time is not, it lags by up to {spread_s:.1} s as that of a \
                 recorder that stalls"
            ));
        }
        let rate = rate.map_or(String::new(), |rate| format!(": their clock runs {rate:.4} times as fast"));
        return Err(format!("header stamps wander {spread_s:.3} s against log time{rate}"));
    }
    Ok(format!("header stamps are set, increase, and follow log time within {:.1} ms", spread_s * 1e3))
}

/// How many times as fast as log time the header's clock runs, where it is another rate from row to row and over all.
fn clock_rate(set: &[(i64, i64)], duration_s: f64) -> Option<f64> {
    let steps = |stamp: fn(&(i64, i64)) -> i64| {
        let all: Vec<f64> = set.windows(2).map(|w| span_s(Some(stamp(&w[0])), Some(stamp(&w[1])))).collect();
        percentile(&all, 0.5)
    };
    let over_all = span_s(set.first().map(|s| s.0), set.last().map(|s| s.0)) / duration_s;
    let by_row = steps(|s| s.0) / steps(|s| s.1);
    let off = [over_all - 1.0, by_row - 1.0];
    let alike = (off[0] - off[1]).abs() < 0.5 * off[0].abs();
    (off[0].abs() > SPREAD_SHARE && alike).then_some(over_all)
}

/// Whether, where the two clocks differ from row to row, the header goes on evenly and log time does not.
fn log_is_to_blame(set: &[(i64, i64)]) -> bool {
    let steps_of = |stamp: fn(&(i64, i64)) -> i64| -> Vec<f64> {
        set.windows(2).map(|w| span_s(Some(stamp(&w[0])), Some(stamp(&w[1])))).collect()
    };
    let (header, log) = (steps_of(|s| s.0), steps_of(|s| s.1));
    let (header_s, log_s) = (percentile(&header, 0.5), percentile(&log, 0.5));
    let differ = || header.iter().zip(&log).filter(|(h, l)| (*h - *l).abs() > 0.5 * header_s);
    let by_header: f64 = differ().map(|(h, _)| (h - header_s).abs()).sum();
    let by_log: f64 = differ().map(|(_, l)| (l - log_s).abs()).sum();
    by_header < BLAMELESS * by_log
}

fn judge_publish(stamps: &Stamps) -> Result<String, String> {
    let rows = stamps.publish_ns.len();
    let pairs = || stamps.publish_ns.iter().zip(&stamps.log_ns);
    let few = |n: usize| n as f64 <= (1.0 - SET_SHARE) * rows as f64;
    if few(pairs().filter(|(publish, log)| publish != log).count()) {
        return Err("publish time equals log time".to_owned());
    }
    if !few(stamps.publish_ns.iter().filter(|ns| **ns <= 0).count()) {
        return Err("publish time is not set".to_owned());
    }
    let mut by_log: Vec<(i64, i64)> = pairs().map(|(publish, log)| (*log, *publish)).collect();
    by_log.sort_by_key(|(log, _)| *log);
    let backward = by_log.windows(2).filter(|w| w[1].1 < w[0].1).count();
    if backward as f64 > BACKWARD_SHARE * rows as f64 {
        return Err(format!("publish time goes backwards {backward} times in {rows} rows"));
    }
    Ok("publish time is set and differs from log time".to_owned())
}

fn span_s(from: Option<i64>, to: Option<i64>) -> f64 {
    from.zip(to).map_or(0.0, |(a, b)| b.saturating_sub(a) as f64 * 1e-9)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 100 rows at 100 Hz, with stamps as the closures say, given the log time.
    fn stamps(header: impl Fn(i64) -> Option<i64>, publish: impl Fn(i64) -> i64) -> Stamps {
        let log_ns: Vec<i64> = (0..1000).map(|i| 1_700_000_000_000_000_000 + i * 10_000_000).collect();
        Stamps {
            header_ns: log_ns.iter().map(|t| header(*t)).collect(),
            publish_ns: log_ns.iter().map(|t| publish(*t)).collect(),
            log_ns,
        }
    }

    #[test]
    fn a_sane_header_wins_whatever_its_offset() {
        // The tracker's clock is a day off and drifts by 100 ppm.
        let s = stamps(|t| Some((t - 86_400_000_000_000) / 10_000 * 10_001), |t| t - 5);
        assert_eq!(choose_clock(&s).0, Clock::Header);
    }

    #[test]
    fn only_stamps_that_fit_neither_their_neighbours_nor_log_time_are_stray() {
        let log_ns: Vec<i64> = (0..1000).map(|i| 1_700_000_000_000_000_000 + i * 10_000_000).collect();
        let mut time: Vec<Option<i64>> = log_ns.iter().map(|t| Some(t - 86_400_000_000_000)).collect();
        time[400] = Some(2_147_483_647_000_000_000);
        time[401] = Some(1);
        time[402] = None;
        assert_eq!(drop_stray(&mut time, &log_ns), 2);
        assert_eq!((time[400], time[401], time[399].is_some()), (None, None, true));
        // A recorder that stalls for a minute, and a log clock that is wrong for a row.
        let mut log_late = log_ns.clone();
        log_late[995..].iter_mut().for_each(|t| *t += 60_000_000_000);
        log_late[3] = i64::MAX;
        let mut time: Vec<Option<i64>> = log_ns.iter().copied().map(Some).collect();
        assert_eq!(drop_stray(&mut time, &log_late), 0);
        // A short session an hour earlier in the same file.
        let mut log_two = log_ns.clone();
        log_two[..5].iter_mut().for_each(|t| *t -= 3_600_000_000_000);
        let mut time: Vec<Option<i64>> = log_two.iter().copied().map(Some).collect();
        assert_eq!(drop_stray(&mut time, &log_two), 0);
    }

    #[test]
    fn a_recorder_that_stalls_does_not_cost_the_header_its_trust() {
        // For 3 of 10 s nothing is written, then all at once: log time lags by up to 3 s.
        let mut s = stamps(Some, |t| t);
        let (from, to) = (s.log_ns[300], s.log_ns[600]);
        s.log_ns.iter_mut().filter(|t| (from..to).contains(*t)).for_each(|t| *t = to - 1);
        s.publish_ns.clone_from(&s.log_ns);
        let (clock, why) = choose_clock(&s);
        assert!(clock == Clock::Header && why.contains("recorder that stalls"), "{why}");
        // A header clock that is set by 3 s for a while is not evenly spaced.
        let set = stamps(|t| Some(if (from..to).contains(&t) { t + 3_000_000_000 } else { t }), |t| t);
        assert_eq!(choose_clock(&set).0, Clock::Log);
    }

    #[test]
    fn a_bad_header_gives_way_to_publish_then_log() {
        let none = stamps(|_| None, |t| t - 3_000_000);
        assert_eq!(
            choose_clock(&none),
            (Clock::Publish, "messages carry no stamp; publish time is set and differs from log time".into())
        );
        let zero = stamps(|_| Some(0), |t| t);
        let (clock, why) = choose_clock(&zero);
        assert_eq!(clock, Clock::Log);
        assert!(why.contains("all zero") && why.contains("equals log time"), "{why}");
        let stuck = stamps(|_| Some(1_700_000_000_000_000_000), |t| t);
        assert!(choose_clock(&stuck).1.contains("repeat"), "{:?}", choose_clock(&stuck));
        let slow = stamps(|t| Some(t / 2), |t| t);
        assert!(choose_clock(&slow).1.contains("wander"), "{:?}", choose_clock(&slow));
        let falling = stamps(|t| Some(3_400_000_000_000_000_000 - t), |_| 0);
        let (clock, why) = choose_clock(&falling);
        assert!(clock == Clock::Log && why.contains("backwards") && why.contains("not set"), "{why}");
    }
}
