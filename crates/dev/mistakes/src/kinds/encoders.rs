//! Encoders and drivers that fail, and readings that are no readings.

use super::{ALL, Kind, change_readings, joint, set_points, whole};
use crate::rigs::Rest;
use crate::{Draw, Session};

pub const KINDS: &[Kind] = &[
    joint("joint-frozen-throughout", "joint-stuck", 0, |s, _, j| freeze_joint(s, j, 0.0)),
    joint("joint-frozen-from-the-middle", "joint-stuck", 0, |s, _, j| freeze_joint(s, j, 0.45)),
    joint("joint-always-zero", "joint-stuck", 0, |s, _, j| s.joints(|_, q| q[j] = 0.0)),
    whole("set-points-recorded", "setpoints-recorded", ALL, set_points::replace_readings),
    whole("set-point-topic-in-pipeline", "setpoints-recorded", ALL, set_points::add_command_topic),
    joint("encoder-slips-once", "joint-zero-event", 1, slip_encoder),
    joint("encoder-wraps-early", "encoder-wrap", 0, wrap_encoder),
    joint("encoder-saturates", "saturated-joint", 0, saturate_encoder),
    whole("encoder-coarse", "quantised", ALL, coarsen_readings),
    whole("encoder-stale", "stale-encoder", ALL, hold_readings),
    whole("encoder-filtered", "filtered-encoder", ALL, filter_readings),
    whole("encoder-noisy", "noise-underdeclared", ALL, add_noise),
    joint("encoder-spikes", "outliers", 0, add_spikes),
    whole("driver-resets-to-zero", "outliers", ALL, reset_readings),
    whole("encoder-not-a-number", "non-finite", ALL, not_a_number),
];

fn freeze_joint(session: &mut Session, joint: usize, from: f64) {
    let mut held = vec![None; session.recordings.len()];
    session.joints(|at, q| {
        if at.share >= from {
            q[joint] = *held[at.recording].get_or_insert(q[joint]);
        }
    });
}

fn slip_encoder(session: &mut Session, draw: &mut Draw, joint: usize) {
    let angle = draw.signed(1.0, 4.0).to_radians();
    let moment_ns = session.moment_ns(1, draw.uniform(0.35, 0.65));
    session.joints(|at, q| q[joint] += if at.stamp_ns > moment_ns { angle } else { 0.0 });
}

/// A counter that is too short: the reading jumps back by what it holds, which is no whole turn of the joint.
fn wrap_encoder(session: &mut Session, draw: &mut Draw, joint: usize) {
    let [top, high, low] = quantiles(session, joint, [draw.uniform(0.45, 0.7), 0.98, 0.02]);
    let holds = (high - low) * draw.uniform(0.6, 1.1);
    session.joints(|_, q| {
        if q[joint] > top {
            q[joint] -= holds;
        }
    });
}

fn saturate_encoder(session: &mut Session, draw: &mut Draw, joint: usize) {
    let [top] = quantiles(session, joint, [draw.uniform(0.5, 0.75)]);
    session.joints(|_, q| q[joint] = q[joint].min(top));
}

/// Quantiles of the readings of a joint.
fn quantiles<const N: usize>(session: &mut Session, joint: usize, shares: [f64; N]) -> [f64; N] {
    let mut readings = Vec::new();
    session.joints(|_, q| readings.push(q[joint]));
    readings.sort_by(f64::total_cmp);
    shares.map(|share| readings[((readings.len() as f64 * share) as usize).min(readings.len() - 1)])
}

fn coarsen_readings(session: &mut Session, draw: &mut Draw) {
    let step = draw.uniform(0.4, 1.0).to_radians();
    change_readings(session, |q| (q / step).round() * step);
}

/// The driver refreshes its readings every second or so and publishes the old ones in between.
fn hold_readings(session: &mut Session, draw: &mut Draw) {
    let period_ns = (1e9 * draw.uniform(0.9, 1.4)) as i64;
    let mut held: Vec<Option<(i64, Vec<f64>)>> = vec![None; session.recordings.len()];
    session.joints(|at, q| {
        let slot = &mut held[at.recording];
        match slot {
            Some((slice, value)) if *slice == at.stamp_ns / period_ns => q.clone_from(value),
            _ => *slot = Some((at.stamp_ns / period_ns, q.clone())),
        }
    });
}

/// A low-pass that has not settled when the rest is over.
fn filter_readings(session: &mut Session, draw: &mut Draw) {
    let time_s = draw.uniform(0.4, 0.9);
    let mut state: Vec<Option<(i64, Vec<f64>)>> = vec![None; session.recordings.len()];
    session.joints(|at, q| {
        let slot = &mut state[at.recording];
        if let Some((then_ns, value)) = slot {
            let gain = 1.0 - (-((at.stamp_ns - *then_ns) as f64 * 1e-9) / time_s).exp();
            q.iter_mut().zip(value.iter()).for_each(|(q, v)| *q = v + gain * (*q - v));
        }
        *slot = Some((at.stamp_ns, q.clone()));
    });
}

/// Errors of a quarter of a degree that are constant through a rest: no reading tells of them.
fn add_noise(session: &mut Session, draw: &mut Draw) {
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

fn add_spikes(session: &mut Session, draw: &mut Draw, joint: usize) {
    let share = draw.uniform(0.01, 0.04);
    session.joints(|_, q| {
        if draw.chance(share) {
            q[joint] += draw.signed(0.2, 2.0);
        }
    });
}

fn reset_readings(session: &mut Session, draw: &mut Draw) {
    let share = draw.uniform(0.005, 0.03);
    session.joints(|_, q| {
        if draw.chance(share) {
            q.fill(0.0);
        }
    });
}

fn not_a_number(session: &mut Session, draw: &mut Draw) {
    let joint = draw.pick(session.joint_names().len());
    let share = draw.uniform(0.1, 0.3);
    session.joints(|_, q| {
        if draw.chance(share) {
            q[joint] = f64::NAN;
        }
    });
}
