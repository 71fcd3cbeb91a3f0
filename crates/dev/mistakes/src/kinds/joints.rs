//! Which joint is which, which way it turns, in what unit, from which zero.

use super::{ALL, Kind, about_joints, change_readings, joint, kind, whole};
use crate::session::Session;
use crate::{Draw, Error};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use toml::Value;

pub const KINDS: &[Kind] = &[
    kind("first-joint-reversed", "joint-sign", ALL, |s, _| reverse_joints(s, &[0])),
    kind("second-joint-reversed", "joint-sign", ALL, |s, _| reverse_joints(s, &[1])),
    kind("third-joint-reversed", "joint-sign", ALL, |s, _| reverse_joints(s, &[2])),
    kind("last-joint-reversed", "joint-sign", ALL, |s, _| {
        let last = s.joint_names().len() - 1;
        reverse_joints(s, &[last])
    }),
    kind("shoulder-and-elbow-reversed", "joint-sign", ALL, |s, _| reverse_joints(s, &[1, 2])),
    kind("all-joints-reversed", "joint-sign", ALL, |s, _| {
        let all: Vec<usize> = (0..s.joint_names().len()).collect();
        reverse_joints(s, &all)
    }),
    joint("joint-reversed-and-shifted", "joint-sign", 1, |s, _, j| s.joints(|_, q| q[j] = FRAC_PI_2 - q[j])),
    kind("two-joint-names-swapped", "joint-order", ALL, names_swapped),
    whole("joint-names-rotated", "joint-order", ALL, |s, _| declared_names(s).rotate_left(1)),
    whole("joint-names-backwards", "joint-order", ALL, |s, _| declared_names(s).reverse()),
    kind("driver-in-another-order", "joint-order", ALL, driver_order),
    whole("degrees-read-as-radians", "joint-unit", ALL, |s, _| change_readings(s, f64::to_degrees)),
    whole("radians-read-as-degrees", "joint-unit", ALL, |s, _| s.set(&["streams", "joints", "unit"], "deg")),
    joint("one-joint-in-degrees", "joint-unit", 0, |s, _, j| s.joints(|_, q| q[j] = q[j].to_degrees())),
    whole("milliradians", "joint-unit", ALL, |s, _| change_readings(s, |q| q * 1e3)),
    whole("counts-per-turn-doubled", "joint-unit", ALL, |s, _| as_counts(s, 8192, |_| 1)),
    joint("encoder-direction-declared-wrong", "joint-sign", 0, |s, _, j| {
        as_counts(s, 16384, |k| if k == j { -1 } else { 1 })
    }),
    joint("gear-ratio-off", "joint-scale", 0, gear_ratio),
    joint("motor-angles-for-joint-angles", "joint-scale", 0, motor_angles),
    joint("whole-turn-between-recordings", "whole-turns", 0, whole_turn),
    // Of a joint that is not the first: turning that is turning the base.
    joint("half-turn-off", "joint-zero-gross", 1, |s, _, j| s.joints(|_, q| q[j] += PI)),
    joint("quarter-turn-off", "joint-zero-gross", 1, |s, _, j| s.joints(|_, q| q[j] += FRAC_PI_2)),
    kind("zero-off-by-tens-of-degrees", "joint-zero-gross", ALL, zero_off),
    whole("zeros-of-all-joints-off", "joint-zero-gross", ALL, zeros_off),
    joint("homed-again-between-recordings", "joint-zero-event", 1, homed_again),
    kind("joint-reversed-in-one-recording", "joint-sign", ALL, |s, d| in_one(s, d, 0, |q, j| q[j] = -q[j])),
    kind("joints-exchanged-in-one-recording", "joint-order", ALL, |s, d| {
        in_one(s, d, 1, |q, j| q.swap(j - 1, j))
    }),
    kind("joint-in-degrees-in-one-recording", "joint-unit", ALL, |s, d| {
        in_one(s, d, 0, |q, j| q[j] = q[j].to_degrees())
    }),
    kind("one-recording-in-degrees", "joint-unit", ALL, |s, d| {
        in_one(s, d, 0, |q, _| q.iter_mut().for_each(|q| *q = q.to_degrees()))
    }),
    kind("quarter-turn-in-one-recording", "joint-zero-gross", ALL, |s, d| {
        in_one(s, d, 1, |q, j| q[j] += FRAC_PI_2)
    }),
    kind("forearm-angle-absolute", "joint-coupling", ALL, absolute_angle),
    whole("speeds-in-the-place-of-angles", "wrong-field", ALL, angles_to_speeds),
];

fn reverse_joints(session: &mut Session, joints: &[usize]) -> Result<Vec<String>, Error> {
    session.joints(|_, q| joints.iter().for_each(|j| q[*j] = -q[*j]));
    about_joints(session, joints)
}

