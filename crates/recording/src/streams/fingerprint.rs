//! Whether two recordings hold the same readings, however their files were written.
//!
//! A row of a stream is its stamp and its values. Chunking, compression, the order of messages and cuts leave rows as they
//! are, so the rows are compared, over the time that both recordings have. Of each stream the rows with the smallest
//! hashes are kept (a bottom-k sketch; Broder 1997, "On the resemblance and containment of documents"): the same rows are
//! chosen wherever they occur, and memory does not grow with the recording.

use armcal_core::{JointSamples, PoseSamples, Samples, hash_of};
use std::ops::RangeInclusive;

/// Rows kept of a stream, at most: 64 KiB, and forty rows of an overlap of a hundredth.
const KEPT: usize = 4096;
/// Fewer common rows are no evidence: an overlap of a few samples.
const LEAST_ROWS: usize = 8;

/// What two recordings with the same readings have in common.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fingerprint {
    joints: Sketch,
    tip: Option<Sketch>,
}

/// A time that two recordings share.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SharedTime {
    /// Its beginning [ns], robot clock.
    pub start_ns: i64,
    /// Its end [ns].
    pub end_ns: i64,
}

impl SharedTime {
    /// How long it is [s].
    pub fn duration_s(&self) -> f64 {
        self.end_ns.saturating_sub(self.start_ns) as f64 * 1e-9
    }
}

impl Fingerprint {
    /// Of the streams a pipeline reads; linear in their rows.
    pub fn of(samples: &Samples) -> Fingerprint {
        Fingerprint {
            joints: Sketch::of_joints(&samples.joints),
            tip: samples.tip.as_ref().map(Sketch::of_poses),
        }
    }

    /// The time over which both hold the same joint readings, where they do: at least half of the moving rows of the
    /// sparser one are in the other too, so that dropped messages hide nothing. Where both have a tip, it must be the same
    /// tip: another marker on the same arm is other evidence.
    ///
    /// Recordings of different times share nothing.
    pub fn shared(&self, other: &Fingerprint) -> Option<SharedTime> {
        let shared = self.joints.compared(&other.joints)?.shared()?;
        let tips = self.tip.as_ref().zip(other.tip.as_ref()).and_then(|(a, b)| a.compared(b));
        match tips {
            Some(tips) if tips.enough() => tips.shared().map(|_| shared),
            _ => Some(shared),
        }
    }
}

/// Some rows of a stream, chosen by what they hold.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Sketch {
    /// Hash and time of each, by hash.
    rows: Vec<(u64, i64)>,
    /// Every row with a smaller hash is among `rows`.
    below: u64,
    /// First and last row of the stream [ns].
    span_ns: Option<[i64; 2]>,
}

impl Sketch {
    fn of_joints(joints: &JointSamples) -> Sketch {
        let value = |i: usize, j: usize| joints.joint_rad[j][i];
        Sketch::of(&joints.time_ns, joints.joint_rad.len(), value)
    }

    fn of_poses(poses: &PoseSamples) -> Sketch {
        Sketch::of(&poses.time_ns, 3, |i, axis| poses.position_m[i][axis])
    }

    /// Rows equal to the one before are left out, unless there are no others: an arm that stands still in a noiseless
    /// recording looks like any other.
    fn of(time_ns: &[i64], columns: usize, value: impl Fn(usize, usize) -> f64) -> Sketch {
        let moves = |i: &usize| (0..columns).any(|k| value(*i, k) != value(*i - 1, k));
        let moving = Sketch::over((1..time_ns.len()).filter(moves), time_ns, columns, &value);
        if moving.rows.len() >= LEAST_ROWS {
            return moving;
        }
        Sketch::over(0..time_ns.len(), time_ns, columns, &value)
    }

