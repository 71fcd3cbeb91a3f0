//! From levels of motion to pauses: runs of still rows, their edges settled, near neighbours merged.

use armcal_core::robust::median;
use armcal_core::{JointSamples, PoseSamples};
use nalgebra::Vector3;
use std::collections::BTreeMap;
use std::ops::Range;

use crate::creep;
use crate::series::{breaking_gap_s, median_period_s, seconds_between, typical_period_s, unbroken_runs};
use crate::stats::quantisation_step;
use crate::stillness::{Channel, channels_of_columns, hysteresis};
use crate::{ClockAlignment, DwellConfig};

/// The encoder stream with everything that decides what is still in it.
pub(crate) struct Encoders<'a> {
    pub joints: &'a JointSamples,
    /// Rows without a gap or a NaN between them.
    pub stretches: Vec<Range<usize>>,
    /// Step of each quantised encoder [rad]; 0 where the readings are continuous.
    pub step_rad: Vec<f64>,
    /// Spread that still counts as rest when a dwell begins, per joint [rad].
    pub enter_rad: Vec<f64>,
    /// Distance of a local mean from the pose at rest that is noise, per joint [rad].
    settled_rad: Vec<f64>,
    channels: Vec<Channel>,
}

/// The tip stream on the robot's clock.
pub(crate) struct Tip<'a> {
    pub samples: &'a PoseSamples,
    /// Time of each row on the robot's clock [ns].
    pub robot_ns: Vec<i64>,
    /// Spread of each row over what counts as rest.
    level: Vec<f64>,
    /// Distance of a local mean from the position at rest that is noise [m].
    settled_m: f64,
    /// Nearest tip row of each joint row, where there is one.
    nearest: Vec<Option<usize>>,
}

/// Pauses of one recording, and what was seen on the way.
#[derive(Debug, Default)]
pub(crate) struct Pauses {
    /// Rows of each pause, in order of time.
    pub rows: Vec<Range<usize>>,
    /// How far each joint crept while the arm rested, of the pauses in which one did [rad].
    pub crept_rad: BTreeMap<usize, Vec<f64>>,
    /// Durations of still runs shorter than the minimum [s].
    pub too_short_s: Vec<f64>,
}

impl<'a> Encoders<'a> {
    pub(crate) fn of(joints: &'a JointSamples, config: &DwellConfig) -> Encoders<'a> {
        let time_ns = &joints.time_ns;
        let finite = |i: usize| joints.joint_rad.iter().all(|column| column[i].is_finite());
        let stretches =
            unbroken_runs(time_ns, breaking_gap_s(config.max_gap_s, typical_period_s(time_ns)), finite);
        let step_rad: Vec<f64> =
            joints.joint_rad.iter().map(|c| quantisation_step(c).unwrap_or(0.0)).collect();
        let floor_rad = config.joint_floor_deg.to_radians();
        // A reading that flickers evenly between two counts spreads by half a count, by 0.58 in a window of 4.
        let floors: Vec<f64> = step_rad.iter().map(|step| floor_rad.max(0.75 * step)).collect();
        let window_s = window_s(config, time_ns);
        let channels = channels_of_columns(time_ns, &joints.joint_rad, &stretches, window_s, &floors);
        let over = |factor: f64| -> Vec<f64> {
            channels.iter().zip(&floors).map(|(c, floor)| (factor * c.noise).max(*floor)).collect()
        };
        let enter_rad = over(config.enter_factor);
        let settled_rad =
            over(config.settle_factor).iter().zip(&step_rad).map(|(s, step)| s.max(*step)).collect();
        Encoders { joints, stretches, step_rad, enter_rad, settled_rad, channels }
    }

    /// Largest spread of any joint at a row over what counts as rest.
    fn level(&self, row: usize) -> f64 {
        self.channels.iter().zip(&self.enter_rad).map(|(c, enter)| c.spread[row] / enter).fold(0.0, f64::max)
    }
}

impl<'a> Tip<'a> {
    pub(crate) fn of(
        samples: &'a PoseSamples,
        clock: Option<&ClockAlignment>,
        joint_ns: &[i64],
        config: &DwellConfig,
    ) -> Tip<'a> {
        let robot_ns: Vec<i64> =
            samples.time_ns.iter().map(|&t| clock.map_or(t, |c| c.to_robot_ns(t))).collect();
        let gap_s = breaking_gap_s(config.max_gap_s, typical_period_s(&robot_ns));
        let stretches =
            unbroken_runs(&robot_ns, gap_s, |i| samples.position_m[i].iter().all(|v| v.is_finite()));
        let columns: Vec<Vec<f64>> =
            (0..3).map(|axis| samples.position_m.iter().map(|p| p[axis]).collect()).collect();
        let floor_m = config.tip_floor_mm * 1e-3;
        let axes =
            channels_of_columns(&robot_ns, &columns, &stretches, window_s(config, &robot_ns), &[floor_m; 3]);
        let rms =
            |of: &dyn Fn(&Channel) -> f64| (axes.iter().map(|a| of(a).powi(2)).sum::<f64>() / 3.0).sqrt();
        let noise_m = rms(&|a| a.noise);
        let enter_m = (config.enter_factor * noise_m).max(floor_m);
        let level = (0..samples.len()).map(|i| rms(&|a| a.spread[i]) / enter_m).collect();
        let settled_m = 3f64.sqrt() * (config.settle_factor * noise_m).max(floor_m);
        let reach_s = median_period_s(&robot_ns).max(median_period_s(joint_ns)) * 1.5;
        Tip { samples, nearest: nearest_rows(joint_ns, &robot_ns, reach_s), robot_ns, level, settled_m }
    }

