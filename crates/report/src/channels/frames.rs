//! The transform tree: `tf#/` -> `world` -> `nominal/...` and `calibrated/...`, link by link, and `board/<recording>`.

use super::shapes::{quaternion, vector};
use super::{Messages, WORLD, run_start_ns, timestamp};
use armcal_core::{Dwell, Pose};
use armcal_model::{LinkFrame, Model};
use armcal_result::Run;
use foxglove::messages as fox;
use std::collections::BTreeSet;

/// Rerun's name for the frame that its views look at when nobody tells them: what hangs on it is seen without a blueprint.
const RERUN_ROOT: &str = "tf#/";
/// The board of the recording that is shown.
pub(super) const BOARD: &str = "board";

/// What stands still whether or not the arm ever dwells.
pub(super) fn put_standing(run: &Run, out: &mut Messages) {
    let begin_ns = run_start_ns(run);
    out.put("/armcal/tf", begin_ns, &fox::FrameTransforms { transforms: fixed_transforms(begin_ns) });
}

/// The world, with nothing in it yet.
fn world_transform(time_ns: i64) -> fox::FrameTransform {
    frame_transform(time_ns, RERUN_ROOT, WORLD, &Pose::identity())
}

/// The frames of the arms under a prefix, each in the one that it hangs on.
fn arm_transforms(
    model: &Model,
    prefix: &str,
    p: &[f64],
    joint_rad: &[f64],
    time_ns: i64,
) -> Vec<fox::FrameTransform> {
    let links = links(model, prefix, p, joint_rad);
    let hung = |link: &Link| {
        let parent = link.parent.map_or(WORLD, |parent| links[parent].name.as_str());
        frame_transform(time_ns, parent, &link.name, &link.in_parent)
    };
    links.iter().map(hung).collect()
}

/// The world, and the map of boards beside it.
fn fixed_transforms(time_ns: i64) -> Vec<fox::FrameTransform> {
    vec![world_transform(time_ns), board_map(time_ns)]
}

/// The map of boards is a drawing, so where it lies does not matter.
fn board_map(time_ns: i64) -> fox::FrameTransform {
    frame_transform(time_ns, WORLD, super::board_map::FRAME, &Pose::identity())
}

/// A frame of the arm in the frame that it hangs on, a base in the world.
pub(super) struct Link {
    pub name: String,
    /// That frame, by its place among all; none for a base.
    pub parent: Option<usize>,
    pub in_parent: Pose,
}

/// The frames of the arms under a prefix, in the order of the chain.
pub(super) fn links(model: &Model, prefix: &str, p: &[f64], joint_rad: &[f64]) -> Vec<Link> {
    let mut names = BTreeSet::new();
    let base_from_world = model.base_in_world(p).inverse();
    let frames = model.link_frames(p, joint_rad);
    let link = |frame: &LinkFrame| {
        let mut name = format!("{prefix}/{}", frame.name);
        // A link may be called like the frames around the arm; a frame must not be its own parent.
        while !names.insert(name.clone()) {
            name.push('\'');
        }
        let base_from_parent = frame.parent.map_or(base_from_world, |parent| frames[parent].in_base);
        Link { name, parent: frame.parent, in_parent: base_from_parent.inverse() * frame.in_base }
    };
    frames.iter().map(link).collect()
}

/// The tree in the pose of a dwell, complete.
pub(super) fn put(run: &Run, recording: usize, dwell: &Dwell, time_ns: i64, out: &mut Messages) {
    let fitted = run.calibration.fit.values();
    let mut transforms = fixed_transforms(time_ns);
    for (prefix, p) in [("nominal", &run.calibration.nominal_values), ("calibrated", &fitted)] {
        let (model, p) = run.model.in_recording(recording, p);
        transforms.extend(arm_transforms(model, prefix, &p, &dwell.joint_rad, time_ns));
    }
    if let Some(board) = run.model.board_in_world(&fitted, recording) {
        let name = format!("board/{}", run.recordings[recording].name);
        transforms.push(frame_transform(time_ns, WORLD, &name, &board));
        transforms.push(frame_transform(time_ns, WORLD, BOARD, &board));
    }
    out.put("/armcal/tf", time_ns, &fox::FrameTransforms { transforms });
}

fn frame_transform(time_ns: i64, parent: &str, child: &str, parent_from_child: &Pose) -> fox::FrameTransform {
    fox::FrameTransform {
        timestamp: Some(timestamp(time_ns)),
        parent_frame_id: parent.into(),
        child_frame_id: child.into(),
        translation: Some(vector(&parent_from_child.translation.vector)),
        rotation: Some(quaternion(&parent_from_child.rotation)),
    }
}
