//! Tracked poses in other conventions, units and roles.

use super::{Kind, POSES, SEEN, TABLE, whole};
use crate::rigs::{Body, Rig};
use crate::{Draw, Session};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

pub const KINDS: &[Kind] = &[
    whole("quaternion-w-first", "quaternion-order", SEEN, |s, _| change_all_poses(s, |_, q| *q = w_first(q))),
    whole("quaternion-w-first-table", "quaternion-order", TABLE, |s, _| {
        change_body_poses(s, Body::Table, |_, q| *q = w_first(q))
    }),
    whole("quaternion-w-first-base", "quaternion-order", TABLE, |s, _| {
        change_body_poses(s, Body::Base, |_, q| *q = w_first(q))
    }),
    whole("quaternion-conjugate", "quaternion-conjugate", SEEN, |s, _| {
        change_all_poses(s, |_, q| *q = q.conjugate())
    }),
    whole("quaternion-conjugate-table", "quaternion-conjugate", TABLE, |s, _| {
        change_body_poses(s, Body::Table, |_, q| *q = q.conjugate())
    }),
    whole("quaternion-conjugate-base", "quaternion-conjugate", TABLE, |s, _| {
        change_body_poses(s, Body::Base, |_, q| *q = q.conjugate())
    }),
    whole("quaternion-missing", "quaternion-missing", SEEN, |s, _| {
        change_all_poses(s, |_, q| *q = Quaternion::identity())
    }),
    whole("pose-inverted", "pose-inverted", SEEN, |s, _| change_all_poses(s, invert_pose)),
    whole("pose-inverted-table", "pose-inverted", TABLE, |s, _| {
        change_body_poses(s, Body::Table, invert_pose)
    }),
    whole("pose-inverted-base", "pose-inverted", TABLE, |s, _| change_body_poses(s, Body::Base, invert_pose)),
    whole("pose-inverted-tip", "pose-inverted", TABLE, |s, _| change_body_poses(s, Body::Tip, invert_pose)),
    whole("base-and-table-swapped", "frames-swapped", TABLE, |s, _| {
        swap_topics(s, "base", Body::Table, "table", Body::Base)
    }),
    whole("tip-and-base-swapped", "streams-swapped", TABLE, |s, _| {
        swap_topics(s, "tip", Body::Base, "base", Body::Tip)
    }),
    whole("tip-and-table-swapped", "streams-swapped", TABLE, |s, _| {
        swap_topics(s, "tip", Body::Table, "table", Body::Tip)
    }),
    whole("table-is-the-tip", "streams-swapped", TABLE, |s, _| set_topic(s, "table", Body::Tip)),
    whole("base-is-the-table", "frames-swapped", TABLE, |s, _| set_topic(s, "base", Body::Table)),
    whole("tip-is-a-still-body", "streams-swapped", POSES, |s, _| set_topic(s, "tip", Body::Still)),
    whole("axis-mirrored", "axis-mirrored", SEEN, |s, _| change_all_poses(s, |p, _| p.y = -p.y)),
    whole("tip-axis-mirrored", "axis-mirrored", TABLE, |s, _| {
        change_body_poses(s, Body::Tip, |p, _| p.x = -p.x)
    }),
    whole("axes-swapped", "axes-permuted", SEEN, |s, _| change_all_poses(s, |p, _| p.swap_rows(0, 1))),
    whole("tip-axes-cycled", "axes-permuted", SEEN, |s, _| {
        change_body_poses(s, Body::Tip, |p, _| *p = Vector3::new(p.y, p.z, p.x))
    }),
    whole("y-up", "axes-permuted", SEEN, |s, _| change_all_poses(s, y_up)),
    whole("table-y-up", "axes-permuted", TABLE, |s, _| change_body_poses(s, Body::Table, y_up)),
    whole("positions-in-millimetres", "position-unit", SEEN, |s, _| change_all_poses(s, |p, _| *p *= 1e3)),
    whole("positions-declared-millimetres", "position-unit", SEEN, declared_millimetres),
    whole("tip-in-millimetres", "position-unit", TABLE, |s, _| {
        change_body_poses(s, Body::Tip, |p, _| *p *= 1e3)
    }),
    whole("positions-in-inches", "position-unit", SEEN, |s, _| change_all_poses(s, |p, _| *p /= 0.0254)),
    whole("camera-scale-off", "position-scale", SEEN, scale_positions),
    whole("target-point-elsewhere", "target-offset", TABLE, target_elsewhere),
];

type Change = fn(&mut Vector3<f64>, &mut Quaternion<f64>);

fn change_all_poses(session: &mut Session, change: Change) {
    session.all_poses(|_, p, q| change(p, q));
}

fn change_body_poses(session: &mut Session, body: Body, change: Change) {
    session.poses(body, |_, p, q| change(p, q));
}

/// What is read where `w x y z` are written in the places of `x y z w`.
fn w_first(q: &Quaternion<f64>) -> Quaternion<f64> {
    Quaternion::new(q.k, q.w, q.i, q.j)
}

/// The camera in the body's frame.
fn invert_pose(p: &mut Vector3<f64>, q: &mut Quaternion<f64>) {
    let inverse = UnitQuaternion::from_quaternion(*q).inverse();
    (*p, *q) = (-(inverse * *p), *inverse.quaternion());
}

/// Axes as in graphics: y up, z towards the viewer. Position and orientation agree with each other.
fn y_up(p: &mut Vector3<f64>, q: &mut Quaternion<f64>) {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -std::f64::consts::FRAC_PI_2);
    (*p, *q) = (turn * *p, turn.quaternion() * *q);
}

fn set_topic(session: &mut Session, stream: &str, body: Body) {
    let topic = session.topic(body);
    session.set(&["streams", stream, "topic"], topic);
}

fn swap_topics(session: &mut Session, one: &str, a: Body, two: &str, b: Body) {
    set_topic(session, one, a);
    set_topic(session, two, b);
}

fn declared_millimetres(session: &mut Session, _: &mut Draw) {
    let streams: &[&str] = if session.rig == Rig::Table { &["tip", "base", "table"] } else { &["tip"] };
    streams.iter().for_each(|stream| session.set(&["streams", stream, "unit"], "mm"));
}

fn scale_positions(session: &mut Session, draw: &mut Draw) {
    let factor = 1.0 + draw.signed(0.01, 0.04);
    session.all_poses(|_, p, _| *p *= factor);
}

/// The object's origin in the tracking software is a marker, not the tool point.
fn target_elsewhere(session: &mut Session, draw: &mut Draw) {
    let offset = draw.direction() * draw.uniform(0.02, 0.06);
    session.poses(Body::Tip, |_, p, q| *p += UnitQuaternion::from_quaternion(*q) * offset);
}
