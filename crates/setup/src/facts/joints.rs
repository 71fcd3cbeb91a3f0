//! Readings of joints that no encoder gives: stuck, speeds, what was asked for.

use super::{mistake_finding, possible_finding};
use armcal_core::{Code, Dwell, SetupFinding};
use armcal_stages::still::{TURNS_RAD, value_range};
use armcal_stages::{Inputs, RecordingData};

/// Readings that end within this of each other end at one value [rad].
const ONE_END_RAD: f64 = 2e-4;
/// Fewest dwells in a row that make a joint stuck.
const MANY_STILL: usize = 8;
/// A value that so many times as many dwells share as any other is one at which a reading ends.
const CROWD: usize = 4;
/// Share of the dwells that is nearly all of them.
const NEARLY_ALL: f64 = 0.9;
/// Readings nearer to each other than this are one [rad].
const EXACT_RAD: f64 = 1e-9;
/// The steps of an encoder are at most so many times finer than the nearest two readings.
const FINEST: u32 = 12;

/// Joints that read nearly zero most of the time: speeds do, angles do not.
pub fn speed_readings(inputs: &Inputs) -> Option<SetupFinding> {
    let all = !inputs.seen.is_empty() && inputs.seen.iter().all(|s| s.readings.mostly_zero);
    all.then(|| {
        let message = "every joint reads nearly zero most of the time, and not always: these are speeds, or another field than \
                       the angles; mend [streams.joints]";
        mistake_finding(Code::WrongField, "the joints".to_owned(), message.to_owned())
    })
}

/// Readings without any scatter in nearly all dwells, not on the steps of an encoder: what was asked for, not what was read.
pub fn set_points(inputs: &Inputs) -> Option<SetupFinding> {
    let exact: Vec<&Vec<f64>> = inputs.seen.iter().flat_map(|s| &s.readings.exact_rad).collect();
    let dwells = inputs.dwells().count();
    if exact.len() < MANY_STILL || (exact.len() as f64) < NEARLY_ALL * dwells as f64 {
        return None;
    }
    let on_steps = (0..inputs.chain.joint_names().len()).any(|j| {
        let mut read: Vec<f64> = exact.iter().map(|q| q[j]).collect();
        read.sort_by(f64::total_cmp);
        read.dedup_by(|a, b| (*a - *b).abs() < EXACT_RAD);
        read.len() < 2 || steps_of(&read)
    });
    let finding = possible_finding(
        Code::SetpointsRecorded,
        "the joints".to_owned(),
        format!(
            "no joint's reading scatters in {} of {dwells} dwells, nor lies on the steps of an encoder, and the errors are above the \
             floor: these look like set-points, not readings; look at the topic in [streams.joints]",
            exact.len()
        ),
    );
    (!on_steps).then_some(finding)
}

/// Whether sorted readings lie on steps of one size, up to [`FINEST`] times finer than the least distance between two.
fn steps_of(sorted: &[f64]) -> bool {
    let gaps: Vec<f64> = sorted.windows(2).map(|w| w[1] - w[0]).collect();
    let least = gaps.iter().copied().fold(f64::INFINITY, f64::min);
    (1..=FINEST).map(|n| least / f64::from(n)).any(|step| {
        gaps.iter().all(|gap| {
            let steps = gap / step;
            (steps - steps.round()).abs() < 0.05
        })
    })
}

/// Stamps of the joints that no clock gives.
pub fn wrong_stamps(inputs: &Inputs) -> Vec<SetupFinding> {
    let of = |s: &RecordingData| {
        let why = s.readings.stamps.as_ref()?;
        let message = format!("{why}; mend what stamps them, or set `clock = \"log\"` in [streams.joints]");
        Some(mistake_finding(Code::StampsWrong, format!("recording `{}`", s.name), message))
    };
    inputs.seen.iter().filter_map(of).collect()
}