fn names_swapped(session: &mut Session, draw: &mut Draw) -> Result<Vec<String>, Error> {
    let first = draw.pick(session.joint_names().len() - 1);
    let names = declared_names(session);
    names.swap(first, first + 1);
    about_joints(session, &[first, first + 1])
}

fn declared_names(session: &mut Session) -> &mut Vec<Value> {
    let names = session.joint_names().into_iter().map(Value::String).collect::<Vec<_>>();
    session.set(&["streams", "joints", "names"], names);
    session
        .pipeline
        .get_mut("streams")
        .and_then(|s| s.get_mut("joints"))
        .and_then(|j| j.get_mut("names"))
        .and_then(Value::as_array_mut)
        .expect("set just above")
}

/// The driver lists angles in another order than their names: elbow first, as some do.
fn driver_order(session: &mut Session, _: &mut Draw) -> Result<Vec<String>, Error> {
    session.joints(|_, q| q.swap(0, 2));
    about_joints(session, &[0, 2])
}

/// The stream in counts of 16384 a turn; the pipeline says what it says.
fn as_counts(session: &mut Session, per_turn: i64, direction: impl Fn(usize) -> i64) {
    change_readings(session, |q| (q / TAU * 16384.0).round());
    let encoder = |joint| {
        let keys = [("counts_per_turn", per_turn), ("direction", direction(joint))];
        Value::Table(keys.into_iter().map(|(k, v)| (k.to_owned(), Value::Integer(v))).collect())
    };
    let encoders: Vec<Value> = (0..session.joint_names().len()).map(encoder).collect();
    session.set(&["streams", "joints", "unit"], "counts");
    session.set(&["streams", "joints", "encoders"], encoders);
}

fn gear_ratio(session: &mut Session, draw: &mut Draw, joint: usize) {
    let factor = 1.0 + draw.signed(0.05, 0.2);
    session.joints(|_, q| q[joint] *= factor);
}

fn motor_angles(session: &mut Session, draw: &mut Draw, joint: usize) {
    let ratio = [2.0, 3.0, 5.0][draw.pick(3)];
    session.joints(|_, q| q[joint] *= ratio);
}

fn whole_turn(session: &mut Session, draw: &mut Draw, joint: usize) {
    let turn = draw.sign() * TAU;
    session.joints(|at, q| q[joint] += if at.recording == 1 { turn } else { 0.0 });
}

fn zero_off(session: &mut Session, draw: &mut Draw) -> Result<Vec<String>, Error> {
    let angle_rad = draw.signed(12.0, 35.0).to_radians();
    let joint = 1 + draw.pick(session.joint_names().len() - 1);
    session.joints(|_, q| q[joint] += angle_rad);
    about_joints(session, &[joint])
}

fn zeros_off(session: &mut Session, draw: &mut Draw) {
    let joints = session.joint_names().len();
    let angles: Vec<f64> = (0..joints).map(|_| draw.signed(8.0, 20.0).to_radians()).collect();
    session.joints(|_, q| q.iter_mut().zip(&angles).for_each(|(q, a)| *q += a));
}

fn homed_again(session: &mut Session, draw: &mut Draw, joint: usize) {
    let angle = draw.signed(2.0, 6.0).to_radians();
    session.joints(|at, q| q[joint] += if at.recording >= 1 { angle } else { 0.0 });
}

/// One recording made by another driver, or after another homing: of a joint from the one with this index on. A report has to
/// name the recording.
fn in_one(
    session: &mut Session,
    draw: &mut Draw,
    first: usize,
    change: impl Fn(&mut [f64], usize),
) -> Result<Vec<String>, Error> {
    let joint = first + draw.pick(session.joint_names().len() - first);
    let one = draw.pick(session.recordings.len());
    session.joints(|at, q| {
        if at.recording == one {
            change(q, joint);
        }
    });
    Ok(vec![format!("`{}`", session.recordings[one].name)])
}

/// The forearm's encoder reads against the room, not against the upper arm.
fn absolute_angle(session: &mut Session, _: &mut Draw) -> Result<Vec<String>, Error> {
    session.joints(|_, q| q[2] += q[1]);
    about_joints(session, &[2])
}

fn angles_to_speeds(session: &mut Session, _: &mut Draw) {
    let mut before: Vec<Option<(i64, Vec<f64>)>> = vec![None; session.recordings.len()];
    session.joints(|at, q| {
        let now = (at.stamp_ns, q.clone());
        let (then_ns, then) = before[at.recording].replace(now).unwrap_or((0, q.clone()));
        let seconds = ((at.stamp_ns - then_ns) as f64 * 1e-9).max(1e-3);
        q.iter_mut().zip(&then).for_each(|(now, then)| *now = (*now - then) / seconds);
    });
}
