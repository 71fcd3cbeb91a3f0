//! What the recordings say of each body: how far it went, where it was in every pause of the arm, which link it followed.

use super::arm::Arm;
use super::motion::{Likeness, Speeds, compare_speeds, speed_ratio};
use super::read::{AllRead, Read};
use armcal_core::robust::{median, percentile};
use armcal_core::{Pose, PoseSamples};
use armcal_dwell::mean_pose;
use armcal_stages::CLOCK_RATES;
use armcal_stages::links::{Placed, place_on_link, turned_apart};
use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::TAU;

/// Noise of positions [m] and turns [rad] below which no link is better than another.
const OFF_M: f64 = 2e-3;
const TURNED_RAD: f64 = 0.01;
/// Links that explain a body about as well as the best one.
const ALIKE: f64 = 1.2;

/// A pause in which a body was seen.
pub struct Pause {
    /// Which of the recording's dwells.
    pub dwell: usize,
    /// Where it was [m].
    pub at_m: Vector3<f64>,
    /// How it was turned.
    pub turned: Option<UnitQuaternion<f64>>,
}

/// A body in one recording.
pub struct InRecording {
    /// Distance from the median position that all but the worst hundredth of the frames keep [m].
    pub travel_m: f64,
    /// Its speed and that of the arm's tip.
    pub likeness: Option<Likeness>,
    /// The pauses in which it was seen.
    pub pauses: Vec<Pause>,
    /// Its mean pose; none without an orientation.
    pub mean: Option<Pose>,
    /// Its median position [m].
    pub middle_m: Vector3<f64>,
    /// On each link: where it would be, and the angle by which it turned otherwise.
    pub on_links: Vec<Option<(Placed, f64)>>,
}

/// All that is known of a body.
pub struct Evidence {
    /// By recording; none where it was never seen.
    pub recordings: Vec<Option<InRecording>>,
}

/// The link that explains a body best.
#[derive(Debug, Clone, Copy)]
pub struct BestLink {
    /// Its joint, from 0.
    pub link: usize,
    /// How far off it is there [m].
    pub off_m: f64,
    /// The same as a share of how far the body moves between pauses.
    pub share: f64,
    /// How many times worse the best of the other links is.
    pub lead: f64,
}

impl Evidence {
    fn seen(&self) -> impl Iterator<Item = &InRecording> {
        self.recordings.iter().flatten()
    }

    /// Furthest travel in a recording [m].
    pub fn travel_m(&self) -> f64 {
        self.seen().map(|r| r.travel_m).fold(0.0, f64::max)
    }

    /// The likeness of speeds, of the recording in which they are most alike.
    pub fn likeness(&self) -> Option<Likeness> {
        self.seen().filter_map(|r| r.likeness).max_by(|a, b| a.correlation.total_cmp(&b.correlation))
    }

    /// Pauses in all recordings.
    pub fn pauses(&self) -> usize {
        self.seen().map(|r| r.pauses.len()).sum()
    }

    /// The link that it follows best; the last of those that explain it alike.
    pub fn best_link(&self) -> Option<BestLink> {
        let links = self.seen().map(|r| r.on_links.len()).max()?;
        let mean = |link: usize, of: &dyn Fn(&(Placed, f64)) -> f64| {
            let all = self
                .seen()
                .filter_map(|r| Some((of(r.on_links.get(link)?.as_ref()?), r.pauses.len() as f64)));
            let (sum, count) =
                all.fold((0.0, 0.0), |(sum, n), (value, count)| (sum + value * count, n + count));
            (count > 0.0).then_some(sum / count)
        };
        let off_m: Vec<Option<f64>> =
            (0..links).map(|link| mean(link, &|(placed, _)| placed.off_m)).collect();
        let misfit = |link: usize| {
            let turned =
                mean(link, &|(_, turned)| *turned).filter(|turned| turned.is_finite()).unwrap_or(TURNED_RAD);
            Some(off_m[link]?.max(OFF_M) * turned.max(TURNED_RAD))
        };
        let misfits: Vec<(usize, f64)> = (0..links).filter_map(|link| Some((link, misfit(link)?))).collect();
        let least = misfits.iter().map(|(_, m)| *m).reduce(f64::min)?;
        let (link, own) = *misfits.iter().rev().find(|(_, m)| *m <= ALIKE * least)?;
        let others = misfits.iter().filter(|(other, _)| *other != link).map(|(_, m)| m / own);
        let spread: Vec<f64> = self.seen().flat_map(InRecording::spread_m).collect();
        let off_m = off_m[link]?;
        Some(BestLink {
            link,
            off_m,
            share: off_m / median(&spread),
            lead: others.fold(f64::INFINITY, f64::min),
        })
    }