    /// Of these rows, those with the smallest hashes.
    fn over(
        rows: impl Iterator<Item = usize>,
        time_ns: &[i64],
        columns: usize,
        value: &impl Fn(usize, usize) -> f64,
    ) -> Sketch {
        let mut smallest: Vec<(u64, i64)> = Vec::with_capacity(2 * KEPT);
        let mut below = u64::MAX;
        let cut = |smallest: &mut Vec<(u64, i64)>, below: &mut u64| {
            if smallest.len() > KEPT {
                *below = smallest.select_nth_unstable(KEPT).1.0;
                smallest.truncate(KEPT);
            }
        };
        for i in rows {
            let hash = hash_of(time_ns[i], (0..columns).map(|k| value(i, k)));
            if hash < below {
                smallest.push((hash, time_ns[i]));
            }
            if smallest.len() == 2 * KEPT {
                cut(&mut smallest, &mut below);
            }
        }
        cut(&mut smallest, &mut below);
        smallest.sort_unstable();
        let span_ns = time_ns.first().zip(time_ns.last()).map(|(first, last)| [*first, *last]);
        Sketch { rows: smallest, below, span_ns }
    }

    /// Both over the time that both have; `None` where there is none.
    fn compared(&self, other: &Sketch) -> Option<Overlap> {
        let ([a, b], below) = ([self.span_ns?, other.span_ns?], self.below.min(other.below));
        let window = a[0].max(b[0])..=a[1].min(b[1]);
        let inside = |sketch: &Sketch| {
            let known = sketch.rows.iter().filter(|(hash, _)| *hash < below);
            known.filter(|(_, time_ns)| window.contains(time_ns)).copied().collect::<Vec<_>>()
        };
        let (mut fewer, mut more) = (inside(self), inside(other));
        if fewer.len() > more.len() {
            std::mem::swap(&mut fewer, &mut more);
        }
        let (common, alone): (Vec<_>, Vec<_>) =
            fewer.into_iter().partition(|row| more.binary_search(row).is_ok());
        (!window.is_empty()).then(|| Overlap {
            window,
            common: sorted_times(&common),
            alone: sorted_times(&alone),
        })
    }
}

/// Two sketches over the time that both have.
struct Overlap {
    /// That time [ns].
    window: RangeInclusive<i64>,
    /// Times of the rows in both, in rising order [ns].
    common: Vec<i64>,
    /// Times of the rows that only the one with fewer rows has, in rising order [ns].
    alone: Vec<i64>,
}

fn sorted_times(rows: &[(u64, i64)]) -> Vec<i64> {
    let mut times: Vec<i64> = rows.iter().map(|(_, time_ns)| *time_ns).collect();
    times.sort_unstable();
    times
}

impl Overlap {
    fn enough(&self) -> bool {
        self.common.len() + self.alone.len() >= LEAST_ROWS
    }