    /// Level of motion at a joint row; none where the tip was not seen.
    fn level(&self, joint_row: usize) -> Option<f64> {
        self.nearest[joint_row].map(|i| self.level[i]).filter(|l| l.is_finite())
    }

    fn position_m(&self, joint_row: usize) -> Option<Vector3<f64>> {
        let position = self.samples.position_m[self.nearest[joint_row]?];
        position.iter().all(|v| v.is_finite()).then_some(position)
    }
}

/// Finds the pauses.
pub(crate) fn find_pauses(encoders: &Encoders, tip: Option<&Tip>, config: &DwellConfig) -> Pauses {
    let level: Vec<f64> = (0..encoders.joints.len())
        .map(|i| encoders.level(i).max(tip.and_then(|t| t.level(i)).unwrap_or(0.0)))
        .collect();
    let leave = config.leave_factor / config.enter_factor;
    let rest = Rest { encoders, tip, edge_s: window_s(config, &encoders.joints.time_ns) };
    let time_ns = &encoders.joints.time_ns;
    let mut found = Pauses::default();
    for stretch in &encoders.stretches {
        let mut settled: Vec<Still> = Vec::new();
        for run in hysteresis(&level, stretch.clone(), 1.0, leave) {
            for still in rest.stills(&run, config) {
                let free = settled.last().map_or(stretch.start, |last| last.rows.end)..stretch.end;
                let crept_rad = still.crept_rad;
                let rows = if crept_rad.is_some() { Some(still.rows) } else { rest.settle(still.rows, free) };
                let Some(rows) = rows else { continue };
                match settled.last_mut() {
                    Some(last)
                        if last.crept_rad.is_none()
                            && crept_rad.is_none()
                            && seconds_between(time_ns[last.rows.end - 1], time_ns[rows.start])
                                <= config.merge_gap_s
                            && rest.same_pose(&last.rows, &rows) =>
                    {
                        last.rows.end = rows.end;
                    }
                    _ => settled.push(Still { rows, crept_rad }),
                }
            }
        }
        for Still { rows: run, crept_rad } in settled {
            let duration_s = seconds_between(time_ns[run.start], time_ns[run.end - 1]);
            if duration_s + 1e-9 < config.min_duration_s {
                found.too_short_s.push(duration_s);
            } else {
                found.crept_rad.extend(crept_rad.map(|crept| (found.rows.len(), crept)));
                found.rows.push(trim_ends(time_ns, run, stretch, config.trim_s));
            }
        }
    }
    found
}