    /// Where it is on a link, and where the base then is, by recording.
    pub fn placed(&self, link: usize) -> impl Iterator<Item = (usize, Placed)> {
        let on = move |r: &InRecording| r.on_links.get(link)?.map(|(placed, _)| placed);
        self.recordings.iter().enumerate().filter_map(move |(at, r)| Some((at, on(r.as_ref()?)?)))
    }
}

impl InRecording {
    /// Distances of its pauses from the middle of them [m].
    fn spread_m(&self) -> Vec<f64> {
        let axis = |k: usize| median(&self.pauses.iter().map(|p| p.at_m[k]).collect::<Vec<_>>());
        let middle = Vector3::new(axis(0), axis(1), axis(2));
        self.pauses.iter().map(|p| (p.at_m - middle).norm()).collect()
    }
}

/// Gathers what is known of every body.
pub fn gather(arm: &Arm, read: &AllRead) -> Vec<Evidence> {
    let mut all: Vec<Evidence> = read.bodies.iter().map(|_| Evidence { recordings: Vec::new() }).collect();
    for recording in &read.recordings {
        let joints = &recording.samples.joints;
        let nominal = arm.model.nominal();
        let tip_m = |i: usize| arm.model.tip_in_base(&nominal, &joints.row_rad(i)).translation.vector;
        let speeds = Speeds::of(&joints.time_ns, tip_m);
        let alike = |at: usize| {
            let seen = recording.body(at).filter(|seen| median_and_travel_m(seen).1 > STANDS_M)?;
            // Clocks of other epochs are compared by log time, those of two computers by when each began.
            let by_log_s = seen.other_epoch_s(joints);
            let ahead_s = if by_log_s == 0.0 { seen.apart_s(joints) } else { by_log_s };
            let on_robot: Vec<i64> = seen.time_ns.iter().map(|t| t - (ahead_s * 1e9) as i64).collect();
            let found = compare_speeds(&speeds, &Speeds::of(&on_robot, |i| seen.position_m[i]))?;
            Some(Likeness { delay_s: found.delay_s + ahead_s, ..found })
        };
        let likenesses: Vec<Option<Likeness>> = (0..all.len()).map(alike).collect();
        // The bodies have one clock: the one that is most alike tells how late it is.
        let clearest = likenesses.iter().flatten().max_by(|a, b| a.correlation.total_cmp(&b.correlation));
        let delay_s = clearest.filter(|l| l.correlation > 0.5).map_or(0.0, |l| l.delay_s);
        let poses: Vec<Vec<Pose>> = recording.dwells.iter().map(|d| arm.poses(&d.joint_rad)).collect();
        for (at, evidence) in all.iter_mut().enumerate() {
            let own =
                recording.body(at).map(|seen| in_recording(recording, seen, delay_s, likenesses[at], &poses));
            evidence.recordings.push(own);
        }
    }
    all
}

/// The clock of a body that moves with the arm only if its stamps ran so many times as fast; by its number.
pub fn clock_rates(arm: &Arm, read: &AllRead, evidence: &[Evidence]) -> Vec<(usize, f64)> {
    let nominal = arm.model.nominal();
    let rate = |at: usize| {
        if evidence[at].likeness().is_none_or(|l| l.correlation > UNLIKE) {
            return None;
        }
        let (recording, seen) = read.recordings.iter().find_map(|r| Some((r, r.body(at)?)))?;
        let joints = &recording.samples.joints;
        let tip_m = |i: usize| arm.model.tip_in_base(&nominal, &joints.row_rad(i)).translation.vector;
        let speeds = Speeds::of(&joints.time_ns, tip_m);
        let alike = |rate: f64| {
            let mut slowed = seen.clone();
            slowed.slow_down(rate);
            let own = Speeds::of(&slowed.time_ns, |i| slowed.position_m[i]);
            Some((compare_speeds(&speeds, &own)?.correlation, rate))
        };
        let best = CLOCK_RATES.into_iter().filter_map(alike).max_by(|a, b| a.0.total_cmp(&b.0));
        best.filter(|(correlation, _)| *correlation > SURELY_ALIKE).map(|(_, rate)| (at, rate))
    };
    (0..evidence.len()).filter_map(rate).collect()
}

