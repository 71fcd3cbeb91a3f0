//! Several joint streams as one, so that a dwell is an interval in which all of them stand still.
//!
//! All must be stamped by one clock. The rows are those of the slowest stream, each with the latest reading of every other:
//! nothing is interpolated, and no reading of the slowest one is used twice.

use crate::{JointStream, RecordingError};
use armcal_core::JointSamples;
use armcal_core::robust::median;

/// A reading older than this many periods of its own stream is missing, not old.
const OLDEST_PERIODS: f64 = 3.5;

/// Joins streams: the columns of the first, then those of the next.
///
/// # Errors
/// No time at which all were recorded.
pub(crate) fn as_one(
    streams: &[JointStream],
    mut all: Vec<JointSamples>,
) -> Result<JointSamples, RecordingError> {
    if all.len() < 2 {
        return Ok(all.pop().unwrap_or_default());
    }
    check_overlap(streams, &all)?;
    let period_s: Vec<f64> = all.iter().map(median_period_s).collect();
    // Of equals the first.
    let slowest = (0..all.len()).fold(0, |slow, k| if period_s[k] > period_s[slow] { k } else { slow });
    let latest = |k: usize, time_ns: i64| {
        let latest = all[k].time_ns.partition_point(|t| *t <= time_ns).checked_sub(1)?;
        let is_new = seconds_between(all[k].time_ns[latest], time_ns) <= OLDEST_PERIODS * period_s[k];
        is_new.then_some(latest)
    };
    let rows = all[slowest].time_ns.iter();
    let picked: Vec<Vec<usize>> =
        rows.filter_map(|time_ns| (0..all.len()).map(|k| latest(k, *time_ns)).collect()).collect();
    let columns = |of: &dyn Fn(&JointSamples, usize, usize) -> f64| -> Vec<Vec<f64>> {
        let joints = (0..all.len()).flat_map(|k| (0..all[k].joint_rad.len()).map(move |joint| (k, joint)));
        joints.map(|(k, joint)| picked.iter().map(|at| of(&all[k], joint, at[k])).collect()).collect()
    };
    // A stream that measures none leaves the others their own.
    let effort = |s: &JointSamples, joint: usize, row: usize| {
        s.effort_nm.as_ref().map_or(f64::NAN, |columns| columns[joint][row])
    };
    let efforts = all.iter().any(|s| s.effort_nm.is_some());
    let named = |(stream, own): (&JointStream, &JointSamples)| -> Vec<String> {
        let prefix = stream.arm.as_ref().map_or(String::new(), |arm| format!("{arm}."));
        own.names.iter().map(|joint| format!("{prefix}{joint}")).collect()
    };
    Ok(JointSamples {
        time_ns: picked.iter().map(|at| all[slowest].time_ns[at[slowest]]).collect(),
        names: streams.iter().zip(&all).flat_map(named).collect(),
        joint_rad: columns(&|s, joint, row| s.joint_rad[joint][row]),
        effort_nm: efforts.then(|| columns(&effort)),
        ahead_of_log_s: all[slowest].ahead_of_log_s,
    })
}

/// Refuses streams that are not all recorded at some time.
fn check_overlap(streams: &[JointStream], all: &[JointSamples]) -> Result<(), RecordingError> {
    let refused = |what: String| Err(RecordingError::NotTogether { what });
    let span = |s: &JointSamples| Some([*s.time_ns.first()?, *s.time_ns.last()?]);
    let Some(spans) = all.iter().map(span).collect::<Option<Vec<[i64; 2]>>>() else {
        return refused("have one without rows".into());
    };
    let spans = || streams.iter().zip(&spans);
    let first_to_end = spans().min_by_key(|(_, [_, end_ns])| *end_ns);
    let last_to_begin = spans().max_by_key(|(_, [start_ns, _])| *start_ns);
    match first_to_end.zip(last_to_begin) {
        Some(((ends, [_, end_ns]), (begins, [start_ns, _]))) if end_ns <= start_ns => refused(format!(
            "do not overlap: {} ends {:.1} s before {} begins",
            ends.called(),
            seconds_between(*end_ns, *start_ns),
            begins.called()
        )),
        _ => Ok(()),
    }
}

fn median_period_s(stream: &JointSamples) -> f64 {
    let periods: Vec<f64> = stream.time_ns.windows(2).map(|w| seconds_between(w[0], w[1])).collect();
    median(&periods)
}

fn seconds_between(from_ns: i64, to_ns: i64) -> f64 {
    (i128::from(to_ns) - i128::from(from_ns)) as f64 * 1e-9
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may stop")]
mod tests {
    use super::*;

    fn stream(start_ms: i64, period_ms: i64, rows: i64) -> JointSamples {
        let time_ns: Vec<i64> = (0..rows).map(|i| (start_ms + i * period_ms) * 1_000_000).collect();
        let joint_rad = vec![time_ns.iter().map(|t| *t as f64 * 1e-9).collect()];
        JointSamples { time_ns, names: vec!["joint1".into()], joint_rad, ..JointSamples::default() }
    }

    fn of(arms: &[&str]) -> Vec<JointStream> {
        let arm = |name: &&str| JointStream { arm: Some((*name).to_owned()), ..JointStream::default() };
        arms.iter().map(arm).collect()
    }

    #[test]
    fn the_slowest_stream_gives_the_rows_and_the_others_their_latest_reading() {
        let (slow, fast, faster) = (stream(0, 20, 50), stream(3, 7, 200), stream(1, 4, 300));
        for order in [[0, 1, 2], [1, 0, 2], [2, 1, 0]] {
            let all = order.map(|k| [&slow, &fast, &faster][k].clone());
            let slowest = order.iter().position(|k| *k == 0).unwrap();
            let joined = as_one(&of(&["right", "left", "torso"]), all.to_vec()).unwrap();
            assert_eq!(joined.names, ["right.joint1", "left.joint1", "torso.joint1"]);
            // The first row of the slowest comes before the others begin.
            assert_eq!(joined.len(), 49);
            for i in 0..joined.len() {
                let now_s = joined.time_ns[i] as f64 * 1e-9;
                for (k, column) in joined.joint_rad.iter().enumerate() {
                    let late_s = now_s - column[i];
                    assert!(if k == slowest { late_s == 0.0 } else { (0.0..0.007).contains(&late_s) });
                }
            }
        }
    }

    #[test]
    fn a_gap_of_one_stream_is_a_gap_of_all() {
        let mut gappy = stream(0, 10, 300);
        let keep = |t: &i64| !(1_000_000_000..2_000_000_000).contains(t);
        gappy.joint_rad[0] = gappy.time_ns.iter().filter(|t| keep(t)).map(|t| *t as f64 * 1e-9).collect();
        gappy.time_ns.retain(keep);
        let joined = as_one(&of(&["right", "left"]), vec![stream(0, 10, 300), gappy]).unwrap();
        let widest = joined.time_ns.windows(2).map(|w| w[1] - w[0]).max().unwrap();
        assert!((970_000_000..990_000_000).contains(&widest), "{widest}");
    }

    #[test]
    fn streams_that_do_not_overlap_are_told_in_words() {
        let names = of(&["right", "left"]);
        let apart = as_one(&names, vec![stream(60_000, 10, 100), stream(0, 10, 100)]).unwrap_err();
        assert!(apart.to_string().contains("left ends 59.0 s before right begins"), "{apart}");
        let empty = as_one(&names, vec![stream(0, 10, 0), stream(0, 10, 9)]).unwrap_err();
        assert!(empty.to_string().contains("without rows"), "{empty}");
    }
}