/// Joints whose readings end at one value, again and again, while others turn.
pub fn saturated_readings(inputs: &Inputs) -> Vec<SetupFinding> {
    let read_rad: Vec<&[f64]> = inputs.dwells().map(|d| &d.joint_rad[..]).collect();
    let mut all = Vec::new();
    for (j, name) in inputs.chain.joint_names().iter().enumerate() {
        for (end, sign) in [("lowest", -1.0), ("highest", 1.0)] {
            let Some((n, value_rad)) = at_one_end(&read_rad, j, sign) else { continue };
            all.push(possible_finding(
                Code::JointSaturated,
                format!("joint {} ({name})", j + 1),
                format!(
                    "joint {} ({name}) reads its {end} value, {:.3} deg, in {n} of {} dwells, while others turn, and no other \
                     value nearly as often: its reading may be saturated, clipped at this value; look at its driver and the \
                     range of its encoder",
                    j + 1,
                    value_rad.to_degrees(),
                    read_rad.len()
                ),
            ));
        }
    }
    all
}

/// How many dwells share the value at one end of a joint's range, and that value [rad], where they are many, not one pose,
/// and many times as many as share any other value: poses on a grid share all of them.
fn at_one_end(read_rad: &[&[f64]], joint: usize, sign: f64) -> Option<(usize, f64)> {
    let mut sorted: Vec<f64> = read_rad.iter().map(|q| sign * q[joint]).collect();
    sorted.sort_by(|a, b| b.total_cmp(a));
    let end = *sorted.first()?;
    // They fall: those near a value are between two places.
    let near = |value: f64| {
        let [from, to] = [value + ONE_END_RAD, value - ONE_END_RAD];
        sorted.partition_point(|q| *q > to) - sorted.partition_point(|q| *q >= from)
    };
    let there: Vec<&&[f64]> = read_rad.iter().filter(|q| end - sign * q[joint] < ONE_END_RAD).collect();
    let elsewhere = sorted[there.len()..].iter().map(|q| near(*q)).max()?;
    let first = there.first()?;
    let turned = |q: &&&[f64]| q.iter().zip(first.iter()).any(|(a, b)| (a - b).abs() > TURNS_RAD);
    let many = there.len() >= MANY_STILL.max(read_rad.len() / 5) && there.len() >= CROWD * elsewhere;
    (many && there.iter().any(turned)).then_some((there.len(), sign * end))
}

/// Joints whose readings did not change while others turned. What an encoder reads of a joint that is held jitters as those
/// of other joints do; where none does, a joint that nobody moved reads as one that is stuck.
pub fn stuck_readings(inputs: &Inputs) -> Vec<SetupFinding> {
    let names = inputs.chain.joint_names();
    let others_move =
        (0..names.len()).any(|j| value_range(inputs.dwells().map(|d| d.joint_rad[j])) > TURNS_RAD);
    let mut all = Vec::new();
    for (j, name) in names.iter().enumerate().filter(|_| others_move) {
        let still = inputs.seen.iter().map(|s| (s, longest_still(&s.dwells, j)));
        let Some((recording, still)) = still.max_by_key(|(_, dwells)| dwells.len()) else { continue };
        if still.len() < MANY_STILL.max(recording.dwells.len() / 4) {
            continue;
        }
        let seen = format!(
            "joint {} ({name}) reads the same in {} dwells in a row of `{}` (of {}) while others move",
            j + 1,
            still.len(),
            recording.name,
            recording.dwells.len()
        );
        let subject = format!("joint {} ({name})", j + 1);
        all.push(match still.iter().any(|d| d.joint_spread_rad.iter().any(|s| *s > EXACT_RAD)) {
            true => mistake_finding(
                Code::JointStuck,
                subject,
                format!(
                    "{seen}, without the jitter of their readings: its reading is stuck, or read from the wrong field; mend \
                     the stream of the joints or the driver"
                ),
            ),
            false => possible_finding(
                Code::JointStuck,
                subject,
                format!(
                    "{seen}: it was not moved, or its reading is stuck or read from the wrong field; these readings have no \
                     jitter by which to tell"
                ),
            ),
        });
    }
    all
}

