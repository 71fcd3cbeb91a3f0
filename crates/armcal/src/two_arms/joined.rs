//! Two joint streams as one, so that a dwell is an interval in which both arms stand still.
//!
//! Both streams must be stamped by one clock. The rows are those of the slower stream, each with the latest reading of
//! the other: nothing is interpolated, and no reading of the slower one is used twice.

use super::TwoArms;
use crate::error::Error;
use armcal_core::robust::median;
use armcal_core::{JointSamples, Samples, Warning};
use armcal_recording::{Recording, StreamReport};

/// A reading older than this many periods of its own stream is missing, not old.
const OLDEST_PERIODS: f64 = 3.5;

/// Reads the joint streams of both arms as one.
///
/// # Errors
/// A recording that cannot be read, streams that do not overlap.
pub fn read(
    two: &TwoArms,
    name: &str,
    recording: &Recording,
) -> Result<(Samples, Vec<StreamReport>, Vec<Warning>), Error> {
    let (mut joints, mut streams, mut warnings) = (Vec::new(), Vec::new(), Vec::new());
    for (arm, own) in two.arms.iter().zip(two.streams()) {
        let read = recording.read(&own);
        let (samples, of_arm, said) =
            read.map_err(|source| Error::Recording { recording: name.to_owned(), source })?;
        joints.push(samples.joints);
        streams.extend(of_arm);
        warnings.extend(
            said.into_iter().map(|w| Warning { subject: format!("{}: {}", arm.name, w.subject), ..w }),
        );
    }
    let names = two.arms.each_ref().map(|arm| arm.name.as_str());
    let joined = <[JointSamples; 2]>::try_from(joints).map_err(|_| "there must be two joint streams".into());
    let joints = joined
        .and_then(|joints| join(&joints, names))
        .map_err(|problem| Error::TwoArms { problem: format!("recording `{name}`: {problem}") })?;
    Ok((Samples { joints, ..Samples::default() }, streams, warnings))
}

/// Joins the streams of both arms: the columns of the first, then those of the second.
///
/// # Errors
/// In words: no time at which both were recorded.
fn join(arms: &[JointSamples; 2], names: [&str; 2]) -> Result<JointSamples, String> {
    let span = |s: &JointSamples| Some([*s.time_ns.first()?, *s.time_ns.last()?]);
    let [Some(a), Some(b)] = [span(&arms[0]), span(&arms[1])] else {
        return Err("one of the joint streams has no rows".into());
    };
    let overlap = [a[0].max(b[0]), a[1].min(b[1])];
    if overlap[0] >= overlap[1] {
        let (first, second, gap_s) =
            if a[1] <= b[0] { (names[0], names[1], b[0] - a[1]) } else { (names[1], names[0], a[0] - b[1]) };
        return Err(format!(
            "the joint streams of both arms do not overlap: {first} ends {:.1} s before {second} begins; record them \
             together, and stamp both by one clock",
            gap_s as f64 * 1e-9
        ));
    }
    let period_s = arms.each_ref().map(median_period_s);
    let slower = usize::from(period_s[1] > period_s[0]);
    let (rows, other) = (&arms[slower], &arms[1 - slower]);
    let oldest_s = OLDEST_PERIODS * period_s[1 - slower];
    let mut picked: Vec<[usize; 2]> = Vec::new();
    for (row, time_ns) in rows.time_ns.iter().enumerate() {
        let latest = other.time_ns.partition_point(|t| t <= time_ns).checked_sub(1);
        let latest = latest.filter(|&i| seconds(other.time_ns[i], *time_ns) <= oldest_s);
        picked.extend(latest.map(|latest| if slower == 0 { [row, latest] } else { [latest, row] }));
    }
    let columns = |of: &dyn Fn(&JointSamples, usize, usize) -> f64| -> Vec<Vec<f64>> {
        let joints = (0..2).flat_map(|arm| (0..arms[arm].joint_rad.len()).map(move |joint| (arm, joint)));
        let column =
            |(arm, joint): (usize, usize)| picked.iter().map(|at| of(&arms[arm], joint, at[arm])).collect();
        joints.map(column).collect()
    };
    // An arm that measures none leaves the other its own.
    let effort = |s: &JointSamples, joint: usize, row: usize| {
        s.effort_nm.as_ref().map_or(f64::NAN, |columns| columns[joint][row])
    };
    let efforts = arms.iter().any(|s| s.effort_nm.is_some());
    let prefixed = |arm: usize| arms[arm].names.iter().map(move |joint| format!("{}.{joint}", names[arm]));
    Ok(JointSamples {
        time_ns: picked.iter().map(|at| rows.time_ns[at[slower]]).collect(),
        names: prefixed(0).chain(prefixed(1)).collect(),
        joint_rad: columns(&|s, joint, row| s.joint_rad[joint][row]),
        effort_nm: efforts.then(|| columns(&effort)),
    })
}

