//! Which joint is which, which way it turns, in what unit, from which zero.

use super::{ALL, Kind, about, kind, whole};
use crate::session::{JOINTS, Session};
use crate::{Draw, Error};
use armcal_lab::sensors::{Message, Payload};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use toml::Value;

pub const KINDS: &[Kind] = &[
    kind("first-joint-reversed", "joint-sign", ALL, |s, _| reversed(s, &[0])),
    kind("second-joint-reversed", "joint-sign", ALL, |s, _| reversed(s, &[1])),
    kind("third-joint-reversed", "joint-sign", ALL, |s, _| reversed(s, &[2])),
    kind("last-joint-reversed", "joint-sign", ALL, |s, _| {
        let last = s.joint_names().len() - 1;
        reversed(s, &[last])
    }),
    kind("shoulder-and-elbow-reversed", "joint-sign", ALL, |s, _| reversed(s, &[1, 2])),
    kind("all-joints-reversed", "joint-sign", ALL, |s, _| {
        let all: Vec<usize> = (0..s.joint_names().len()).collect();
        reversed(s, &all)
    }),
    kind("joint-reversed-and-shifted", "joint-sign", ALL, reversed_and_shifted),
    kind("two-joint-names-swapped", "joint-order", ALL, names_swapped),
    whole("joint-names-rotated", "joint-order", ALL, names_rotated),
    whole("joint-names-backwards", "joint-order", ALL, names_backwards),
    kind("driver-in-another-order", "joint-order", ALL, driver_order),
    whole("degrees-read-as-radians", "joint-unit", ALL, degrees),
    whole("radians-read-as-degrees", "joint-unit", ALL, declared_degrees),
    kind("one-joint-in-degrees", "joint-unit", ALL, one_in_degrees),
    whole("milliradians", "joint-unit", ALL, milliradians),
    whole("counts-per-turn-doubled", "joint-unit", ALL, counts_per_turn),
    kind("encoder-direction-declared-wrong", "joint-sign", ALL, encoder_direction),
    kind("gear-ratio-off", "joint-scale", ALL, gear_ratio),
    kind("motor-angles-for-joint-angles", "joint-scale", ALL, motor_angles),
    kind("whole-turn-between-recordings", "whole-turns", ALL, whole_turn),
    kind("half-turn-off", "joint-zero-gross", ALL, |s, d| zero_off(s, d, PI)),
    kind("quarter-turn-off", "joint-zero-gross", ALL, |s, d| zero_off(s, d, FRAC_PI_2)),
    kind("zero-off-by-tens-of-degrees", "joint-zero-gross", ALL, |s, d| {
        let angle = d.signed(12.0, 35.0).to_radians();
        zero_off(s, d, angle)
    }),
    whole("zeros-of-all-joints-off", "joint-zero-gross", ALL, zeros_off),
    kind("homed-again-between-recordings", "joint-zero-event", ALL, homed_again),
    kind("forearm-angle-absolute", "joint-coupling", ALL, absolute_angle),
    whole("speeds-in-the-place-of-angles", "wrong-field", ALL, speeds),
];

fn reversed(session: &mut Session, joints: &[usize]) -> Result<Vec<String>, Error> {
    session.joints(|_, q| joints.iter().for_each(|j| q[*j] = -q[*j]));
    about(session, joints)
}

fn reversed_and_shifted(session: &mut Session, draw: &mut Draw) -> Result<Vec<String>, Error> {
    let joint = 1 + draw.pick(session.joint_names().len() - 1);
    session.joints(|_, q| q[joint] = FRAC_PI_2 - q[joint]);
    about(session, &[joint])
}

fn names_swapped(session: &mut Session, draw: &mut Draw) -> Result<Vec<String>, Error> {
    let first = draw.pick(session.joint_names().len() - 1);
    let names = declared_names(session);
    names.swap(first, first + 1);
    about(session, &[first, first + 1])
}

fn names_rotated(session: &mut Session, _: &mut Draw) {
    declared_names(session).rotate_left(1);
}

fn names_backwards(session: &mut Session, _: &mut Draw) {
    declared_names(session).reverse();
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
    about(session, &[0, 2])
}

fn degrees(session: &mut Session, _: &mut Draw) {
    session.joints(|_, q| q.iter_mut().for_each(|q| *q = q.to_degrees()));
}

fn declared_degrees(session: &mut Session, _: &mut Draw) {
    session.set(&["streams", "joints", "unit"], "deg");
}

fn one_in_degrees(session: &mut Session, draw: &mut Draw) -> Result<Vec<String>, Error> {
    let joint = draw.pick(session.joint_names().len());
    session.joints(|_, q| q[joint] = q[joint].to_degrees());
    about(session, &[joint])
}