/// The most dwells in a row in which the reading of a joint does not change while another one turns.
fn longest_still(dwells: &[Dwell], joint: usize) -> &[Dwell] {
    let (mut longest, mut from) = (&dwells[..0], 0);
    for i in 1..=dwells.len() {
        let first = &dwells[from];
        let same = |d: &Dwell| {
            (d.joint_rad[joint] - first.joint_rad[joint]).abs() < EXACT_RAD
                && d.joint_spread_rad[joint] < EXACT_RAD
        };
        if dwells.get(i).is_some_and(same) {
            continue;
        }
        let turned =
            |d: &Dwell| d.joint_rad.iter().zip(&first.joint_rad).any(|(a, b)| (a - b).abs() > TURNS_RAD);
        if i - from > longest.len() && dwells[from..i].iter().any(turned) {
            longest = &dwells[from..i];
        }
        from = i;
    }
    longest
}

#[cfg(test)]
mod tests {
    use super::*;
    use armcal_core::{Arrival, DwellId};

    fn dwell(joint_rad: &[f64], spread_rad: f64) -> Dwell {
        Dwell {
            id: DwellId { recording: 0, dwell: 0 },
            start_ns: 0,
            end_ns: 1,
            joint_rad: joint_rad.to_vec(),
            joint_spread_rad: vec![spread_rad; joint_rad.len()],
            joint_sigma_rad: vec![1e-6; joint_rad.len()],
            effort_nm: None,
            samples: 10,
            effective_samples: 10.0,
            arrival: vec![Arrival::Unknown; joint_rad.len()],
            path_memory_rad: Vec::new(),
            pair_memory_rad: Vec::new(),
            moved_rad: None,
            tip: None,
            markers: Default::default(),
            temperature_c: None,
            gauges: Default::default(),
        }
    }

    #[test]
    fn a_joint_is_still_only_while_another_one_turns() {
        let second = |i: u32| if i < 12 { 0.5 } else { 0.7 };
        let turns = |jitter_rad| -> Vec<Dwell> {
            (0..20).map(|i| dwell(&[0.1 * f64::from(i), second(i)], jitter_rad)).collect()
        };
        assert_eq!(longest_still(&turns(0.0), 0).len(), 0, "it turns all the time");
        assert_eq!(longest_still(&turns(0.0), 1).len(), 12);
        assert_eq!(longest_still(&turns(1e-5), 1).len(), 0, "an encoder lives");
        assert_eq!(longest_still(&vec![dwell(&[0.3, 0.5], 0.0); 9], 1).len(), 0, "nothing moved");
    }

    #[test]
    fn a_joint_that_ends_at_one_value_while_others_turn_is_saturated() {
        let clipped: Vec<[f64; 2]> =
            (0..40).map(|i: i32| [0.05 * f64::from(i), (0.7 * f64::from(i)).sin().min(0.4)]).collect();
        let read: Vec<&[f64]> = clipped.iter().map(|q| &q[..]).collect();
        let (n, value) = at_one_end(&read, 1, 1.0).expect("it is clipped");
        assert!(n >= 8 && (value - 0.4).abs() < 1e-12, "{n} {value}");
        assert_eq!(at_one_end(&read, 1, -1.0), None);
        assert_eq!(at_one_end(&read, 0, 1.0), None);
        assert_eq!(at_one_end(&[&[0.3, 0.5][..]; 9], 1, 1.0), None, "nothing moved");
        let grid: Vec<[f64; 2]> =
            (0..60).map(|i: i32| [0.2 * f64::from(i / 3), 0.5 * f64::from(i % 3)]).collect();
        let grid: Vec<&[f64]> = grid.iter().map(|q| &q[..]).collect();
        assert_eq!(at_one_end(&grid, 1, 1.0), None, "poses on a grid share every value");
    }

    #[test]
    fn readings_on_the_steps_of_an_encoder_are_told_from_set_points() {
        let step = 2.0 * std::f64::consts::PI / 8192.0;
        let encoder: Vec<f64> = [3, 17, 20, 220, 911].iter().map(|k| f64::from(*k) * step).collect();
        assert!(steps_of(&encoder));
        assert!(!steps_of(&[0.1, 0.3721, 0.94112, 1.5, 2.7281, 3.3]));
    }
}
