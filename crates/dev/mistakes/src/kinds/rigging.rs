//! What was moved, exchanged or said wrongly about the cell.

use super::{ALL, BOARD, Kind, SEEN, TABLE, about_anything, kind, whole};
use crate::rigs::{Body, Rig, Source};
use crate::{Draw, Error, Session, draw};
use armcal_lab::scenario::{Design, Scenario, Size};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use toml::Value;

pub const KINDS: &[Kind] = &[
    kind("one-recording-of-another-arm", "different-arm", ALL, |s, _| record_second_again(s, Source::reseed)),
    kind("one-recording-with-another-tool", "different-tool", ALL, another_tool),
    whole("tool-knocked-in-mid-recording", "different-tool", SEEN, tool_knocked),
    kind("arm-bolted-down-elsewhere", "arm-rebased", ALL, rebase_arm),
    whole("base-markers-knocked", "base-moved", TABLE, base_knocked),
    whole("table-markers-knocked-in-mid-recording", "table-bumped", TABLE, table_knocked),
    whole("camera-knocked", "camera-bumped", SEEN, camera_knocked),
    whole("camera-recalibrated-between-recordings", "camera-bumped", SEEN, camera_recalibrated),
    whole("base-frame-declared-wrong", "frame-declared-wrong", BOARD, base_declared),
    whole("base-markers-turned", "frame-declared-wrong", TABLE, base_turned),
    kind("load-not-declared", "load-undeclared", BOARD, add_load),
    whole("vertical-declared-wrong", "vertical-wrong", SEEN, rotate_vertical),
];

/// The second recording made on the rig with something changed.
fn record_second_again(
    session: &mut Session,
    change: impl FnOnce(&mut Source),
) -> Result<Vec<String>, Error> {
    let mut other = session.recorded_with(change)?;
    session.recordings[1] = other.swap_remove(1);
    about_anything()
}

fn another_tool(session: &mut Session, draw: &mut Draw) -> Result<Vec<String>, Error> {
    let longer_m = draw.signed(0.012, 0.03);
    record_second_again(session, |source| match source {
        Source::Lab(config) => {
            if let Some(tool) = config.arm.rows.last_mut() {
                tool.d_m += longer_m;
            }
        }
        Source::SixAxis(lab) => {
            lab.flange_from_target *= Translation3::new(0.0, 0.004, longer_m);
        }
    })
}

/// A change of pose from a moment within the second recording on.
fn from_moment(
    session: &mut Session,
    draw: &mut Draw,
    body: Body,
    mut change: impl FnMut(&mut Vector3<f64>, &mut Quaternion<f64>),
) {
    let moment_ns = session.moment_ns(1, draw.uniform(0.3, 0.7));
    session.poses(body, |at, p, q| {
        if at.stamp_ns > moment_ns {
            change(p, q);
        }
    });
}

fn tool_knocked(session: &mut Session, draw: &mut Draw) {
    let offset = draw.direction() * draw.uniform(0.003, 0.012);
    from_moment(session, draw, Body::Tip, |p, q| *p += UnitQuaternion::from_quaternion(*q) * offset);
}

fn base_knocked(session: &mut Session, draw: &mut Draw) {
    let offset = draw.direction() * draw.uniform(0.005, 0.02);
    from_moment(session, draw, Body::Base, |p, _| *p += offset);
}

fn table_knocked(session: &mut Session, draw: &mut Draw) {
    let offset = draw.direction() * draw.uniform(0.003, 0.01);
    from_moment(session, draw, Body::Table, |p, _| *p += offset);
}

/// A small motion of the whole camera about a point near the arm.
fn draw_knock(draw: &mut Draw) -> Isometry3<f64> {
    let turn = draw.turn_deg(0.3, 1.0);
    let about = Vector3::new(1.2, -0.4, 0.8);
    let offset = draw.direction() * draw.uniform(0.003, 0.01);
    Isometry3::from_parts(Translation3::from(about + offset - turn * about), turn)
}

fn apply_motion(motion: &Isometry3<f64>, p: &mut Vector3<f64>, q: &mut Quaternion<f64>) {
    *p = motion.rotation * *p + motion.translation.vector;
    *q = motion.rotation.quaternion() * *q;
}

