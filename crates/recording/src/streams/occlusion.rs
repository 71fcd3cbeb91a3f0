//! Which pose rows the sensor did not really see.
//!
//! Four signs, in this order; a row counts under the first that applies.
//! 1. *flagged*: the message says so.
//! 2. *zero*: a translation of exactly (0, 0, 0), what the Vicon SDK returns for an occluded body. A stream that is
//!    zero throughout is a body at the origin, not an occluded one, and is kept.
//! 3. *non-unit quaternion*: its norm is more than 1 % from one. Where every row is like that, the stream has no
//!    orientation, and its positions are kept.
//! 4. *frozen*: the whole pose repeated bit for bit. The first row of a run was measured and is kept, the repeats are
//!    rejected, if the run is at least [`FROZEN_ROWS`] long, four times as long as nineteen in twenty runs of the
//!    stream (a sensor republished at a higher rate repeats everything), and the stream jitters: among three
//!    distinct rows, it turns back more often than [`REVERSAL_SHARE`]. A noise-free stream (a simulation) turns back
//!    only where the motion does; its rest is not occlusion. A stream that is constant throughout is one run, and kept.

use crate::Occlusion;
use crate::decode::PoseRow;
use crate::streams::clean::Kept;
use armcal_core::robust::percentile;

/// Shortest run of equal poses that can be frozen.
pub(crate) const FROZEN_ROWS: usize = 5;
/// Largest share of direction reversals a noise-free motion shows.
const REVERSAL_SHARE: f64 = 0.05;
/// Largest deviation of a quaternion's norm from one.
const NORM_TOLERANCE: f64 = 0.01;

/// One pose as the message has it, position in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Seen {
    pub position_m: [f64; 3],
    pub quaternion_xyzw: Option<[f64; 4]>,
    pub flagged: bool,
}

impl Seen {
    /// Of a row with `to_m` metres in its unit.
    pub fn of(row: &PoseRow<'_>, to_m: f64) -> Seen {
        Seen {
            position_m: row.position.map(|x| x * to_m),
            quaternion_xyzw: row.quaternion_xyzw,
            flagged: row.occluded,
        }
    }

    fn is_zero(&self) -> bool {
        self.position_m == [0.0; 3]
    }

    pub fn has_unit_quaternion(&self) -> bool {
        self.quaternion_xyzw.is_some_and(|q| (norm(&q) - 1.0).abs() <= NORM_TOLERANCE)
    }
}

/// What was judged about a stream.
#[derive(Debug, PartialEq)]
pub(crate) struct Verdict {
    /// Rejected rows, by reason.
    pub occluded: Occlusion,
    /// Whether the orientations are usable.
    pub oriented: bool,
}

/// Removes from rows of `seen` what was not seen. `frozen` rows are judged by [`reject_frozen`], after duplicates are gone.
pub(crate) fn reject_unseen(rows: &mut Kept, seen: &[Seen]) -> Verdict {
    let flagged = rows.drop_where(|_, i| seen[i].flagged);
    let mut occluded = Occlusion { flagged, ..Occlusion::default() };
    if !rows.file_rows().all(|i| seen[i].is_zero()) {
        occluded.zero = rows.drop_where(|_, i| seen[i].is_zero());
    }
    let with_quaternion = rows.file_rows().filter(|i| seen[*i].quaternion_xyzw.is_some()).count();
    let oriented = rows.file_rows().any(|i| seen[i].has_unit_quaternion());
    if oriented && with_quaternion == rows.len() {
        occluded.non_unit_quaternion = rows.drop_where(|_, i| !seen[i].has_unit_quaternion());
    }
    Verdict {
        occluded,
        oriented: oriented && with_quaternion == rows.len() + occluded.non_unit_quaternion as usize,
    }
}

/// Removes the repeats of frozen poses and returns how many they were.
pub(crate) fn reject_frozen(rows: &mut Kept, seen: &[Seen]) -> u64 {
    let poses: Vec<&Seen> = rows.file_rows().map(|i| &seen[i]).collect();
    let runs: Vec<usize> = poses.chunk_by(|a, b| same_bits(a, b)).map(<[_]>::len).collect();
    let lengths: Vec<f64> = runs.iter().map(|n| *n as f64).collect();
    let usual = percentile(&lengths, 0.95);
    if reversal_share(&poses, &runs) <= REVERSAL_SHARE {
        return 0;
    }
    let frozen = |length: usize| length >= FROZEN_ROWS && length as f64 > 4.0 * usual;
    let keep: Vec<bool> =
        runs.iter().flat_map(|&length| (0..length).map(move |k| k == 0 || !frozen(length))).collect();
    let mut keep = keep.into_iter();
    rows.drop_where(|_, _| !keep.next().unwrap_or(true))
}