/// Whether the joints are read in turns: the body that moves most like the arm moves so many times as fast, and as fast and no less
/// alike once they are taken for that.
pub fn in_turns(arm: &Arm, read: &AllRead, evidence: &[Evidence]) -> bool {
    let nominal = arm.model.nominal();
    let likeness = |at: usize| evidence[at].likeness().map_or(0.0, |l| l.correlation);
    let Some(at) = (0..evidence.len()).max_by(|a, b| likeness(*a).total_cmp(&likeness(*b))) else {
        return false;
    };
    let mut seen = read.recordings.iter().filter_map(|r| Some((&r.samples.joints, r.body(at)?)));
    let Some((joints, seen)) = seen.next().filter(|_| likeness(at) > UNLIKE) else { return false };
    let body = Speeds::of(&seen.time_ns, |i| seen.position_m[i]);
    let with = |factor: f64| {
        let row = |i: usize| joints.row_rad(i).iter().map(|q| factor * q).collect::<Vec<f64>>();
        let tip_m = |i: usize| arm.model.tip_in_base(&nominal, &row(i)).translation.vector;
        let speeds = Speeds::of(&joints.time_ns, tip_m);
        let likeness = compare_speeds(&speeds, &body)?;
        Some((speed_ratio(&speeds, &body, likeness.delay_s), likeness.correlation))
    };
    let near = |ratio: f64, unit: f64| (ratio / unit).ln().abs() < SAME_SPEED.ln();
    let Some((_, as_read)) = with(1.0).filter(|(ratio, _)| near(*ratio, TAU)) else { return false };
    with(TAU).is_some_and(|(ratio, alike)| near(ratio, 1.0) && alike >= as_read)
}

/// A body moves at the speed of the arm within this factor, wherever on its end it is.
const SAME_SPEED: f64 = 1.4;
/// Speeds that are no more alike than this are not of one motion; those that are more alike than that surely are.
const UNLIKE: f64 = 0.5;
const SURELY_ALIKE: f64 = 0.85;

/// A body that stays within this stands still [m].
pub const STANDS_M: f64 = 0.01;

/// Median position and travel [m].
fn median_and_travel_m(seen: &PoseSamples) -> (Vector3<f64>, f64) {
    let axis = |k: usize| median(&seen.position_m.iter().map(|p| p[k]).collect::<Vec<_>>());
    let middle_m = Vector3::new(axis(0), axis(1), axis(2));
    let off: Vec<f64> = seen.position_m.iter().map(|p| (p - middle_m).norm()).collect();
    (middle_m, percentile(&off, 0.99))
}

fn in_recording(
    recording: &Read,
    seen: &PoseSamples,
    delay_s: f64,
    likeness: Option<Likeness>,
    poses: &[Vec<Pose>],
) -> InRecording {
    let (middle_m, travel_m) = median_and_travel_m(seen);
    let delay_ns = (delay_s * 1e9) as i64;
    let pause = |(dwell, d): (usize, &armcal_core::Dwell)| {
        let from = seen.time_ns.partition_point(|t| *t < d.start_ns + delay_ns);
        let to = seen.time_ns.partition_point(|t| *t <= d.end_ns + delay_ns);
        let rows = from..to;
        if rows.is_empty() {
            return None;
        }
        let axis = |k: usize| median(&seen.position_m[rows.clone()].iter().map(|p| p[k]).collect::<Vec<_>>());
        let at_m = Vector3::new(axis(0), axis(1), axis(2));
        let turned = seen.orientation.as_ref().map(|q| q[rows.start + rows.len() / 2]);
        Some(Pause { dwell, at_m, turned })
    };
    let pauses: Vec<Pause> = recording.dwells.iter().enumerate().filter_map(pause).collect();
    let links = poses.first().map_or(0, |p| p.len() - 1);
    let on_link = |link: usize| {
        let own: Vec<Pose> = pauses.iter().map(|p| poses[p.dwell][link]).collect();
        let seen_m: Vec<Vector3<f64>> = pauses.iter().map(|p| p.at_m).collect();
        let turned: Option<Vec<_>> = pauses.iter().map(|p| p.turned).collect();
        let apart = turned.map_or(f64::NAN, |turned| turned_apart(&own, &turned));
        Some((place_on_link(&own, &seen_m)?, apart))
    };
    let moves = travel_m > STANDS_M;
    let on_links = if moves { (0..links).map(on_link).collect() } else { Vec::new() };
    let mean = mean_pose(seen).ok().map(|(mean, _)| mean).filter(|m| m.has_orientation && !moves);
    InRecording { travel_m, likeness, pauses, mean: mean.map(|m| m.pose), middle_m, on_links }
}
