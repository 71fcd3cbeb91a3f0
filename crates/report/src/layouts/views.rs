//! What the 3D panels look at.

use super::spec::View;
use crate::channels::board_map;
use crate::findings::Findings;
use crate::points::Point;
use crate::run::Run;
use nalgebra::Vector3;

/// The arm and the points it visited.
pub(super) fn world(run: &Run, points: &[Point], f: &Findings) -> View {
    let places: Vec<Vector3<f64>> =
        points.iter().map(|p| p.measured_m).filter(|m| m.iter().all(|x| x.is_finite())).collect();
    let centre_m = places.iter().sum::<Vector3<f64>>() / places.len().max(1) as f64;
    let base_m = run.model.base_in_world(&run.calibration.fit.values()).translation.vector;
    let mut topics = vec![
        ("/armcal/scene", true),
        ("/armcal/arms", true),
        ("/armcal/arrows_nominal", false),
        ("/armcal/arrows_calibrated", true),
        ("/armcal/path_measured", true),
        ("/armcal/path_nominal", false),
        ("/armcal/path_calibrated", false),
        ("/armcal/tip_measured", true),
    ];
    if !run.steps.is_empty() {
        topics.push(("/armcal/arrows_after", false));
    }
    if !f.boards.is_empty() {
        // It has a frame of its own and would lie on the floor here.
        topics.push(("/armcal/board_map", false));
    }
    let distance_m = (2.5 * (centre_m - base_m).norm()).clamp(0.5, 20.0);
    View { frame: "world", target_m: centre_m.into(), distance_m, from_above: false, topics }
}

/// All boards from above.
pub(super) fn map(f: &Findings) -> View {
    let (target_m, side_m) = board_map::middle_and_side_m(f);
    let topics = vec![("/armcal/board_map", true), ("/armcal/scene", false), ("/armcal/arms", false)];
    View { frame: board_map::FRAME, target_m, distance_m: 1.3 * side_m, from_above: true, topics }
}