fn milliradians(session: &mut Session, _: &mut Draw) {
    session.joints(|_, q| q.iter_mut().for_each(|q| *q *= 1e3));
}

fn counts_per_turn(session: &mut Session, _: &mut Draw) {
    as_counts(session, |_| 8192, |_| 1);
}

fn encoder_direction(session: &mut Session, draw: &mut Draw) -> Result<Vec<String>, Error> {
    let joint = draw.pick(session.joint_names().len());
    as_counts(session, |_| 16384, |j| if j == joint { -1 } else { 1 });
    about(session, &[joint])
}

/// The stream in counts of 16384 a turn; the pipeline says what it says.
fn as_counts(session: &mut Session, per_turn: fn(usize) -> i64, direction: impl Fn(usize) -> i64) {
    session.joints(|_, q| q.iter_mut().for_each(|q| *q = (*q / TAU * 16384.0).round()));
    let encoder = |joint| {
        let keys = [("counts_per_turn", per_turn(joint)), ("direction", direction(joint))];
        Value::Table(keys.into_iter().map(|(k, v)| (k.to_owned(), Value::Integer(v))).collect())
    };
    let encoders: Vec<Value> = (0..session.joint_names().len()).map(encoder).collect();
    session.set(&["streams", "joints", "unit"], "counts");
    session.set(&["streams", "joints", "encoders"], encoders);
}

fn gear_ratio(session: &mut Session, draw: &mut Draw) -> Result<Vec<String>, Error> {
    let joint = draw.pick(session.joint_names().len());
    let factor = 1.0 + draw.signed(0.05, 0.2);
    session.joints(|_, q| q[joint] *= factor);
    about(session, &[joint])
}

fn motor_angles(session: &mut Session, draw: &mut Draw) -> Result<Vec<String>, Error> {
    let joint = draw.pick(session.joint_names().len());
    let ratio = [2.0, 3.0, 5.0][draw.pick(3)];
    session.joints(|_, q| q[joint] *= ratio);
    about(session, &[joint])
}

fn whole_turn(session: &mut Session, draw: &mut Draw) -> Result<Vec<String>, Error> {
    let joint = draw.pick(session.joint_names().len());
    let turn = draw.sign() * TAU;
    session.joints(|at, q| q[joint] += if at.recording == 1 { turn } else { 0.0 });
    about(session, &[joint])
}

/// Of a joint that is not the first: turning that is turning the base.
fn zero_off(session: &mut Session, draw: &mut Draw, angle_rad: f64) -> Result<Vec<String>, Error> {
    let joint = 1 + draw.pick(session.joint_names().len() - 1);
    session.joints(|_, q| q[joint] += angle_rad);
    about(session, &[joint])
}

fn zeros_off(session: &mut Session, draw: &mut Draw) {
    let joints = session.joint_names().len();
    let angles: Vec<f64> = (0..joints).map(|_| draw.signed(8.0, 20.0).to_radians()).collect();
    session.joints(|_, q| q.iter_mut().zip(&angles).for_each(|(q, a)| *q += a));
}

fn homed_again(session: &mut Session, draw: &mut Draw) -> Result<Vec<String>, Error> {
    let joint = 1 + draw.pick(session.joint_names().len() - 1);
    let angle = draw.signed(2.0, 6.0).to_radians();
    session.joints(|at, q| q[joint] += if at.recording >= 1 { angle } else { 0.0 });
    about(session, &[joint])
}

/// The forearm's encoder reads against the room, not against the upper arm.
fn absolute_angle(session: &mut Session, _: &mut Draw) -> Result<Vec<String>, Error> {
    session.joints(|_, q| q[2] += q[1]);
    about(session, &[2])
}

fn speeds(session: &mut Session, _: &mut Draw) {
    for recorded in &mut session.recordings {
        let joints = recorded.log.channels.iter().position(|c| c.topic == JOINTS);
        let mut before: Option<(i64, Vec<f64>)> = None;
        for Message { stamp_ns, payload, .. } in
            recorded.log.messages.iter_mut().filter(|m| Some(m.channel) == joints)
        {
            let Payload::Joints { position, velocity } = payload else { continue };
            let now = position.clone();
            let (then_ns, then) = before.replace((*stamp_ns, now.clone())).unwrap_or((0, now.clone()));
            let seconds = ((*stamp_ns - then_ns) as f64 * 1e-9).max(1e-3);
            *position = now.iter().zip(&then).map(|(now, then)| (now - then) / seconds).collect();
            velocity.clear();
        }
    }
}