/// Refuses an arm that is held in one pose throughout: nothing can be learnt of it. `readings` are its own in each dwell.
pub fn check_moves<'o>(
    name: &str,
    readings: impl Iterator<Item = &'o [f64]> + Clone,
    least_rad: f64,
) -> Result<(), Error> {
    let joints = readings.clone().next().map_or(0, <[f64]>::len);
    let range = |joint: usize| {
        let of = readings.clone().map(|q| q[joint]);
        of.clone().fold(f64::NEG_INFINITY, f64::max) - of.fold(f64::INFINITY, f64::min)
    };
    let widest_rad = (0..joints).map(range).fold(0.0, f64::max);
    let dwells = readings.clone().count();
    if dwells < 2 || widest_rad >= least_rad {
        return Ok(());
    }
    let problem = format!(
        "the {name} arm never moves: over {dwells} dwells none of its joints changes by more than {:.3} deg; lead both arms \
         through many poses, or check its topic and joint names",
        widest_rad.to_degrees()
    );
    Err(Error::TwoArms { problem })
}

fn median_period_s(stream: &JointSamples) -> f64 {
    let periods: Vec<f64> = stream.time_ns.windows(2).map(|w| seconds(w[0], w[1])).collect();
    median(&periods)
}

fn seconds(from_ns: i64, to_ns: i64) -> f64 {
    (i128::from(to_ns) - i128::from(from_ns)) as f64 * 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stream(start_ms: i64, period_ms: i64, rows: i64) -> JointSamples {
        let time_ns: Vec<i64> = (0..rows).map(|i| (start_ms + i * period_ms) * 1_000_000).collect();
        let joint_rad = vec![time_ns.iter().map(|t| *t as f64 * 1e-9).collect()];
        JointSamples { time_ns, names: vec!["joint1".into()], joint_rad, effort_nm: None }
    }

    #[test]
    fn the_slower_stream_gives_the_rows_and_the_faster_its_latest_reading() {
        for (arms, slower) in
            [([stream(0, 20, 50), stream(3, 7, 200)], 0), ([stream(3, 7, 200), stream(0, 20, 50)], 1)]
        {
            let joined = join(&arms, ["right", "left"]).expect("they overlap");
            assert_eq!(joined.names, ["right.joint1", "left.joint1"]);
            // The first row of the slower comes before the faster begins.
            assert_eq!(joined.len(), 49);
            for i in 0..joined.len() {
                let now_s = joined.time_ns[i] as f64 * 1e-9;
                let (own, late_s) = (joined.joint_rad[slower][i], now_s - joined.joint_rad[1 - slower][i]);
                assert_eq!(own, now_s);
                assert!((0.0..0.007).contains(&late_s), "{late_s}");
            }
        }
    }

    #[test]
    fn a_gap_of_one_arm_is_a_gap_of_both() {
        let mut gappy = stream(0, 10, 300);
        let keep = |t: &i64| !(1_000_000_000..2_000_000_000).contains(t);
        gappy.joint_rad[0] = gappy.time_ns.iter().filter(|t| keep(t)).map(|t| *t as f64 * 1e-9).collect();
        gappy.time_ns.retain(keep);
        let joined = join(&[stream(0, 10, 300), gappy], ["right", "left"]).expect("they overlap");
        let widest = joined.time_ns.windows(2).map(|w| w[1] - w[0]).max().expect("rows");
        assert!((970_000_000..990_000_000).contains(&widest), "{widest}");
    }

    #[test]
    fn streams_that_do_not_overlap_and_arms_that_do_not_move_are_told_in_words() {
        let apart = [stream(60_000, 10, 100), stream(0, 10, 100)];
        let said = join(&apart, ["right", "left"]).expect_err("apart");
        assert!(said.contains("left ends 59.0 s before right begins"), "{said}");
        let empty = join(&[stream(0, 10, 0), stream(0, 10, 9)], ["right", "left"]).expect_err("empty");
        assert!(empty.contains("no rows"), "{empty}");

        let dwells = [[0.0, 0.5, 0.5], [1.0, 0.5, 0.5]];
        assert!(check_moves("right", dwells.iter().map(|q| &q[..1]), 0.02).is_ok());
        let still = check_moves("left", dwells.iter().map(|q| &q[1..]), 0.02);
        let said = still.expect_err("still").to_string();
        assert!(said.contains("the left arm never moves: over 2 dwells"), "{said}");
    }
}
