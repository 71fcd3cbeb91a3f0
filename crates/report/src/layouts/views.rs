//! What the 3D panels look at.

use super::spec::View;
use crate::channels::{board_grid, board_map, cloud, places_m, robots};
use crate::findings::Findings;
use armcal_result::{Point, Run, extent};
use nalgebra::{Matrix3, Vector3};

/// Width of the panel of the arm over its height where a sidebar is open on a laptop; a wider one shows more at the sides.
const PANEL: f64 = 1.2;
/// Opening of the camera from top to bottom [deg].
pub(super) const OPENING_DEG: f64 = 45.0;
/// Nearer than this the camera does not go [m].
const NEAREST_M: f64 = 0.5;
/// Around what is there: half of it is what the lines of a legend need above its place.
const MARGIN: f64 = 1.14;
/// Around the map, whose size is known to the line.
const EDGE: f64 = 1.04;
/// Where the camera stands: its angle from the vertical, and its direction about it [deg].
const ANGLES_DEG: [f64; 2] = [60.0, 45.0];

/// The arm and the points it visited.
pub(super) fn world_view(run: &Run, points: &[Point], f: &Findings) -> View {
    let places = places_m(run, points);
    let (target_m, distance_m) = fit_camera(&places);
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
    let posed = run.first_posed().is_some();
    let robots = if posed { vec![robots::NOMINAL, robots::CALIBRATED] } else { Vec::new() };
    View {
        frame: "world",
        target_m: target_m.into(),
        distance_m,
        angles_deg: Some(ANGLES_DEG),
        topics,
        robots,
    }
}

/// Where the camera looks, and from how far all places are just in the picture [m].
fn fit_camera(places: &[Vector3<f64>]) -> (Vector3<f64>, f64) {
    let [phi, theta] = ANGLES_DEG.map(f64::to_radians);
    // The viewers' camera stands in -x and -y for an angle of 45 degrees about the vertical.
    let towards = Vector3::new(-phi.sin() * theta.sin(), -phi.sin() * theta.cos(), phi.cos());
    let right = Vector3::z().cross(&towards).normalize();
    let axes = Matrix3::from_columns(&[right, towards.cross(&right), towards]);
    let seen: Vec<Vector3<f64>> = places.iter().map(|m| axes.tr_mul(m)).collect();
    let Some((low, high)) = extent(seen.iter().copied()) else { return (Vector3::zeros(), NEAREST_M) };
    let middle = (low + high) / 2.0;
    let half_height = (OPENING_DEG.to_radians() / 2.0).tan() / MARGIN;
    let from = |m: &Vector3<f64>| {
        let off = m - middle;
        off.z + (off.x.abs() / PANEL).max(off.y.abs()) / half_height
    };
    let distance_m = seen.iter().map(from).fold(NEAREST_M, f64::max);
    (axes * middle, distance_m)
}

/// All boards from above.
pub(super) fn board_map_view(f: &Findings) -> View {
    let (target_m, [width_m, height_m]) = board_map::middle_and_size_m(f);
    let topics = vec![("/armcal/board_map", true), ("/armcal/scene", false), ("/armcal/arms", false)];
    View {
        frame: board_map::FRAME,
        target_m,
        distance_m: EDGE * height_m.max(width_m / board_grid::PANEL),
        angles_deg: None,
        topics,
        robots: Vec::new(),
    }
}
