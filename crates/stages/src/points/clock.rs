//! The clock of a tracker: how its times are written, and by how much it is off the recording's.

use chrono::{DateTime, NaiveDateTime, NaiveTime, TimeDelta};
use std::collections::BTreeMap;

const DAY_NS: i64 = 86_400_000_000_000;
const DATES: [&str; 6] = ["%Y-%m-%d", "%Y/%m/%d", "%m/%d/%Y", "%d/%m/%Y", "%d.%m.%Y", "%d-%b-%Y"];
const TIMES: [&str; 4] = ["%H:%M:%S%.f", "%I:%M:%S%.f %p", "%H:%M", "%I:%M %p"];
/// Offsets at which fewer rows are in dwells than this share of the most are not looked at.
const NEAR: f64 = 0.85;

/// What is written in a column of times, each with its line, as times since its first row [ns].
///
/// All rows are written in one way: seconds, date and time with or without a zone, or the time of a day, which goes on over
/// midnight: the next row is within half a day of the one before.
pub fn parse_times(column: &[(u64, &str)]) -> Result<Vec<i64>, String> {
    let dates = DATES
        .iter()
        .flat_map(|d| [' ', 'T'].into_iter().flat_map(move |s| TIMES.map(|t| format!("{d}{s}{t}"))));
    let mut forms: Vec<Form> = dates.map(Form::Date).chain(TIMES.map(Form::Clock)).collect();
    forms.extend([Form::Seconds, Form::Zoned]);
    let mut read: Vec<Vec<i64>> = forms.iter().filter_map(|form| form.all(column)).collect();
    read.dedup();
    match (read.pop(), read.is_empty(), column.first()) {
        (Some(one), true, _) => Ok(one),
        (Some(_), false, Some((line, text))) => Err(format!(
            "line {line}: `{text}` does not say which is the day and which the month: write the year first"
        )),
        (_, _, first) => {
            forms.retain(|form| first.is_some_and(|(_, text)| form.read(text).is_some()));
            let unread = column.iter().find(|(_, text)| forms.iter().all(|form| form.read(text).is_none()));
            let (line, text) = unread.or(first).copied().unwrap_or_default();
            Err(format!(
                "line {line}: `{text}` is no time, or not written as the first is: seconds, 2026-03-01T14:05:09.25, \
                 3/1/2026 2:05:09 PM and 14:05:09.25 are read"
            ))
        }
    }
}

/// A way to write times.
enum Form {
    Seconds,
    Zoned,
    Date(String),
    Clock(&'static str),
}

impl Form {
    fn read(&self, text: &str) -> Option<i64> {
        let text = text.replace(',', ".");
        match self {
            Form::Seconds => {
                text.parse().ok().filter(|s: &f64| s.abs() < 9e9).map(|s| (s * 1e9).round() as i64)
            }
            Form::Zoned => DateTime::parse_from_rfc3339(&text).ok()?.timestamp_nanos_opt(),
            Form::Date(form) => {
                NaiveDateTime::parse_from_str(&text, form).ok()?.and_utc().timestamp_nanos_opt()
            }
            Form::Clock(form) => {
                let time = NaiveTime::parse_from_str(&text, form).ok()?;
                TimeDelta::num_nanoseconds(&(time - NaiveTime::MIN))
            }
        }
    }

