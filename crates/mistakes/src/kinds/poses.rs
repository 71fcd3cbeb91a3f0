//! Tracked poses in other conventions, units and roles.

use super::{Kind, POSES, SEEN, TABLE, anything, kind};
use crate::rigs::Rig;
use crate::session::{Body, Session};
use crate::{Draw, Error};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

pub const KINDS: &[Kind] = &[
    kind("quaternion-w-first", "quaternion-order", SEEN, |s, _| every(s, |_, q| *q = w_first(q))),
    kind("quaternion-w-first-table", "quaternion-order", TABLE, |s, _| {
        only(s, Body::Table, |_, q| *q = w_first(q))
    }),
    kind("quaternion-w-first-base", "quaternion-order", TABLE, |s, _| {
        only(s, Body::Base, |_, q| *q = w_first(q))
    }),
    kind("quaternion-conjugate", "quaternion-conjugate", SEEN, |s, _| every(s, |_, q| *q = q.conjugate())),
    kind("quaternion-conjugate-table", "quaternion-conjugate", TABLE, |s, _| {
        only(s, Body::Table, |_, q| *q = q.conjugate())
    }),
    kind("quaternion-conjugate-base", "quaternion-conjugate", TABLE, |s, _| {
        only(s, Body::Base, |_, q| *q = q.conjugate())
    }),
    kind("quaternion-missing", "quaternion-missing", SEEN, |s, _| {
        every(s, |_, q| *q = Quaternion::identity())
    }),
    kind("pose-inverted", "pose-inverted", SEEN, |s, _| every(s, inverted)),
    kind("pose-inverted-table", "pose-inverted", TABLE, |s, _| only(s, Body::Table, inverted)),
    kind("pose-inverted-base", "pose-inverted", TABLE, |s, _| only(s, Body::Base, inverted)),
    kind("pose-inverted-tip", "pose-inverted", TABLE, |s, _| only(s, Body::Tip, inverted)),
    kind("base-and-table-swapped", "frames-swapped", TABLE, |s, _| {
        topics(s, "base", Body::Table, "table", Body::Base)
    }),
    kind("tip-and-base-swapped", "streams-swapped", TABLE, |s, _| {
        topics(s, "tip", Body::Base, "base", Body::Tip)
    }),
    kind("tip-and-table-swapped", "streams-swapped", TABLE, |s, _| {
        topics(s, "tip", Body::Table, "table", Body::Tip)
    }),
    kind("table-is-the-tip", "streams-swapped", TABLE, |s, _| topic(s, "table", Body::Tip)),
    kind("base-is-the-table", "frames-swapped", TABLE, |s, _| topic(s, "base", Body::Table)),
    kind("tip-is-a-still-body", "streams-swapped", POSES, |s, _| topic(s, "tip", Body::Still)),
    kind("axis-mirrored", "axis-mirrored", SEEN, |s, _| every(s, |p, _| p.y = -p.y)),
    kind("tip-axis-mirrored", "axis-mirrored", TABLE, |s, _| only(s, Body::Tip, |p, _| p.x = -p.x)),
    kind("axes-swapped", "axes-permuted", SEEN, |s, _| every(s, |p, _| p.swap_rows(0, 1))),
    kind("tip-axes-cycled", "axes-permuted", SEEN, |s, _| {
        only(s, Body::Tip, |p, _| *p = Vector3::new(p.y, p.z, p.x))
    }),
    kind("y-up", "axes-permuted", SEEN, |s, _| every(s, y_up)),
    kind("table-y-up", "axes-permuted", TABLE, |s, _| only(s, Body::Table, y_up)),
    kind("positions-in-millimetres", "position-unit", SEEN, |s, _| every(s, |p, _| *p *= 1e3)),
    kind("positions-declared-millimetres", "position-unit", SEEN, declared_millimetres),
    kind("tip-in-millimetres", "position-unit", TABLE, |s, _| only(s, Body::Tip, |p, _| *p *= 1e3)),
    kind("positions-in-inches", "position-unit", SEEN, |s, _| every(s, |p, _| *p /= 0.0254)),
    kind("camera-scale-off", "position-scale", SEEN, scale),
    kind("target-point-elsewhere", "target-offset", TABLE, target_elsewhere),
];

type Change = fn(&mut Vector3<f64>, &mut Quaternion<f64>);

fn every(session: &mut Session, change: Change) -> Result<Vec<String>, Error> {
    session.all_poses(|_, p, q| change(p, q));
    anything()
}

fn only(session: &mut Session, body: Body, change: Change) -> Result<Vec<String>, Error> {
    session.poses(body, |_, p, q| change(p, q));
    anything()
}

/// What is read where `w x y z` are written in the places of `x y z w`.
fn w_first(q: &Quaternion<f64>) -> Quaternion<f64> {
    Quaternion::new(q.k, q.w, q.i, q.j)
}

/// The camera in the body's frame.
fn inverted(p: &mut Vector3<f64>, q: &mut Quaternion<f64>) {
    let inverse = UnitQuaternion::from_quaternion(*q).inverse();
    (*p, *q) = (-(inverse * *p), *inverse.quaternion());
}

/// Axes as in graphics: y up, z towards the viewer. Position and orientation agree with each other.
fn y_up(p: &mut Vector3<f64>, q: &mut Quaternion<f64>) {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -std::f64::consts::FRAC_PI_2);
    (*p, *q) = (turn * *p, turn.quaternion() * *q);
}

fn topic(session: &mut Session, stream: &str, body: Body) -> Result<Vec<String>, Error> {
    let topic = session.topic(body);
    session.set(&["streams", stream, "topic"], topic);
    anything()
}

fn topics(session: &mut Session, one: &str, a: Body, two: &str, b: Body) -> Result<Vec<String>, Error> {
    topic(session, one, a)?;
    topic(session, two, b)
}

fn declared_millimetres(session: &mut Session, _: &mut Draw) -> Result<Vec<String>, Error> {
    let streams: &[&str] = if session.rig == Rig::Table { &["tip", "base", "table"] } else { &["tip"] };
    streams.iter().for_each(|stream| session.set(&["streams", stream, "unit"], "mm"));
    anything()
}

fn scale(session: &mut Session, draw: &mut Draw) -> Result<Vec<String>, Error> {
    let factor = 1.0 + draw.signed(0.01, 0.04);
    session.all_poses(|_, p, _| *p *= factor);
    anything()
}

/// The object's origin in the tracking software is a marker, not the tool point.
fn target_elsewhere(session: &mut Session, draw: &mut Draw) -> Result<Vec<String>, Error> {
    let offset = draw.direction() * draw.uniform(0.02, 0.06);
    session.poses(Body::Tip, |_, p, q| *p += UnitQuaternion::from_quaternion(*q) * offset);
    anything()
}
