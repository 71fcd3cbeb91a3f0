//! The rows that clocks are aligned by: all of a recording of some minutes, pieces of a longer one, spread over it.
//!
//! Offset and drift are as certain as the nominal model lets them be long before hours of motion are used up, so the cost
//! need not grow with the recording. Each piece is where the tip moves most of its share of the recording, and there are
//! as many as movements are told apart ([`super::scale`]): a clock that was set is found as exactly as in all rows.

use armcal_core::robust::percentile;
use armcal_core::{JointSamples, PoseSamples};
use std::ops::Range;

use super::shift_ns;
use crate::ClockConfig;
use crate::series::seconds_between;

/// Pieces of a long recording.
const PIECES: usize = 50;

/// Length of a piece, and what is looked at beside it for the longest kernel, in half-widths of the shortest one.
const PIECE_WIDTHS: f64 = 50.0;
const BESIDE_WIDTHS: f64 = 12.0;

/// Rows of the joint stream per half-width of the shortest kernel: more tell nothing more.
const JOINT_ROWS: f64 = 15.0;

/// Steps between rows that a stream's period is told from, at most.
const MOST_STEPS: usize = 4000;

/// Share of its fast end above which the tip moves; it is asked once per half-width. Before and after what moves a piece goes
/// on for so many more of these: the sharper two kernels reach three.
const MOVING_SHARE: f64 = 0.15;
const AT_REST: usize = 4;

/// Share of the tip's time that the joints' has to cover.
const SHARED: f64 = 0.5;

/// Rows of both streams.
pub(super) struct Excerpt {
    pub tip: Vec<Range<usize>>,
    pub joints: Vec<usize>,
}

impl Excerpt {
    pub fn of(joints: &JointSamples, tip: &PoseSamples, config: &ClockConfig) -> Excerpt {
        let period_s = period_s(&tip.time_ns);
        let joint_period_s = self::period_s(&joints.time_ns);
        let h_s = (0.5 * config.smoothing_s).max(2.0 * period_s).max(2.0 * joint_period_s);
        let piece = ((PIECE_WIDTHS * h_s / period_s).ceil() as usize).max(1);
        let whole = tip.len() <= PIECES.saturating_mul(piece);
        let pieces = if whole {
            std::iter::once(0..tip.len()).collect()
        } else {
            moving_pieces(tip, piece, h_s / period_s)
        };
        let time_s = |row: usize| seconds_between(tip.time_ns[0], tip.time_ns[row]);
        let span_s = time_s(tip.len() - 1);
        let within = |rows: &Range<usize>| {
            let [from_s, to_s] = [time_s(rows.start), time_s(rows.end - 1)];
            let from_middle_s = (from_s - 0.5 * span_s).abs().max((to_s - 0.5 * span_s).abs());
            let drifted_s = 1e-6 * config.max_drift_ppm * from_middle_s;
            let beside_s = config.max_offset_s + drifted_s + BESIDE_WIDTHS * h_s;
            let robot_ns = |tip_ns: i64, by_s: f64| shift_ns(tip_ns, by_s - config.initial_offset_s);
            (robot_ns(tip.time_ns[rows.start], -beside_s), robot_ns(tip.time_ns[rows.end - 1], beside_s))
        };
        let mut wanted: Vec<(i64, i64)> = pieces.iter().map(within).collect();
        let (first_ns, last_ns) = (joints.time_ns[0], joints.time_ns[joints.len() - 1]);
        let (from_ns, to_ns) = within(&(0..tip.len()));
        if seconds_between(from_ns.max(first_ns), to_ns.min(last_ns)) < SHARED * span_s {
            // Streams that cannot be aligned: all of them says why.
            wanted = vec![(first_ns, last_ns)];
        }
        let mut kept = Vec::new();
        for (from_ns, to_ns) in wanted {
            let from = joints.time_ns.partition_point(|t| *t < from_ns);
            add_spaced_rows(&joints.time_ns, from, to_ns, h_s / JOINT_ROWS, &mut kept);
        }
        Excerpt { tip: pieces, joints: kept }
    }
}

/// Typical time between rows [s], told from steps all over the stream.
fn period_s(time_ns: &[i64]) -> f64 {
    let every = (time_ns.len() / MOST_STEPS).max(1);
    let steps = time_ns.windows(2).step_by(every).map(|w| seconds_between(w[0], w[1]));
    percentile(&steps.collect::<Vec<_>>(), 0.9)
}

/// Of each of as many equal parts of the rows the piece in which the tip moves longest; the first of those, and up to where
/// the tip rests.
fn moving_pieces(tip: &PoseSamples, piece: usize, asked: f64) -> Vec<Range<usize>> {
    let every = (asked.round() as usize).clamp(1, piece);
    let rows: Vec<usize> = (0..tip.len()).step_by(every).collect();
    let speed_m_s = |w: &[usize]| {
        let by_m = (tip.position_m[w[1]] - tip.position_m[w[0]]).norm();
        by_m / seconds_between(tip.time_ns[w[0]], tip.time_ns[w[1]])
    };
    let speeds_m_s: Vec<f64> = rows.windows(2).map(speed_m_s).collect();
    let above_m_s = MOVING_SHARE * percentile(&speeds_m_s, 0.99);
    let moves: Vec<bool> = speeds_m_s.iter().map(|speed| *speed > above_m_s).collect();
    let (part, width) = (moves.len() / PIECES, piece / every);
    let longest = |k: usize| {
        let part = &moves[k * part..(k + 1) * part];
        let width = width.clamp(1, part.len());
        let moving = |window: &[bool]| window.iter().filter(|moves| **moves).count();
        let windows = part.windows(width).map(moving).enumerate();
        let first = windows.max_by_key(|b| (b.1, std::cmp::Reverse(b.0))).map_or(0, |b| b.0);
        // From rest to rest, where there is any: a move of which a kernel misses an end tells another time than a whole one.
        let rests = |at: &usize| !part[*at];
        let from = (first.saturating_sub(width)..=first).rev().find(rests).unwrap_or(first);
        let last = first + width - 1;
        let to = (last..(last + width).min(part.len())).find(rests).unwrap_or(last);
        let (from, to) = (from.saturating_sub(AT_REST), (to + AT_REST).min(part.len() - 1));
        let start = k * part.len();
        (start + from) * every..((start + to + 1) * every + 1).min(tip.len())
    };
    (0..PIECES).map(longest).collect()
}

/// Adds the rows from one on up to a time that are at least so far apart, and behind those that are there already. A row before
/// a step that long is kept: a break is then no longer than it was.
fn add_spaced_rows(time_ns: &[i64], from: usize, to_ns: i64, apart_s: f64, kept: &mut Vec<usize>) {
    let from = kept.last().map_or(from, |last| from.max(last + 1));
    for row in from..time_ns.len() {
        if time_ns[row] > to_ns {
            break;
        }
        let apart = |from: usize, to: usize| seconds_between(time_ns[from], time_ns[to]) >= apart_s;
        if kept.last().is_none_or(|last| apart(*last, row))
            || (row + 1 == time_ns.len() || apart(row, row + 1))
        {
            kept.push(row);
        }
    }
}