    /// All times since the first.
    fn all(&self, column: &[(u64, &str)]) -> Option<Vec<i64>> {
        let mut times = column.iter().map(|(_, text)| self.read(text)).collect::<Option<Vec<i64>>>()?;
        if matches!(self, Form::Clock(_)) {
            for i in 1..times.len() {
                let days = (times[i] - times[i - 1]) as f64 / DAY_NS as f64;
                times[i] -= days.round() as i64 * DAY_NS;
            }
        }
        let first = *times.first()?;
        Some(times.iter().map(|t| t.saturating_sub(first)).collect())
    }
}

/// An offset between two clocks.
#[derive(Debug, Clone, PartialEq)]
pub struct Offset {
    /// What has to be added to a row's time [ns].
    pub ns: i64,
    /// It may be this much more or less without a row changing its dwell [ns].
    pub within_ns: i64,
    /// How many dwells have a row.
    pub dwells: usize,
}

impl Offset {
    /// The dwell of a time.
    pub fn dwell(&self, time_ns: i64, dwells_ns: &[(i64, i64)]) -> Option<usize> {
        let at = time_ns.saturating_add(self.ns);
        let next = dwells_ns.partition_point(|(_, end)| *end < at);
        dwells_ns.get(next).filter(|(start, _)| *start <= at).map(|_| next)
    }
}

/// The offsets at which the most dwells have a row, best first; of those that differ by less than half of the dwells last, one.
///
/// A row is in a dwell for an interval of offsets: all ends of all intervals are passed in turn.
pub fn offset_candidates(rows_ns: &[i64], dwells_ns: &[(i64, i64)]) -> Vec<Offset> {
    // Where an interval ends another may begin at the same offset: both hold there.
    let mut ends: Vec<(i64, bool, usize)> = Vec::with_capacity(2 * rows_ns.len() * dwells_ns.len());
    for row in rows_ns {
        for (dwell, (start, end)) in dwells_ns.iter().enumerate() {
            let [start, end] = [start, end].map(|time| time.saturating_sub(*row));
            ends.extend([(start, false, dwell), (end, true, dwell)]);
        }
    }
    ends.sort_unstable();
    let mut rows_in: BTreeMap<usize, usize> = BTreeMap::new();
    let mut all = Vec::new();
    let mut began = None;
    for (at, is_end, dwell) in ends {
        let rows = rows_in.entry(dwell).or_default();
        if !is_end {
            *rows += 1;
            if *rows == 1 {
                began = Some(at);
            }
            continue;
        }
        *rows -= 1;
        if *rows > 0 {
            continue;
        }
        if let Some(from) = began.take() {
            let within_ns = at.saturating_sub(from) / 2;
            all.push(Offset { ns: from + within_ns, within_ns, dwells: rows_in.len() });
        }
        rows_in.remove(&dwell);
    }
    let most = all.iter().map(|o| o.dwells).max().unwrap_or(0);
    all.retain(|o| o.dwells as f64 >= NEAR * most as f64);
    all.sort_by_key(|o| (std::cmp::Reverse((o.dwells, o.within_ns)), o.ns));
    let mut lasted: Vec<i64> = dwells_ns.iter().map(|(start, end)| end - start).collect();
    lasted.sort_unstable();
    let apart = lasted.get(lasted.len() / 2).copied().unwrap_or(0);
    let mut kept: Vec<Offset> = Vec::new();
    for offset in all {
        if kept.iter().all(|k| k.ns.abs_diff(offset.ns) > apart.unsigned_abs()) {
            kept.push(offset);
        }
    }
    kept
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may stop")]
mod tests {
    use super::*;

    fn seconds(column: &[&str]) -> Result<Vec<f64>, String> {
        let column: Vec<(u64, &str)> = (2..).zip(column.iter().copied()).collect();
        Ok(parse_times(&column)?.into_iter().map(|ns| ns as f64 / 1e9).collect())
    }

    #[test]
    fn times_are_read_however_they_are_written_and_go_on_over_midnight() {
        for column in [
            ["1700000000.5", "1700000010.75", "1700003600.5"],
            ["12,5", "22,75", "3612,5"],
            ["2026-03-01T14:05:09.25Z", "2026-03-01T15:05:19.5+01:00", "2026-03-01T15:05:09.25Z"],
            ["2026-03-01 14:05:09.25", "2026-03-01 14:05:19.5", "2026-03-01 15:05:09.25"],
            ["3/1/2026 11:05:09 PM", "3/1/2026 11:05:19.25 PM", "3/2/2026 12:05:09 AM"],
            ["31/12/2026 23:05:09", "31/12/2026 23:05:19,25", "01/01/2027 00:05:09"],
            ["1.3.2026 14:05:09", "1.3.2026 14:05:19,25", "1.3.2026 15:05:09"],
            ["23:05:09", "23:05:19.25", "00:05:09"],
            ["11:05:09 pm", "11:05:19.25 pm", "12:05:09 am"],
        ] {
            // Two months or two days apart: only one of them is an hour.
            let read = seconds(&column);
            if column[0].starts_with("3/1") {
                assert!(read.unwrap_err().contains("which is the day and which the month"));
                continue;
            }
            // Seconds since 1970 have a quarter of a microsecond in 64 bits.
            let off =
                read.unwrap().into_iter().zip([0.0, 10.25, 3600.0]).map(|(a, b): (f64, f64)| (a - b).abs());
            assert!(off.fold(0.0, f64::max) < 3e-7, "{column:?}");
        }
        assert_eq!(seconds(&["3/1/2026 9:05", "3/1/2026 9:06"]).unwrap(), [0.0, 60.0]);
        // Rows out of order stay within their day.
        assert_eq!(seconds(&["9:02", "9:01", "20:59", "0:01"]).unwrap(), [0.0, -60.0, 43_020.0, 53_940.0]);
        for (column, words) in [
            (["9:01", "9:61"], "line 3: `9:61` is no time"),
            (["later", "9:01"], "line 2: `later`"),
            (["", "9:01"], "line 2: ``"),
            (["9:01", "2026-03-01 9:02"], "line 3: `2026-03-01 9:02`"),
            (["inf", "1"], "line 2: `inf`"),
        ] {
            assert!(seconds(&column).unwrap_err().contains(words), "{column:?}: {:?}", seconds(&column));
        }
    }

    #[test]
    fn the_offset_is_the_one_at_which_every_dwell_has_its_row() {
        // Irregular pauses, 2 to 5 s long; every third was missed, one row was measured on the way.
        let mut start = 0;
        let dwells: Vec<(i64, i64)> = (0..40_i64)
            .map(|k| {
                start += 3_000 + (k * k * 7_919) % 4_001;
                let lasts = 2_000 + (k * 1_237) % 3_001;
                start += lasts;
                (start - lasts, start)
            })
            .collect();
        let truth = 86_400_000 + 123_456;
        let mut rows: Vec<i64> = dwells
            .iter()
            .enumerate()
            .filter(|(k, _)| k % 3 != 1)
            .map(|(_, d)| (d.0 + d.1) / 2 - truth)
            .collect();
        rows.insert(9, dwells[20].1 + 1_000 - truth);
        let found = offset_candidates(&rows, &dwells);
        let best = &found[0];
        assert!((best.ns - truth).abs() <= best.within_ns && best.dwells == 27, "{found:?}");
        let paired: Vec<Option<usize>> = rows.iter().map(|r| best.dwell(*r, &dwells)).collect();
        let mut wanted: Vec<Option<usize>> = (0..40).filter(|k| k % 3 != 1).map(Some).collect();
        wanted.insert(9, None);
        assert_eq!(paired, wanted);
        // Like clockwork: shifts by whole periods are told apart by nothing here.
        let even: Vec<(i64, i64)> = (0..40).map(|k| (k * 5_000, k * 5_000 + 2_000)).collect();
        let rows: Vec<i64> = even[4..34].iter().map(|d| d.0 + 700).collect();
        let found = offset_candidates(&rows, &even);
        assert!(found.len() > 10 && found[..11].iter().all(|o| o.dwells == 30), "{found:?}");
        assert!(found.iter().any(|o| o.ns.abs() <= o.within_ns));
        assert!(offset_candidates(&[], &even).is_empty() && offset_candidates(&rows, &[]).is_empty());
    }
}
