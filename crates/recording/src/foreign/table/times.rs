//! When the rows of a table were taken, and whether they are poses at rest or a stream.

use super::{Table, Values};
use chrono::{DateTime, NaiveDateTime};

/// Names of columns of time.
const NAMES: [&str; 9] = ["t", "time", "timestamp", "stamp", "date", "datetime", "secs", "seconds", "clock"];
/// Rows further apart are poses one by one [s].
const ONE_BY_ONE_S: f64 = 0.4;
/// Time between two poses whose own is not known, and the least [s].
const APART_S: f64 = 3.0;
/// Times that fall by more start anew; what follows is put so much later [s].
const FALLS_S: f64 = 1.0;
const ANEW_S: f64 = 10.0;
/// A row that moves on by less than this share of the range is one of a stream.
const SMOOTH: f64 = 0.02;

/// The times of all rows.
#[derive(Debug)]
pub(super) struct Times {
    /// Since the first row, or its epoch [ns].
    pub ns: Vec<u64>,
    /// Whether each row is a pose at rest.
    pub at_rest: bool,
}

/// Takes the column of times out of a table; where there is none the rows are poses in their order.
pub(super) fn take_times(table: &mut Table) -> Result<Times, String> {
    let rows = table.rows();
    let found = table.columns.iter().enumerate().find_map(|(at, column)| {
        let lower = column.name.to_lowercase();
        let mut words = lower.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty());
        let first = words.next()?;
        let last = lower.rsplit(['.', '/', '_', ' ']).next().unwrap_or_default();
        let named = NAMES.contains(&first) || NAMES.contains(&last) || last.ends_with("timestamp");
        let seconds = if named { seconds_of(&column.values, &lower)? } else { return None };
        seconds.iter().all(|s| s.is_finite()).then_some((at, seconds))
    });
    let Some((at, mut seconds)) = found else {
        if is_smooth(table) {
            return Err("its rows follow each other as those of a stream do, but no column has their times: name it `time`, with \
                        its unit as in `time_s` or `time_ms`"
                .to_owned());
        }
        table.notes.push(format!(
            "no column is a time: its {rows} rows are taken for poses at rest, in their order"
        ));
        return Ok(Times { ns: (0..rows).map(|i| to_ns(i as f64 * APART_S)).collect(), at_rest: true });
    };
    let name = table.columns.remove(at).name;
    add_nanoseconds(table, &name, &mut seconds);
    let anew = continue_times(&mut seconds);
    if anew > 0 {
        table.notes.push(format!("{name} starts anew {anew} times: what follows is taken for later"));
    }
    let mut steps: Vec<f64> = seconds.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f64::total_cmp);
    let at_rest = rows < 3 || steps[steps.len() / 2] > ONE_BY_ONE_S;
    if at_rest {
        table.notes.push(format!("{name} is the time of its {rows} rows, which are taken for poses at rest"));
        let mut before = f64::NEG_INFINITY;
        for s in &mut seconds {
            *s = s.max(before + APART_S);
            before = *s;
        }
    }
    Ok(Times { ns: seconds.into_iter().map(to_ns).collect(), at_rest })
}

/// Adds what a column beside that of whole seconds has of them, as `stamp.nsecs` beside `stamp.secs`.
fn add_nanoseconds(table: &mut Table, name: &str, seconds: &mut [f64]) {
    let Some(stem) = name.strip_suffix('s').unwrap_or(name).strip_suffix("sec") else { return };
    let names = ["nsec", "nsecs", "nanosec", "nanosecs"].map(|part| format!("{stem}{part}"));
    let Some(at) = table.columns.iter().position(|column| names.contains(&column.name)) else { return };
    if let Values::Numbers(nanoseconds) = &table.columns[at].values {
        seconds.iter_mut().zip(nanoseconds).for_each(|(s, ns)| *s += ns * 1e-9);
        table.columns.remove(at);
    }
}

fn to_ns(seconds: f64) -> u64 {
    (seconds * 1e9).round() as u64
}

/// Times [s] of a column that is called as given, none below zero.
fn seconds_of(values: &Values, name: &str) -> Option<Vec<f64>> {
    let mut seconds = match values {
        Values::Numbers(values) => {
            let largest = values.iter().fold(0.0_f64, |l, x| l.max(x.abs()));
            let factor = match name.rsplit(|c: char| !c.is_alphanumeric()).find(|word| !word.is_empty()) {
                Some("ns") => 1e-9,
                Some("us") => 1e-6,
                Some("ms") => 1e-3,
                Some("s" | "sec" | "secs" | "seconds") => 1.0,
                // Since 1970 in nanoseconds, microseconds, milliseconds.
                _ if largest > 1e17 => 1e-9,
                _ if largest > 1e14 => 1e-6,
                _ if largest > 1e11 => 1e-3,
                _ => 1.0,
            };
            values.iter().map(|x| x * factor).collect::<Vec<f64>>()
        }
        Values::Texts(texts) => texts.iter().map(|text| seconds_in(text)).collect::<Option<_>>()?,
        Values::Lists { .. } => return None,
    };
    let least = seconds.iter().copied().fold(0.0, f64::min);
    seconds.iter_mut().for_each(|s| *s -= least);
    Some(seconds)
}

