//! Where the arm and the measured tips go.

use armcal_result::{Point, Run, extent};
use nalgebra::Vector3;

/// How far the legend is above everything, as a share of its diagonal.
const ABOVE: f64 = 0.05;

/// Everywhere that the arm and the measured tips go, and the legend above them [m].
pub(crate) fn places_m(run: &Run, points: &[Point]) -> Vec<Vector3<f64>> {
    let fitted = run.calibration.fit.values();
    let links = run.recordings.iter().flat_map(|r| run.posed(r)).flat_map(|dwell| {
        let (model, p) = run.model.in_recording(dwell.id.recording, &fitted);
        let base = model.base_in_world(&p);
        let frames = model.link_frames(&p, &dwell.joint_rad);
        frames.into_iter().map(|frame| (base * frame.in_base).translation.vector).collect::<Vec<_>>()
    });
    let bases = (0..run.recordings.len()).map(|recording| run.base_m(&fitted, recording));
    let places = points.iter().map(|p| p.measured_m).chain(links).chain(bases);
    let mut places: Vec<Vector3<f64>> = places.filter(|m| m.iter().all(|x| x.is_finite())).collect();
    places.extend(above_m(&places));
    places
}

/// Over the middle of places, where nothing is in the way [m].
fn above_m(places: &[Vector3<f64>]) -> Option<Vector3<f64>> {
    let (low, high) = extent(places.iter().copied())?;
    Some(((low + high) / 2.0).xy().push(high.z + ABOVE * (high - low).norm()))
}
