//! What the 3D panels look at.

use super::spec::View;
use crate::channels::{board_map, cloud, robots};
use crate::findings::Findings;
use crate::points::{Point, extent};
use crate::run::Run;

/// From how many diagonals of what is there the camera looks at it: with its opening of 45 degrees all of it is seen.
const AWAY: f64 = 1.1;
/// Around a map.
const MARGIN: f64 = 1.05;
/// Width of the map's panel over its height on a laptop; a wider one shows more at the sides.
const PANEL: f64 = 2.2;

/// The arm and the points it visited.
pub(super) fn world(run: &Run, points: &[Point], f: &Findings) -> View {
    let fitted = run.calibration.fit.values();
    let base = run.model.base_in_world(&fitted);
    let arm =
        run.first_posed().map_or_else(Vec::new, |d| run.model.link_frames_in_base(&fitted, &d.joint_rad));
    let links = arm.iter().map(|(_, frame)| (base * frame).translation.vector);
    let places = points
        .iter()
        .map(|p| p.measured_m)
        .chain(links)
        .chain([base.translation.vector])
        .filter(|m| m.iter().all(|x| x.is_finite()));
    let (low, high) = extent(places).unwrap_or_default();
    let (target_m, distance_m) = ((low + high) / 2.0, (AWAY * (high - low).norm()).clamp(0.5, 20.0));
    let mut topics = vec![
        ("/armcal/scene", true),
        ("/armcal/arms", true),
        ("/armcal/arrows_nominal", false),
        ("/armcal/arrows_calibrated", true),
        ("/armcal/path_measured", false),
        ("/armcal/path_nominal", false),
        ("/armcal/path_calibrated", false),
        ("/armcal/tip_measured", true),
        (cloud::TOPIC, true),
    ];
    if !run.steps.is_empty() {
        topics.push(("/armcal/arrows_after", false));
    }
    if !f.boards.is_empty() {
        // It has a frame of its own and would lie on the floor here.
        topics.push(("/armcal/board_map", false));
    }
    let robots = if arm.is_empty() { Vec::new() } else { vec![robots::NOMINAL, robots::CALIBRATED] };
    View { frame: "world", target_m: target_m.into(), distance_m, from_above: false, topics, robots }
}

/// All boards from above.
pub(super) fn map(f: &Findings) -> View {
    let (target_m, [width_m, height_m]) = board_map::middle_and_size_m(f);
    let topics = vec![("/armcal/board_map", true), ("/armcal/scene", false), ("/armcal/arms", false)];
    View {
        frame: board_map::FRAME,
        target_m,
        distance_m: MARGIN * height_m.max(width_m / PANEL),
        from_above: true,
        topics,
        robots: Vec::new(),
    }
}