/// A date with its time, as ISO 8601 and what it allows for.
fn seconds_in(text: &str) -> Option<f64> {
    let zoned = DateTime::parse_from_rfc3339(text).ok().map(|at| at.to_utc().naive_utc());
    let plain = || {
        let ways = ["%Y-%m-%dT%H:%M:%S%.f", "%Y-%m-%d %H:%M:%S%.f", "%Y/%m/%d %H:%M:%S%.f"];
        ways.iter().find_map(|way| NaiveDateTime::parse_from_str(text, way).ok())
    };
    let at = zoned.or_else(plain)?.and_utc();
    Some(at.timestamp() as f64 + f64::from(at.timestamp_subsec_nanos()) * 1e-9)
}

/// Puts parts whose times start anew behind each other; returns how often they did.
fn continue_times(seconds: &mut [f64]) -> usize {
    let (mut anew, mut shift, mut before) = (0, 0.0, f64::NEG_INFINITY);
    for s in seconds {
        if *s + shift < before - FALLS_S {
            shift = before + ANEW_S - *s;
            anew += 1;
        }
        *s += shift;
        before = *s;
    }
    anew
}

/// Whether each row goes on from the one before, as many as there are.
fn is_smooth(table: &Table) -> bool {
    let (mut smooth, mut all) = (0, 0);
    for column in &table.columns {
        let Values::Numbers(values) = &column.values else { continue };
        let (low, high) = values.iter().fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(*x), h.max(*x)));
        if high > low && values.len() > 100 {
            let mut steps: Vec<f64> = values.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
            steps.sort_by(f64::total_cmp);
            all += 1;
            smooth += usize::from(steps[steps.len() * 3 / 4] < SMOOTH * (high - low));
        }
    }
    all > 0 && smooth == all
}

#[cfg(test)]
mod tests {
    use super::super::Column;
    use super::*;

    fn table(name: &str, values: Values) -> Table {
        Table { columns: vec![Column { name: name.to_owned(), values }], ..Table::default() }
    }

    #[test]
    fn times_are_read_in_the_unit_of_their_name_or_size() {
        for (name, values) in [
            ("time", Values::Numbers(vec![0.0, 0.01, 0.02])),
            ("timestamp_ms", Values::Numbers(vec![0.0, 10.0, 20.0])),
            ("t [us]", Values::Numbers(vec![0.0, 1e4, 2e4])),
            ("header.stamp", Values::Numbers(vec![-0.01, 0.0, 0.01])),
        ] {
            let times = take_times(&mut table(name, values)).expect(name);
            assert_eq!((times.ns, times.at_rest), (vec![0, 10_000_000, 20_000_000], false), "{name}");
        }
        let ns = take_times(&mut table("stamp", Values::Numbers(vec![1.7e18, 1.7e18 + 1e9, 1.7e18 + 9e9])))
            .expect("times");
        assert_eq!(ns.ns[2] - ns.ns[0], 9_000_000_000);
        let column = |name: &str, values: &[f64]| Column {
            name: name.to_owned(),
            values: Values::Numbers(values.to_vec()),
        };
        let columns = vec![column("stamp.secs", &[7.0, 7.0, 8.0]), column("stamp.nsecs", &[8e8, 9e8, 0.0])];
        let parts = take_times(&mut Table { columns, ..Table::default() }).expect("times");
        assert_eq!(parts.ns, [7_800_000_000, 7_900_000_000, 8_000_000_000]);
        let texts = ["2026-01-02T03:04:05Z", "2026-01-02 03:04:15.5", "2026-01-02T04:04:25+01:00"];
        let texts = Values::Texts(texts.map(str::to_owned).to_vec());
        let dates = take_times(&mut table("Date", texts)).expect("times");
        assert_eq!([dates.ns[1] - dates.ns[0], dates.ns[2] - dates.ns[0]], [10_500_000_000, 20_000_000_000]);
    }

    #[test]
    fn rows_without_times_are_poses_unless_they_are_a_stream() {
        let rough = Values::Numbers((0..200).map(|i| f64::from(i * 7919 % 200)).collect());
        let times = take_times(&mut table("q1", rough)).expect("poses");
        assert!(times.at_rest && times.ns[1] == 3_000_000_000);
        let smooth = Values::Numbers((0..200).map(|i| (f64::from(i) * 0.03).sin()).collect());
        assert!(take_times(&mut table("q1", smooth)).is_err_and(|why| why.contains("time_s")));
        let mut anew = table("t_s", Values::Numbers(vec![0.0, 5.0, 0.0, 5.0]));
        assert_eq!(take_times(&mut anew).expect("times").ns[2], 15_000_000_000);
    }
}
