//! A stretch of the recording whose stamps differ from the rest: where, by how much, and what the stamps show there.

use super::fine::{Point, Start};
use super::lags::{self, Lags, Sums};
use super::scale::Scale;
use super::spread::MovementOffset;
use super::stamps::Stamps;
use super::steady::{self, LEAST_MOVEMENTS};
use super::{Estimate, Streams, shift_ns};

/// A change smaller than this is not worth a word [s].
const LEAST_S: f64 = 5e-3;
/// Standard errors of the alignment that the change must be.
const ALIGNMENT_SIGMAS: f64 = 4.0;
/// Rounds in which the change is found again with what is known of it taken out.
const ROUNDS: usize = 3;
/// Share of its best correlation that a stretch with another offset has at most at the offset of all, and the least
/// best one.
const APART_SHARE: f64 = 0.6;
const ALIKE: f64 = 0.8;

/// A stretch of movements that is stamped later or earlier than the rest.
pub(super) struct Jump {
    /// Last sensor time of the movement before the stretch, first one in it [s after the start].
    after_s: f64,
    from_s: f64,
    /// Last sensor time in the stretch and first one after it, where the recording goes on.
    until_s: Option<(f64, f64)>,
    /// Offset in the stretch less that outside, with its standard error [s].
    by_s: f64,
    sigma_s: f64,
}