/// Share of turns back among consecutive triples of runs: about 2/3 for a resting sensor's noise, 0 for smooth motion.
fn reversal_share(poses: &[&Seen], runs: &[usize]) -> f64 {
    let mut starts = Vec::with_capacity(runs.len());
    let mut at = 0;
    for length in runs {
        starts.push(poses[at].position_m);
        at += length;
    }
    let turns_back =
        |w: &&[[f64; 3]]| (0..3).map(|k| (w[1][k] - w[0][k]) * (w[2][k] - w[1][k])).sum::<f64>() < 0.0;
    let triples = starts.len().saturating_sub(2).max(1);
    starts.windows(3).filter(turns_back).count() as f64 / triples as f64
}

fn same_bits(a: &Seen, b: &Seen) -> bool {
    let bits = |q: Option<[f64; 4]>| q.map(|q| q.map(f64::to_bits));
    a.position_m.map(f64::to_bits) == b.position_m.map(f64::to_bits)
        && bits(a.quaternion_xyzw) == bits(b.quaternion_xyzw)
}

fn norm(q: &[f64; 4]) -> f64 {
    q.iter().map(|x| x * x).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::streams::clean::in_time_order;

    /// Rest, a smooth move, rest; `noise` in metres from a small generator.
    fn stream(noise: f64) -> Vec<Seen> {
        let mut state = 1_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / (1_u64 << 30) as f64 - 1.0
        };
        let at = |i: usize| (i as f64 - 300.0).clamp(0.0, 200.0) / 200.0;
        (0..800)
            .map(|i| Seen {
                position_m: [1.0 + at(i) + noise * random(), 2.0 + noise * random(), 0.5 + noise * random()],
                quaternion_xyzw: Some([0.0, 0.0, 0.0, 1.0]),
                flagged: false,
            })
            .collect()
    }

    fn rows(seen: &[Seen]) -> Kept {
        let time: Vec<Option<i64>> = (0..seen.len()).map(|i| Some(i as i64)).collect();
        in_time_order(&time, |_| true).0
    }

    #[test]
    fn each_sign_is_counted_once() {
        let mut seen = stream(1e-4);
        seen[3].position_m = [0.0; 3];
        seen[4] = Seen { position_m: [0.0; 3], flagged: true, ..seen[4] };
        seen[5].quaternion_xyzw = Some([0.0; 4]);
        for i in 100..120 {
            seen[i] = seen[99];
        }
        let mut rows = rows(&seen);
        let mut verdict = reject_unseen(&mut rows, &seen);
        verdict.occluded.frozen = reject_frozen(&mut rows, &seen);
        assert!(verdict.oriented);
        assert_eq!(verdict.occluded, Occlusion { zero: 1, frozen: 20, non_unit_quaternion: 1, flagged: 1 });
        assert_eq!(rows.len(), 800 - 23);
        assert!(rows.file_rows().any(|i| i == 99), "the first of the run was measured");
    }

    #[test]
    fn rest_without_noise_and_constant_streams_are_kept() {
        let noise_free = stream(0.0);
        assert_eq!(reject_frozen(&mut rows(&noise_free), &noise_free), 0);
        let constant = vec![noise_free[0]; 500];
        assert_eq!(reject_frozen(&mut rows(&constant), &constant), 0);
        let origin = vec![Seen { position_m: [0.0; 3], ..noise_free[0] }; 50];
        assert_eq!(reject_unseen(&mut rows(&origin), &origin).occluded.total(), 0);
    }

    #[test]
    fn a_sensor_republished_faster_is_not_frozen() {
        let held: Vec<Seen> = stream(1e-4).into_iter().flat_map(|s| [s; 6]).collect();
        assert_eq!(reject_frozen(&mut rows(&held), &held), 0);
    }

    #[test]
    fn a_stream_without_any_orientation_keeps_its_positions() {
        let blank: Vec<Seen> =
            stream(1e-4).into_iter().map(|s| Seen { quaternion_xyzw: Some([0.0; 4]), ..s }).collect();
        let mut all = rows(&blank);
        let verdict = reject_unseen(&mut all, &blank);
        assert!(!verdict.oriented && verdict.occluded.total() == 0 && all.len() == 800);
    }
}