/// Rows in which the arm rests, and how far each joint crept meanwhile, where one did [rad].
struct Still {
    rows: Range<usize>,
    crept_rad: Option<Vec<f64>>,
}

/// Time over which slow motion is looked for [s], and how many standard errors make a slope.
const CREEP_S: f64 = 0.3;
const CREEP_SIGMAS: f64 = 5.0;

/// Window whose spread decides stillness [s]: long enough for five rows.
pub(crate) fn window_s(config: &DwellConfig, time_ns: &[i64]) -> f64 {
    config.window_s.max(5.0 * median_period_s(time_ns))
}

/// Judges the edges of a still run by the pose at rest in its middle.
struct Rest<'a> {
    encoders: &'a Encoders<'a>,
    tip: Option<&'a Tip<'a>>,
    edge_s: f64,
}

struct RestPose {
    joint_rad: Vec<f64>,
    tip_m: Option<Vector3<f64>>,
}

impl Rest<'_> {
    /// What of a still run is rest: its parts without creep; or, where the arm creeps so slowly and steadily that it can
    /// only be giving way, the end of the whole, by when it has settled as far as it does.
    fn stills(&self, run: &Range<usize>, config: &DwellConfig) -> Vec<Still> {
        let (time_ns, joints) = (&self.encoders.joints.time_ns, &self.encoders.joints.joint_rad);
        let long_enough = |rows: &Range<usize>| {
            !rows.is_empty()
                && seconds_between(time_ns[rows.start], time_ns[rows.end - 1]) >= config.min_duration_s
        };
        let parts = self.without_creep(run.clone());
        let settles = |part: &&Range<usize>| {
            self.settle((*part).clone(), (*part).clone()).is_some_and(|rows| long_enough(&rows))
        };
        let settled: Vec<&Range<usize>> = parts.iter().filter(settles).collect();
        let (tolerance_rad, most_rad) = (&self.encoders.settled_rad, config.creep_deg.to_radians());
        let crept = creep::joint_creep_rad(time_ns, joints, run, tolerance_rad, most_rad)
            .filter(|_| long_enough(run));
        match (&settled[..], crept) {
            // One part without creep is where it has settled; none, or several, are a rest that creeps throughout.
            ([settled], Some(_)) => vec![Still { rows: (*settled).clone(), crept_rad: None }],
            (_, Some(crept_rad)) => {
                let rows = creep::end_of(time_ns, run, config.min_duration_s);
                vec![Still { rows, crept_rad: Some(crept_rad) }]
            }
            (_, None) => parts.into_iter().map(|rows| Still { rows, crept_rad: None }).collect(),
        }
    }

    /// The parts of a run in which no joint creeps: moves too slowly for the spread of a short window, but
    /// over a longer one visibly. Arms do so between two neighbouring poses, and while they settle.
    fn without_creep(&self, run: Range<usize>) -> Vec<Range<usize>> {
        let time_ns = &self.encoders.joints.time_ns;
        let mut creeps = vec![false; run.len()];
        for (joint, column) in self.encoders.joints.joint_rad.iter().enumerate() {
            let (noise, least) = (self.encoders.channels[joint].noise, self.encoders.settled_rad[joint]);
            let (mut first, mut end) = (run.start, run.start);
            for i in run.clone() {
                while seconds_between(time_ns[first], time_ns[i]) > 0.5 * CREEP_S {
                    first += 1;
                }
                while end < run.end && seconds_between(time_ns[i], time_ns[end]) <= 0.5 * CREEP_S {
                    end += 1;
                }
                let Some((moved, error)) = moved_within(&time_ns[first..end], &column[first..end]) else {
                    continue;
                };
                creeps[i - run.start] |= moved.abs() > least.max(CREEP_SIGMAS * noise * error);
            }
        }
        unbroken_runs(&time_ns[run.clone()], f64::INFINITY, |i| !creeps[i])
            .into_iter()
            .map(|part| part.start + run.start..part.end + run.start)
            .collect()
    }

    /// Trims what has not settled yet (or is already leaving) and regains the rows at both ends that only
    /// the width of the window had excluded. The pose at rest is taken again after each trim, so that a
    /// slow settling converges to its flat part.
    fn settle(&self, mut run: Range<usize>, free: Range<usize>) -> Option<Range<usize>> {
        run.start = run.start.max(free.start);
        for _ in 0..8 {
            if run.len() < 3 {
                return None;
            }
            let pose = self.pose(&run);
            let before = run.clone();
            while run.len() >= 3 && !self.settled(&pose, self.from(run.start, run.end)) {
                run.start += 1;
            }
            while run.len() >= 3 && !self.settled(&pose, self.until(run.end, run.start)) {
                run.end -= 1;
            }
            if run == before {
                break;
            }
        }
        (run.len() >= 3).then(|| self.regain(run, free))
    }

    fn regain(&self, mut run: Range<usize>, free: Range<usize>) -> Range<usize> {
        let time_ns = &self.encoders.joints.time_ns;
        let pose = self.pose(&run);
        let (first, last) = (run.start, run.end - 1);
        let reach_s = 0.5 * self.edge_s;
        while run.start > free.start
            && seconds_between(time_ns[run.start - 1], time_ns[first]) <= reach_s
            && self.fits(&pose, run.start - 1)
        {
            run.start -= 1;
        }
        while run.end < free.end
            && seconds_between(time_ns[last], time_ns[run.end]) <= reach_s
            && self.fits(&pose, run.end)
        {
            run.end += 1;
        }
        run
    }

    fn same_pose(&self, a: &Range<usize>, b: &Range<usize>) -> bool {
        let (a, b) = (self.pose(a).joint_rad, self.pose(b).joint_rad);
        a.iter().zip(&b).zip(&self.encoders.settled_rad).all(|((a, b), tol)| (a - b).abs() <= 2.0 * tol)
    }

    /// Medians over the middle half.
    fn pose(&self, run: &Range<usize>) -> RestPose {
        let quarter = run.len() / 4;
        let middle = run.start + quarter..run.end - quarter;
        let joint_rad =
            self.encoders.joints.joint_rad.iter().map(|column| median(&column[middle.clone()])).collect();
        let tip_m = self.tip.and_then(|tip| {
            let seen: Vec<Vector3<f64>> = middle.filter_map(|i| tip.position_m(i)).collect();
            let axis = |k: usize| median(&seen.iter().map(|p| p[k]).collect::<Vec<_>>());
            (!seen.is_empty()).then(|| Vector3::from_fn(|k, _| axis(k)))
        });
        RestPose { joint_rad, tip_m }
    }

    /// Half a window of rows from `start` on, and up to `end`.
    fn from(&self, start: usize, limit: usize) -> Range<usize> {
        let time_ns = &self.encoders.joints.time_ns;
        let within = |i: &usize| seconds_between(time_ns[start], time_ns[*i]) <= 0.5 * self.edge_s;
        start..start + (start..limit).take_while(within).count()
    }

    fn until(&self, end: usize, limit: usize) -> Range<usize> {
        let time_ns = &self.encoders.joints.time_ns;
        let within = |i: &usize| seconds_between(time_ns[*i], time_ns[end - 1]) <= 0.5 * self.edge_s;
        end - (limit..end).rev().take_while(within).count()..end
    }

    /// Whether the local mean is the pose at rest.
    fn settled(&self, pose: &RestPose, rows: Range<usize>) -> bool {
        let n = rows.len() as f64;
        let columns = self.encoders.joints.joint_rad.iter();
        let mut joints = columns.zip(&pose.joint_rad).zip(&self.encoders.settled_rad);
        let still = joints.all(|((column, rest), tolerance)| {
            (column[rows.clone()].iter().sum::<f64>() / n - rest).abs() <= *tolerance
        });
        still && self.tip_settled(pose, rows)
    }

    fn tip_settled(&self, pose: &RestPose, rows: Range<usize>) -> bool {
        let (Some(tip), Some(rest_m)) = (self.tip, pose.tip_m) else { return true };
        let seen: Vec<Vector3<f64>> = rows.filter_map(|i| tip.position_m(i)).collect();
        let mean_m = seen.iter().sum::<Vector3<f64>>() / seen.len().max(1) as f64;
        seen.is_empty() || (mean_m - rest_m).norm() <= tip.settled_m
    }

    /// Whether a single row is the pose at rest, up to twice what a mean may be off.
    fn fits(&self, pose: &RestPose, row: usize) -> bool {
        let columns = self.encoders.joints.joint_rad.iter();
        let mut joints = columns.zip(&pose.joint_rad).zip(&self.encoders.settled_rad);
        let tip = self.tip.and_then(|t| Some((t.position_m(row)? - pose.tip_m?).norm() <= 2.0 * t.settled_m));
        joints.all(|((column, rest), tolerance)| (column[row] - rest).abs() <= 2.0 * tolerance)
            && tip.unwrap_or(true)
    }
}