impl Streams<'_> {
    /// The stretch that differs most from one offset and drift, if any does for certain.
    pub(super) fn jump(&self, scale: &Scale, estimate: &Estimate, offset_sigma_s: f64) -> Option<Jump> {
        let mut points = scale.movements().ok()?;
        let with_drift = self.max_drift() > 0.0;
        let least_s = LEAST_S.max(ALIGNMENT_SIGMAS * offset_sigma_s);
        let fixed = (!with_drift).then_some(0.0);
        let mut start = Start { offset_s: estimate.fine.offset_s, drift: estimate.fine.drift };
        let mut model = estimate.fine.parameters.clone();
        let mut movements = estimate.fine.movements.clone();
        let (mut total_s, mut stretch) = (0.0, None);
        if let Some((from_s, to_s, late_s)) = self.far_stretch(scale, &points, start) {
            shift_points(&mut points, from_s, to_s, late_s);
            total_s = late_s;
            movements = self.again(scale, &points, &mut start, &mut model, fixed)?;
            stretch = Some((from_s, to_s));
        }
        for _ in 0..ROUNDS {
            let found = match stretch {
                None => steady::other_offset(&movements, with_drift, least_s)?,
                Some((from_s, to_s)) => {
                    let (first, end) = movements_between(&movements, from_s, to_s);
                    steady::stretch_offset(&movements, with_drift, first, end)?
                }
            };
            let (from_s, to_s) = (movements[found.first].from_s, movements[found.end - 1].to_s);
            stretch = Some((from_s, to_s));
            total_s += found.by_s;
            shift_points(&mut points, from_s, to_s, found.by_s);
            if found.by_s.abs() < 0.2 * found.sigma_s {
                break;
            }
            movements = self.again(scale, &points, &mut start, &mut model, fixed)?;
        }
        let (from_s, to_s) = stretch?;
        let (first, end) = movements_between(&movements, from_s, to_s);
        let sigma_s = steady::stretch_offset(&movements, with_drift, first, end)?.sigma_s;
        if total_s.abs() < least_s.max(ALIGNMENT_SIGMAS * sigma_s) {
            return None;
        }
        let before = |at: usize| at.checked_sub(1).map_or(0.0, |before| movements[before].to_s);
        let next = movements.get(end);
        Some(match next {
            // A stretch from the beginning on: what comes after it differs.
            Some(next) if first == 0 => {
                Jump { after_s: to_s, from_s: next.from_s, until_s: None, by_s: -total_s, sigma_s }
            }
            _ => {
                let until_s = next.map(|next| (to_s, next.from_s));
                Jump { after_s: before(first), from_s, until_s, by_s: total_s, sigma_s }
            }
        })
    }

    /// What the movements say with the points as they are now stamped.
    fn again(
        &self,
        scale: &Scale,
        points: &[Point],
        start: &mut Start,
        model: &mut Vec<f64>,
        fixed: Option<f64>,
    ) -> Option<Vec<MovementOffset>> {
        let fine = self.finish_with(scale, points, *start, model.clone(), fixed)?;
        model.clone_from(&fine.parameters);
        *start = Start { offset_s: fine.offset_s, drift: fine.drift };
        Some(fine.movements)
    }

    /// A run of movements that resembles the prediction well, but at an offset so far from that of all that its own
    /// slope cannot lead there: first and last sensor time, and how much later it is stamped [s].
    fn far_stretch(&self, scale: &Scale, points: &[Point], start: Start) -> Option<(f64, f64, f64)> {
        let movements: Vec<&[Point]> = points.chunk_by(|a, b| a.movement == b.movement).collect();
        let lags = Lags::within(&scale.sensor, self.config.max_offset_s);
        let robot_s = |t_s: f64| t_s - start.offset_s - start.drift * (t_s - self.reference_s);
        let of = |movement: &&[Point]| {
            let points: Vec<(f64, f64)> = movement.iter().step_by(2).map(|p| (p.t_s, p.measured)).collect();
            (points.len(), lags::sums(&points, &scale.robot, robot_s, lags))
        };
        let sums: Vec<(usize, Vec<Sums>)> = movements.iter().map(of).collect();
        let apart = |window: &[(usize, Vec<Sums>)]| -> Option<f64> {
            let points = window.iter().map(|w| w.0).sum();
            let at = |lag: i64| {
                let mut all = Sums::default();
                window.iter().for_each(|(_, sums)| all.add(&sums[(lag + lags.most) as usize]));
                all.correlation(points)
            };
            let (best, lag) = (-lags.most..=lags.most)
                .map(|lag| (at(lag), lag))
                .filter(|b| b.0.is_finite())
                .max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.abs().cmp(&a.1.abs())))?;
            (best >= ALIKE && at(0) < APART_SHARE * best).then_some(lag as f64 * lags.step_s)
        };
        let late: Vec<Option<f64>> = sums.windows(LEAST_MOVEMENTS).map(apart).collect();
        let mut best: Option<(usize, usize, f64)> = None;
        let mut first = 0;
        while first < late.len() {
            let Some(late_s) = late[first] else {
                first += 1;
                continue;
            };
            let alike = |l: &&Option<f64>| l.is_some_and(|l| (l - late_s).abs() < scale.h_s);
            let run = late[first..].iter().take_while(alike).count();
            // What only a few movements beside it contradict lasts to that end.
            let n = movements.len();
            let end =
                Some(first + run - 1 + LEAST_MOVEMENTS).filter(|end| n - end >= LEAST_MOVEMENTS).unwrap_or(n);
            first = if first < LEAST_MOVEMENTS { 0 } else { first };
            if movements.len() - (end - first) >= LEAST_MOVEMENTS
                && best.is_none_or(|b| end - first > b.1 - b.0)
            {
                best = Some((first, end, late_s));
            }
            first = end - LEAST_MOVEMENTS + 1;
        }
        let (first, end, late_s) = best?;
        let last = movements[end - 1];
        Some((movements[first][0].t_s, last[last.len() - 1].t_s, late_s))
    }

    /// What the data show, and no cause that they do not.
    pub(super) fn jump_in_words(&self, jump: &Jump) -> String {
        let later = if jump.by_s > 0.0 { "later" } else { "earlier" };
        let by = format!("{:.0} ± {:.0} ms {later}", jump.by_s.abs() * 1e3, (jump.sigma_s * 1e3).max(1.0));
        let what = match jump.until_s {
            None => format!(
                "from {:.0} s after the start on, the sensor's stamps are {by} against the robot's than before",
                jump.from_s
            ),
            Some((until_s, _)) => format!(
                "between {:.0} and {until_s:.0} s after the start, the sensor's stamps are {by} against the robot's than \
                 before and after",
                jump.from_s
            ),
        };
        format!("offset and drift do not describe the clocks: {what}; {}", self.seen_there(jump))
    }

    /// What the stamps of either stream show where the offset changes, and what to do.
    fn seen_there(&self, jump: &Jump) -> String {
        let margin_s = self.config.max_offset_s;
        let end_s = jump.until_s.map_or(2.0 * self.reference_s, |until| until.1);
        let at_ns = |s: f64| shift_ns(self.tip.time_ns[0], s);
        let (from_ns, to_ns) = (at_ns(jump.after_s - margin_s), at_ns(end_s + margin_s));
        let robot_ns = |ns: i64| shift_ns(ns, -self.config.initial_offset_s);
        let streams = [
            ("joint", "joints", &self.joints.time_ns, robot_ns(from_ns), robot_ns(to_ns)),
            ("tip", "tip", &self.tip.time_ns, from_ns, to_ns),
        ];
        for (stream, key, time_ns, from_ns, to_ns) in streams {
            if let Some(longest_s) = Stamps::of(time_ns).longest_stall_s(from_ns, to_ns) {
                return format!(
                    "there, rows of the {stream} stream come in bursts after stalls of up to {longest_s:.1} s: their stamps \
                     are those of writing, not of measuring; set streams.{key}.clock = \"header\" if the messages have \
                     stamps of their own, or leave that part out"
                );
            }
        }
        let advice = if jump.until_s.is_some() { "leave that part out" } else { "split the recording there" };
        format!(
            "no rows come in bursts there, so a clock was set or one stream's messages took longer to be stamped: {advice}"
        )
    }
}

fn shift_points(points: &mut [Point], from_s: f64, to_s: f64, late_s: f64) {
    for point in points.iter_mut().filter(|p| (from_s..=to_s).contains(&p.t_s)) {
        point.late_s += late_s;
    }
}

/// The movements within two sensor times.
fn movements_between(movements: &[MovementOffset], from_s: f64, to_s: f64) -> (usize, usize) {
    let first = movements.partition_point(|m| m.from_s < from_s);
    (first, movements.partition_point(|m| m.from_s <= to_s).max(first))
}