fn camera_knocked(session: &mut Session, draw: &mut Draw) {
    let motion = draw_knock(draw);
    let moment_ns = session.moment_ns(1, draw.uniform(0.3, 0.7));
    session.all_poses(|at, p, q| {
        if at.stamp_ns > moment_ns {
            apply_motion(&motion, p, q);
        }
    });
}

fn camera_recalibrated(session: &mut Session, draw: &mut Draw) {
    let turn = draw.turn_deg(5.0, 40.0);
    let motion = Isometry3::from_parts(Translation3::from(draw.direction() * draw.uniform(0.1, 0.5)), turn);
    session.all_poses(|at, p, q| {
        if at.recording >= 1 {
            apply_motion(&motion, p, q);
        }
    });
}

/// Between recordings, as far as a bench vice lets it.
fn rebase_arm(session: &mut Session, draw: &mut Draw) -> Result<Vec<String>, Error> {
    let offset = draw.direction() * draw.uniform(0.005, 0.015);
    let yaw_deg = draw.signed(0.5, 2.0);
    record_second_again(session, |source| match source {
        Source::Lab(config) => {
            // The board stays in the room, so it moves in the arm's frame.
            let xyz = &mut config.board.in_base.xyz_m;
            xyz.iter_mut().zip(offset.iter()).for_each(|(x, o)| *x -= o);
            config.board.in_base.rpy_deg[2] -= yaw_deg;
        }
        Source::SixAxis(lab) => {
            let turn = UnitQuaternion::from_euler_angles(0.0, 0.0, yaw_deg.to_radians());
            lab.world_from_base *= Isometry3::from_parts(Translation3::from(offset), turn);
        }
    })
}

/// A pose from a drawing of another cell, given as if it were known.
fn base_declared(session: &mut Session, draw: &mut Draw) {
    let xyz = match session.rig {
        Rig::Table => {
            [1.2 + draw.signed(0.02, 0.06), -0.4 + draw.signed(0.02, 0.06), 0.75 + draw.signed(0.01, 0.03)]
        }
        _ => [draw.signed(0.02, 0.06), draw.signed(0.02, 0.06), draw.signed(0.01, 0.03)],
    };
    let rpy = if session.rig == Rig::Table { [0.4, -0.6, 30.0] } else { [0.0, 0.0, 0.0] };
    session.set(&["frames", "base", "at", "xyz_m"], xyz.map(Value::Float).to_vec());
    session.set(&["frames", "base", "at", "rpy_deg"], rpy.map(Value::Float).to_vec());
    session.set(&["frames", "base", "pose"], "given");
    if let Some(Value::Table(base)) = session.pipeline.get_mut("frames").and_then(|f| f.get_mut("base")) {
        base.remove("sigma_mm");
        base.remove("sigma_deg");
    }
    if let Some(Value::Table(streams)) = session.pipeline.get_mut("streams") {
        streams.remove("base");
    }
}

/// The plate with the markers of the base is screwed on a hole further, and a little turned.
fn base_turned(session: &mut Session, draw: &mut Draw) {
    let turn = draw.turn_deg(2.0, 8.0);
    let offset = draw.direction() * draw.uniform(0.01, 0.04);
    session.poses(Body::Base, |_, p, q| {
        *p += UnitQuaternion::from_quaternion(*q) * offset;
        *q *= turn.quaternion();
    });
}

/// An arm that yields, half of its recordings with a load that nobody declared.
fn add_load(session: &mut Session, _: &mut Draw) -> Result<Vec<String>, Error> {
    let Source::Lab(config) = &session.source else { return about_anything() };
    let seed = draw::case_seed(config.seed, "load", session.rig.word());
    let scenario = Scenario { size: Size::Large, ..Scenario::new("compliance", Design::Load, seed) };
    let mut lab = scenario.plant()?.config;
    lab.recordings.truncate(4);
    *session = Session::of_lab(session.rig, lab)?;
    for entry in session.entries().iter_mut().filter_map(Value::as_table_mut) {
        entry.remove("load_kg");
    }
    about_anything()
}

fn rotate_vertical(session: &mut Session, draw: &mut Draw) {
    let turn = draw.turn_deg(60.0, 120.0);
    session.all_poses(|_, p, q| apply_motion(&Isometry3::from_parts(Translation3::identity(), turn), p, q));
    session.set(&["frames", "vertical"], "world");
}