/// How far a straight line through the values moves over their time, and the standard error of that for
/// values of unit noise. None for fewer than five values.
fn moved_within(time_ns: &[i64], values: &[f64]) -> Option<(f64, f64)> {
    let line = creep::fit_line(time_ns, values)?;
    Some((line.slope * line.span_s, line.span_s / line.square_s2.sqrt()))
}

/// Cuts `trim_s` off both ends, but not where the stream itself begins or ends, and never more than a half; nothing of a
/// pause with so few rows that none would be left.
fn trim_ends(time_ns: &[i64], run: Range<usize>, stretch: &Range<usize>, trim_s: f64) -> Range<usize> {
    let (first, last) = (time_ns[run.start], time_ns[run.end - 1]);
    let most_s = trim_s.min(0.25 * seconds_between(first, last));
    let mut kept = run.clone();
    while run.start > stretch.start && seconds_between(first, time_ns[kept.start]) < most_s - 1e-9 {
        kept.start += 1;
    }
    while run.end < stretch.end
        && kept.end > kept.start
        && seconds_between(time_ns[kept.end - 1], last) < most_s - 1e-9
    {
        kept.end -= 1;
    }
    if kept.is_empty() { run } else { kept }
}

/// For each time the nearest of `candidates` (both increasing), where it lies within `reach_s`.
fn nearest_rows(times_ns: &[i64], candidates_ns: &[i64], reach_s: f64) -> Vec<Option<usize>> {
    let mut at = 0;
    let distance_s = |t: i64, i: usize| seconds_between(candidates_ns[i], t).abs();
    let find = |&t: &i64| {
        while at + 1 < candidates_ns.len() && distance_s(t, at + 1) <= distance_s(t, at) {
            at += 1;
        }
        (at < candidates_ns.len() && distance_s(t, at) <= reach_s).then_some(at)
    };
    times_ns.iter().map(find).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearest_rows_are_nearest_and_within_reach() {
        let candidates = [0, 1_000_000_000, 1_100_000_000];
        let found =
            nearest_rows(&[-5, 400_000_000, 900_000_000, 1_090_000_000, 3_000_000_000], &candidates, 0.2);
        assert_eq!(found, vec![Some(0), None, Some(1), Some(2), None]);
        assert_eq!(nearest_rows(&[1, 2], &[], 0.1), vec![None, None]);
    }

    #[test]
    fn trimming_spares_the_ends_of_the_stream() {
        let time_ns: Vec<i64> = (0..100).map(|i| i * 10_000_000).collect();
        assert_eq!(trim_ends(&time_ns, 0..50, &(0..100), 0.02), 0..48);
        assert_eq!(trim_ends(&time_ns, 10..100, &(0..100), 0.02), 12..100);
    }

    #[test]
    fn trimming_leaves_a_pause_of_two_rows_as_it_is() {
        let time_ns: Vec<i64> = (0..10).map(|i| i * 500_000_000).collect();
        assert_eq!(trim_ends(&time_ns, 4..6, &(0..10), 0.1), 4..6);
        assert_eq!(trim_ends(&time_ns, 4..7, &(0..10), 0.1), 5..6);
    }
}