    /// From the first to the last common row, and on to the ends of the time that both have where nothing contradicts.
    fn shared(&self) -> Option<SharedTime> {
        let alike = self.common.len() >= LEAST_ROWS && self.common.len() >= self.alone.len();
        let (first, last) = (*self.common.first()?, *self.common.last()?);
        let to_start = self.alone.first().is_none_or(|alone| *alone > first);
        let to_end = self.alone.last().is_none_or(|alone| *alone < last);
        alike.then_some(SharedTime {
            start_ns: if to_start { *self.window.start() } else { first },
            end_ns: if to_end { *self.window.end() } else { last },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use proptest::prelude::*;

    const STEP_NS: i64 = 10_000_000;

    /// Rows `from..to` of an arm that moves as `phase` says; stamps count from the same zero.
    fn samples(rows: std::ops::Range<i64>, phase: f64) -> Samples {
        let time_ns: Vec<i64> = rows.clone().map(|i| i * STEP_NS).collect();
        let joint = |k: f64| rows.clone().map(|i| (i as f64 * 0.013 * k + phase).sin()).collect::<Vec<f64>>();
        let joint_rad = vec![joint(1.0), joint(1.7)];
        let position_m = rows.clone().map(|i| Vector3::new((i as f64 * 0.01).cos(), phase, 0.0)).collect();
        let tip = PoseSamples { time_ns: time_ns.clone(), position_m, ..PoseSamples::default() };
        let joints = JointSamples { time_ns, joint_rad, ..JointSamples::default() };
        Samples { joints, tip: Some(tip), ..Samples::default() }
    }

    /// What is left of samples when only these rows of every stream are kept.
    fn kept(samples: &Samples, keep: impl Fn(usize) -> bool) -> Samples {
        fn pick<T: Clone>(all: &[T], keep: &impl Fn(usize) -> bool) -> Vec<T> {
            all.iter().enumerate().filter(|(i, _)| keep(*i)).map(|(_, x)| x.clone()).collect()
        }
        let joints = JointSamples {
            time_ns: pick(&samples.joints.time_ns, &keep),
            joint_rad: samples.joints.joint_rad.iter().map(|column| pick(column, &keep)).collect(),
            ..JointSamples::default()
        };
        let tip = samples.tip.as_ref().map(|tip| PoseSamples {
            time_ns: pick(&tip.time_ns, &keep),
            position_m: pick(&tip.position_m, &keep),
            ..PoseSamples::default()
        });
        Samples { joints, tip, ..Samples::default() }
    }

    fn shared(a: &Samples, b: &Samples) -> Option<SharedTime> {
        let (a, b) = (Fingerprint::of(a), Fingerprint::of(b));
        assert_eq!(a.shared(&b), b.shared(&a));
        a.shared(&b)
    }

    #[test]
    fn the_last_third_of_one_that_is_the_first_of_another_is_found() {
        let (a, b) = (samples(0..30_000, 0.2), samples(20_000..50_000, 0.2));
        let found = shared(&a, &b).expect("10 000 rows in common");
        assert_eq!(found, SharedTime { start_ns: 20_000 * STEP_NS, end_ns: 29_999 * STEP_NS });
    }

    #[test]
    fn the_same_motion_at_another_time_is_another_recording() {
        let a = samples(0..5000, 0.2);
        let mut later = a.clone();
        later.joints.time_ns.iter_mut().for_each(|t| *t += 5000 * STEP_NS);
        assert_eq!(shared(&a, &later), None);
        // Even where the times overlap, a shift by half a row leaves no row in common.
        let mut shifted = a.clone();
        shifted.joints.time_ns.iter_mut().for_each(|t| *t += STEP_NS / 2);
        assert_eq!(shared(&a, &shifted), None);
    }

    #[test]
    fn another_motion_at_the_same_stamps_is_another_recording() {
        assert_eq!(shared(&samples(0..5000, 0.2), &samples(0..5000, 0.3)), None);
        // A simulator that starts anew: the same first second, then another motion.
        let mut a = samples(0..5000, 0.2);
        let b = samples(0..5000, 0.3);
        for (of_a, of_b) in a.joints.joint_rad.iter_mut().zip(&b.joints.joint_rad) {
            of_a[..100].copy_from_slice(&of_b[..100]);
        }
        assert_eq!(shared(&a, &b), None);
    }

    #[test]
    fn an_arm_that_stands_still_at_first_shares_no_more_than_that() {
        let at_rest_until = |phase: f64, row: usize| {
            let mut of = samples(0..2000, phase);
            of.joints.joint_rad.iter_mut().for_each(|column| column[..row].fill(0.5));
            Samples { tip: None, ..of }
        };
        assert_eq!(shared(&at_rest_until(0.1, 1500), &at_rest_until(0.4, 1500)), None);
        // Of one that never moves, a copy is still a copy.
        assert!(shared(&at_rest_until(0.1, 2000), &at_rest_until(0.4, 2000)).is_some());
    }

    #[test]
    fn another_marker_on_the_same_arm_is_other_evidence() {
        let a = samples(0..5000, 0.2);
        let mut b = a.clone();
        if let Some(tip) = &mut b.tip {
            tip.position_m.iter_mut().for_each(|p| p.x += 0.05);
        }
        assert_eq!(shared(&a, &b), None);
        b.tip = None;
        assert!(shared(&a, &b).is_some());
    }

    proptest! {
        /// Whatever part of the messages is lost at random, what is left is the same recording.
        #[test]
        fn lost_messages_hide_no_copy(seed in 0_u64..1000, lost in 0.0..0.9_f64, rows in 500_i64..20_000) {
            let whole = samples(0..rows, 0.1);
            let mix = |seed: u64| hash_of(seed.cast_signed(), std::iter::empty());
            let survives = |i: usize| (mix(seed ^ mix(i as u64)) >> 11) as f64 / (1_u64 << 53) as f64 > lost;
            let copy = kept(&whole, survives);
            prop_assert!(shared(&whole, &copy).is_some());
        }
    }
}
