//! Encoders and drivers that fail, and readings that are no readings.

use super::{ALL, Kind, about, kind, set_points, whole};
use crate::session::{Rest, Session};
use crate::{Draw, Error};

pub const KINDS: &[Kind] = &[
    kind("joint-frozen-throughout", "joint-stuck", ALL, |s, d| frozen(s, d, 0.0)),
    kind("joint-frozen-from-the-middle", "joint-stuck", ALL, |s, d| frozen(s, d, 0.45)),
    kind("joint-always-zero", "joint-stuck", ALL, always_zero),
    whole("set-points-recorded", "setpoints-recorded", ALL, set_points::recorded),
    whole("set-point-topic-in-pipeline", "setpoints-recorded", ALL, set_points::named),
    kind("encoder-slips-once", "joint-zero-event", ALL, slips),
    kind("encoder-wraps-early", "encoder-wrap", ALL, wraps),
    kind("encoder-saturates", "saturated-joint", ALL, saturates),
    whole("encoder-coarse", "quantised", ALL, coarse),
    whole("encoder-stale", "stale-encoder", ALL, stale),
    whole("encoder-filtered", "filtered-encoder", ALL, filtered),
    whole("encoder-noisy", "noise-underdeclared", ALL, noisy),
    kind("encoder-spikes", "outliers", ALL, spikes),
    whole("driver-resets-to-zero", "outliers", ALL, resets),
    whole("encoder-not-a-number", "non-finite", ALL, not_a_number),
];

fn some_joint(session: &Session, draw: &mut Draw) -> usize {
    draw.pick(session.joint_names().len())
}

fn frozen(session: &mut Session, draw: &mut Draw, from: f64) -> Result<Vec<String>, Error> {
    let joint = some_joint(session, draw);
    let mut last = Vec::new();
    session.joints(|at, q| {
        last.resize(at.recording + 1, None);
        let held: &mut Option<f64> = &mut last[at.recording];
        if at.share < from {
            return;
        }
        q[joint] = *held.get_or_insert(q[joint]);
    });
    about(session, &[joint])
}

fn always_zero(session: &mut Session, draw: &mut Draw) -> Result<Vec<String>, Error> {
    let joint = some_joint(session, draw);
    session.joints(|_, q| q[joint] = 0.0);
    about(session, &[joint])
}

fn slips(session: &mut Session, draw: &mut Draw) -> Result<Vec<String>, Error> {
    let joint = 1 + draw.pick(session.joint_names().len() - 1);
    let angle = draw.signed(1.0, 4.0).to_radians();
    let moment_ns = session.moment_ns(1, draw.uniform(0.35, 0.65));
    session.joints(|at, q| q[joint] += if at.stamp_ns > moment_ns { angle } else { 0.0 });
    about(session, &[joint])
}

/// A counter that is too short: the reading jumps back by what it holds, which is no whole turn of the joint.
fn wraps(session: &mut Session, draw: &mut Draw) -> Result<Vec<String>, Error> {
    let joint = some_joint(session, draw);
    let [top, high, low] = quantiles(session, joint, [draw.uniform(0.45, 0.7), 0.98, 0.02]);
    let holds = (high - low) * draw.uniform(0.6, 1.1);
    session.joints(|_, q| {
        if q[joint] > top {
            q[joint] -= holds;
        }
    });
    about(session, &[joint])
}

fn saturates(session: &mut Session, draw: &mut Draw) -> Result<Vec<String>, Error> {
    let joint = some_joint(session, draw);
    let [top] = quantiles(session, joint, [draw.uniform(0.5, 0.75)]);
    session.joints(|_, q| q[joint] = q[joint].min(top));
    about(session, &[joint])
}

/// Quantiles of the readings of a joint.
fn quantiles<const N: usize>(session: &mut Session, joint: usize, shares: [f64; N]) -> [f64; N] {
    let mut readings = Vec::new();
    session.joints(|_, q| readings.push(q[joint]));
    readings.sort_by(f64::total_cmp);
    shares.map(|share| readings[((readings.len() as f64 * share) as usize).min(readings.len() - 1)])
}

fn coarse(session: &mut Session, draw: &mut Draw) {
    let step = draw.uniform(0.4, 1.0).to_radians();
    session.joints(|_, q| q.iter_mut().for_each(|q| *q = (*q / step).round() * step));
}

/// The driver refreshes its readings every second or so and publishes the old ones in between.
fn stale(session: &mut Session, draw: &mut Draw) {
    let period_ns = (1e9 * draw.uniform(0.9, 1.4)) as i64;
    let mut held: Vec<Option<(i64, Vec<f64>)>> = Vec::new();
    session.joints(|at, q| {
        held.resize(at.recording + 1, None);
        let slot = &mut held[at.recording];
        match slot {
            Some((slice, value)) if *slice == at.stamp_ns / period_ns => q.clone_from(value),
            _ => *slot = Some((at.stamp_ns / period_ns, q.clone())),
        }
    });
}

/// A low-pass that has not settled when the rest is over.
fn filtered(session: &mut Session, draw: &mut Draw) {
    let time_s = draw.uniform(0.4, 0.9);
    let mut state: Vec<Option<(i64, Vec<f64>)>> = Vec::new();
    session.joints(|at, q| {
        state.resize(at.recording + 1, None);
        let slot = &mut state[at.recording];
        if let Some((then_ns, value)) = slot {
            let gain = 1.0 - (-((at.stamp_ns - *then_ns) as f64 * 1e-9) / time_s).exp();
            q.iter_mut().zip(value.iter()).for_each(|(q, v)| *q = v + gain * (*q - v));
        }
        *slot = Some((at.stamp_ns, q.clone()));
    });
}

/// Errors of a quarter of a degree that are constant through a rest: no reading tells of them.
fn noisy(session: &mut Session, draw: &mut Draw) {
    let sigma = draw.uniform(0.15, 0.4).to_radians();
    let rests: Vec<Vec<Rest>> = session.recordings.iter().map(|r| r.rests.clone()).collect();
    let joints = session.joint_names().len();
    let mut errors: Vec<Vec<Option<Vec<f64>>>> = rests.iter().map(|r| vec![None; r.len() + 1]).collect();
    session.joints(|at, q| {
        // It changes while the arm moves.
        let k = rests[at.recording].partition_point(|r| r.end_ns + 100_000_000 <= at.stamp_ns);
        let error = errors[at.recording][k]
            .get_or_insert_with(|| (0..joints).map(|_| sigma * draw.normal()).collect::<Vec<f64>>());
        q.iter_mut().zip(error).for_each(|(q, e)| *q += *e);
    });
}

fn spikes(session: &mut Session, draw: &mut Draw) -> Result<Vec<String>, Error> {
    let joint = some_joint(session, draw);
    let share = draw.uniform(0.01, 0.04);
    session.joints(|_, q| {
        if draw.chance(share) {
            q[joint] += draw.signed(0.2, 2.0);
        }
    });
    about(session, &[joint])
}

fn resets(session: &mut Session, draw: &mut Draw) {
    let share = draw.uniform(0.005, 0.03);
    session.joints(|_, q| {
        if draw.chance(share) {
            q.fill(0.0);
        }
    });
}

fn not_a_number(session: &mut Session, draw: &mut Draw) {
    let joint = some_joint(session, draw);
    let share = draw.uniform(0.1, 0.3);
    session.joints(|_, q| {
        if draw.chance(share) {
            q[joint] = f64::NAN;
        }
    });
}
