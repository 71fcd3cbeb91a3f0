//! All boards from above, side by side in one plane, with the error vectors of every visit: before and after what was
//! found. A frame of its own, so that one panel looks straight down on it.

use super::arrows::ramp;
use super::shapes::{Rgba, arrow, disc, entity, note, text};
use super::{Messages, run_start_ns};
use crate::findings::Findings;
use crate::proto::BoardErrors;
use crate::run::Run;
use crate::text::{millimetres, printable};
use armcal_core::Pose;
use foxglove::messages as fox;
use nalgebra::{Translation3, Vector3};

/// The frame the map lies in: x and y are those of the boards.
pub(crate) const FRAME: &str = "board_map";

const INK: Rgba = [0.35, 0.35, 0.35, 1.0];
/// Between two boards [m].
const GAP_M: f64 = 0.08;
/// A panel is so many times as wide as high: a map that is less wide leaves room at its sides.
const WIDE: f64 = 1.6;
/// Sizes as shares of the width of the map, so that they can be read in a panel that shows all of it.
const TEXT_HEIGHT: f64 = 0.02;
const CAVITY_DIAMETER: f64 = 0.004;
const THICKNESS: f64 = 0.0035;

/// One row of vectors on a board, in millimetres.
struct Vectors<'a> {
    title: &'static str,
    x_mm: &'a [f64],
    y_mm: &'a [f64],
    z_mm: &'a [f64],
}

pub(super) fn put(run: &Run, findings: &Findings, out: &mut Messages) {
    let Some(first) = findings.boards.first() else { return };
    let time_ns = run_start_ns(run);
    let extent_m = extent_m(findings);
    let (middle_m, [width_m, height_m]) = middle_and_size_m(findings);
    let width_m = width_m.max(WIDE * height_m);
    let scale = Scale::of(run, findings, width_m);
    let mut entities = Vec::new();
    for (column, board) in findings.boards.iter().enumerate() {
        for (row, vectors) in rows(board).into_iter().enumerate() {
            let centre_m =
                Vector3::new(column as f64 * (extent_m.x + GAP_M), -(row as f64) * (extent_m.y + GAP_M), 0.0);
            entities.push(map(board, &vectors, &centre_m, extent_m.y / 2.0, &scale, time_ns));
        }
    }
    let words = format!(
        "errors along the board (measured minus predicted) x {}\ngreen {} mm, red {} mm and more",
        first.magnification,
        millimetres(scale.small_m),
        millimetres(scale.large_m)
    );
    let mut legend = entity("scale", time_ns);
    let at_m = Vector3::new(middle_m[0], extent_m.y / 2.0 + GAP_M, 0.0);
    legend.texts.push(text(&at_m, TEXT_HEIGHT * width_m, INK, words));
    entities.push(legend);
    for entity in &mut entities {
        entity.frame_id = FRAME.into();
    }
    out.put("/armcal/board_map", time_ns, &fox::SceneUpdate { deletions: Vec::new(), entities });
}

/// Middle of the map, and its width and height [m], for a camera that shows all of it.
pub(crate) fn middle_and_size_m(findings: &Findings) -> ([f64; 3], [f64; 2]) {
    let columns = findings.boards.len().max(1) as f64;
    let rows = findings.boards.first().map_or(1, |b| rows(b).len()).max(1) as f64;
    let step_m = extent_m(findings) + Vector3::new(GAP_M, GAP_M, 0.0);
    let middle_m = [(columns - 1.0) * step_m.x / 2.0, GAP_M / 2.0 - (rows - 1.0) * step_m.y / 2.0, 0.0];
    (middle_m, [columns * step_m.x, rows * step_m.y + GAP_M])
}

/// Width and height of one board [m].
fn extent_m(findings: &Findings) -> Vector3<f64> {
    let large_mm = |v: fn(&BoardErrors) -> &Vec<f64>| {
        findings.boards.iter().flat_map(v).fold(0.0, |most: f64, x| most.max(x.abs()))
    };
    Vector3::new(large_mm(|b| &b.x_mm), large_mm(|b| &b.y_mm), 0.0) * 2e-3
}

fn rows(b: &BoardErrors) -> Vec<Vectors<'_>> {
    let fitted =
        Vectors { title: "calibrated", x_mm: &b.fitted_x_mm, y_mm: &b.fitted_y_mm, z_mm: &b.fitted_z_mm };
    let after = Vectors { title: "after", x_mm: &b.after_x_mm, y_mm: &b.after_y_mm, z_mm: &b.after_z_mm };
    [fitted, after].into_iter().filter(|v| !v.x_mm.is_empty()).collect()
}

fn map(
    board: &BoardErrors,
    v: &Vectors,
    centre_m: &Vector3<f64>,
    half_height_m: f64,
    scale: &Scale,
    time_ns: i64,
) -> fox::SceneEntity {
    let mut map = entity(format!("{}/{}", v.title, board.recording_index), time_ns);
    map.metadata.push(note("recording", &board.recording));
    map.metadata.push(note("magnification", board.magnification));
    for i in 0..v.x_mm.len() {
        let place_m = centre_m + Vector3::new(board.x_mm[i], board.y_mm[i], 0.0) * 1e-3;
        let along_m = Vector3::new(v.x_mm[i], v.y_mm[i], 0.0) * 1e-3 * board.magnification;
        let error_m = Vector3::new(v.x_mm[i], v.y_mm[i], v.z_mm[i]).norm() * 1e-3;
        map.cylinders.push(disc(
            &Pose::from(Translation3::from(place_m)),
            CAVITY_DIAMETER * scale.width_m,
            0.001,
            INK,
        ));
        map.arrows.extend(arrow(
            &place_m,
            &along_m,
            THICKNESS * scale.width_m,
            ramp(scale.small_m, scale.large_m, error_m),
        ));
    }
    let title_m = centre_m + Vector3::new(0.0, half_height_m + GAP_M / 3.0, 0.0);
    let title = format!("{}, {}", printable(&board.recording), v.title);
    map.texts.push(text(&title_m, TEXT_HEIGHT * scale.width_m, INK, title));
    map
}

/// Colours of the map: it starts where the noise ends, and red is the largest calibrated error.
struct Scale {
    small_m: f64,
    large_m: f64,
    /// Width of what the panel shows [m].
    width_m: f64,
}

impl Scale {
    fn of(run: &Run, findings: &Findings, width_m: f64) -> Scale {
        let positive = |x: f64| if x.is_finite() && x > 0.0 { x } else { 1e-6 };
        let small_m = positive(run.calibration.noise_floor_m);
        let largest_mm = findings.course.fitted_mm.iter().copied().fold(0.0, f64::max);
        Scale { small_m, large_m: (largest_mm * 1e-3).max(3.0 * small_m), width_m }
    }
}
