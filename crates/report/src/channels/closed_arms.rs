//! Two arms as they stand: as drawings, as frames, and as URDF text.

use super::robots::arm_urdf;
use super::scene::{GREEN, GREY, above_m, arm};
use super::shapes::Rgba;
use super::{Messages, frames};
use crate::closed_chain::ClosedRun;
use armcal_core::Dwell;
use armcal_model::Model;
use foxglove::messages as fox;
use nalgebra::Vector3;
use std::iter;

/// The arms as in their first dwell, because a viewer draws nothing before the first message, and as text.
pub(super) fn put_first(run: &ClosedRun, out: &mut Messages) {
    let begin_ns = run.start_ns();
    let Some(dwell) = run.recordings.iter().flat_map(|r| &r.dwells).next() else {
        let transforms = vec![frames::world(begin_ns)];
        return out.put("/armcal/tf", begin_ns, &fox::FrameTransforms { transforms });
    };
    put(run, dwell, begin_ns, out);
    put_robots(run, dwell, out);
}

/// The arms as they stand in a dwell.
pub(super) fn put(run: &ClosedRun, dwell: &Dwell, time_ns: i64, out: &mut Messages) {
    out.put("/armcal/arms", time_ns, &arms(run, dwell, time_ns));
    out.put("/armcal/tf", time_ns, &transforms(run, dwell, time_ns));
}

fn arms(run: &ClosedRun, dwell: &Dwell, time_ns: i64) -> fox::SceneUpdate {
    let drawn = |of: Drawn| arm(&of.name, of.model, of.p, of.rgba, time_ns, of.joint_rad);
    let entities = each(run, dwell, &run.calibration.fit.values(), drawn);
    fox::SceneUpdate { deletions: Vec::new(), entities }
}

/// The frames of both arms, nominal and calibrated.
fn transforms(run: &ClosedRun, dwell: &Dwell, time_ns: i64) -> fox::FrameTransforms {
    let framed = |of: Drawn| frames::arm(of.model, &of.name, of.p, of.joint_rad, time_ns);
    let arms = each(run, dwell, &run.calibration.fit.values(), framed);
    fox::FrameTransforms {
        transforms: iter::once(frames::world(time_ns)).chain(arms.into_iter().flatten()).collect(),
    }
}

/// The same as text that viewers without a layout draw.
fn put_robots(run: &ClosedRun, dwell: &Dwell, out: &mut Messages) {
    let told = |of: Drawn| {
        let topic = format!("/armcal/{}/robot_description", of.name);
        (topic, arm_urdf(of.model, &of.name, of.p, of.joint_rad, of.rgba))
    };
    for (topic, text) in each(run, dwell, &run.calibration.fit.values(), told) {
        out.put_text(&topic, run.start_ns(), &text);
    }
}

/// An arm with its nominal or calibrated parameters in a dwell.
struct Drawn<'a> {
    /// `right/nominal`.
    name: String,
    model: &'a Model,
    p: &'a [f64],
    joint_rad: &'a [f64],
    rgba: Rgba,
}

/// Both arms, nominal and calibrated.
fn each<T>(run: &ClosedRun, dwell: &Dwell, fitted: &[f64], make: impl Fn(Drawn<'_>) -> T) -> Vec<T> {
    let mut made = Vec::new();
    for (index, own) in run.chain.arms().iter().enumerate() {
        let joint_rad = run.of_arm(index, &dwell.joint_rad);
        for (which, p, rgba) in
            [("nominal", &run.calibration.nominal_values[..], GREY), ("calibrated", fitted, GREEN)]
        {
            let (name, p) = (format!("{}/{which}", own.name), run.chain.of_arm(index, p));
            made.push(make(Drawn { name, model: &own.model, p, joint_rad, rgba }));
        }
    }
    made
}

/// Everywhere that the arms go, and the legend above them [m].
pub(crate) fn closed_places_m(run: &ClosedRun) -> Vec<Vector3<f64>> {
    let fitted = run.calibration.fit.values();
    let mut places = Vec::new();
    for dwell in run.recordings.iter().flat_map(|r| &r.dwells) {
        for (index, own) in run.chain.arms().iter().enumerate() {
            let p = run.chain.of_arm(index, &fitted);
            let base = own.model.base_in_world(p);
            let frames = own.model.link_frames_in_base(p, run.of_arm(index, &dwell.joint_rad));
            places.extend(frames.iter().map(|(_, frame)| (base * frame).translation.vector));
        }
    }
    places.retain(|m| m.iter().all(|x| x.is_finite()));
    places.extend(above_m(&places));
    places
}
