//! The transform tree: `world` -> `nominal/...` and `calibrated/...`, link by link, and `board/<recording>`.

use super::shapes::{quaternion, vector};
use super::{Messages, WORLD, run_start_ns, timestamp};
use crate::run::Run;
use armcal_core::{Dwell, Pose};
use foxglove::messages as fox;
use std::collections::BTreeSet;

/// What stands still, before the first dwell: the frame of the map of boards.
pub(super) fn put_standing(run: &Run, out: &mut Messages) {
    let begin_ns = run_start_ns(run);
    out.put("/armcal/tf", begin_ns, &fox::FrameTransforms { transforms: vec![board_map(begin_ns)] });
}

/// The map of boards is a drawing, so where it lies does not matter.
fn board_map(time_ns: i64) -> fox::FrameTransform {
    transform(time_ns, WORLD, super::board_map::FRAME, &Pose::identity())
}

/// The tree at one dwell, complete.
pub(super) fn put(run: &Run, recording: usize, dwell: &Dwell, out: &mut Messages) {
    if dwell.joint_rad.len() != run.model.joint_count() {
        return;
    }
    let fitted = run.calibration.fit.values();
    let time_ns = dwell.mid_ns();
    let mut transforms = vec![board_map(time_ns)];
    for (prefix, p) in [("nominal", &run.calibration.nominal_values), ("calibrated", &fitted)] {
        let mut parent_name = WORLD.to_owned();
        let mut names = BTreeSet::new();
        let mut base_from_parent = run.model.base_in_world(p).inverse();
        for (name, base_from_child) in run.model.link_frames_in_base(p, &dwell.joint_rad) {
            let mut child_name = format!("{prefix}/{name}");
            // A link may be called like the frames around the arm; a frame must not be its own parent.
            while !names.insert(child_name.clone()) {
                child_name.push('\'');
            }
            let parent_from_child = base_from_parent.inverse() * base_from_child;
            transforms.push(transform(time_ns, &parent_name, &child_name, &parent_from_child));
            (parent_name, base_from_parent) = (child_name, base_from_child);
        }
    }
    if let Some(board) = run.model.board_in_world(&fitted, recording) {
        let name = format!("board/{}", run.recordings[recording].name);
        transforms.push(transform(time_ns, WORLD, &name, &board));
    }
    out.put("/armcal/tf", time_ns, &fox::FrameTransforms { transforms });
}

fn transform(time_ns: i64, parent: &str, child: &str, parent_from_child: &Pose) -> fox::FrameTransform {
    fox::FrameTransform {
        timestamp: Some(timestamp(time_ns)),
        parent_frame_id: parent.into(),
        child_frame_id: child.into(),
        translation: Some(vector(&parent_from_child.translation.vector)),
        rotation: Some(quaternion(&parent_from_child.rotation)),
    }
}
