//! All boards from above, side by side in one plane, with the error vectors of every visit: before and after what was
//! found. A frame of its own, so that one panel looks straight down on it.

use super::arrows::ramp;
use super::board_grid::{Grid, PANEL};
use super::board_scale::Scale;
use super::shapes::{Rgba, arrow, billboard_text, disc, key_value, scene_entity};
use super::{Messages, run_start_ns};
use crate::findings::Findings;
use armcal_core::robust::percentile;
use armcal_core::{Pose, printable_name};
use armcal_result::Run;
use armcal_result::proto::BoardErrors;
use foxglove::messages as fox;
use nalgebra::{Translation3, Vector2, Vector3};

/// The frame the map lies in: x and y are those of the boards.
pub(crate) const FRAME: &str = "board_map";

const INK: Rgba = [0.35, 0.35, 0.35, 1.0];
/// Sizes as shares of the width of what the panel shows, so that they can be seen where it shows all of it.
const CAVITY_DIAMETER: f64 = 0.004;
const THICKNESS: f64 = 0.0035;
/// Share of the arrows that are drawn within the room of their board.
const MOST: f64 = 0.95;

/// One row of vectors on a board, in millimetres.
struct Vectors<'a> {
    id: &'static str,
    /// What its title has behind the name of the recording.
    title: &'static str,
    x_mm: &'a [f64],
    y_mm: &'a [f64],
    z_mm: &'a [f64],
}

pub(super) fn put(run: &Run, findings: &Findings, out: &mut Messages) {
    let Some(first) = findings.boards.first() else { return };
    let time_ns = run_start_ns(run);
    let grid = map_grid(findings);
    let (_, [width_m, height_m]) = grid.middle_and_size_m();
    let titles: Vec<String> =
        findings.boards.iter().flat_map(|b| vector_rows(b).into_iter().map(|v| board_title(b, &v))).collect();
    let scale = Scale::of(run, findings, width_m.max(PANEL * height_m), (&titles, &grid));
    let words = scale.words(first.magnification);
    let mut entities = Vec::new();
    for (index, board) in findings.boards.iter().enumerate() {
        for (row, vectors) in vector_rows(board).into_iter().enumerate() {
            entities.push(map_entity(
                board,
                &vectors,
                (&grid.centre_m(index, row), &grid.title_m(index, row)),
                &scale,
                time_ns,
            ));
        }
    }
    let mut legend = scene_entity("scale", time_ns);
    legend.texts.push(billboard_text(&grid.legend_m(), scale.text_m, INK, words));
    entities.push(legend);
    for entity in &mut entities {
        entity.frame_id = FRAME.into();
    }
    out.put("/armcal/board_map", time_ns, &fox::SceneUpdate { deletions: Vec::new(), entities });
}

/// Middle of the map, and its width and height [m], for a camera that shows all of it.
pub(crate) fn middle_and_size_m(findings: &Findings) -> ([f64; 3], [f64; 2]) {
    map_grid(findings).middle_and_size_m()
}

fn map_grid(findings: &Findings) -> Grid {
    let each = findings.boards.first().map_or(1, |b| vector_rows(b).len());
    Grid::of(findings.boards.len(), each, extent_m(findings))
}

/// Width and height that one board and its arrows take [m]; the largest few arrows may reach beyond.
fn extent_m(findings: &Findings) -> Vector2<f64> {
    let half_mm = |place: fn(&BoardErrors) -> &[f64], error: for<'b> fn(&Vectors<'b>) -> &'b [f64]| {
        let mut most: f64 = 0.0;
        let mut ends = Vec::new();
        for board in &findings.boards {
            most = place(board).iter().fold(most, |most, x| most.max(x.abs()));
            for vectors in vector_rows(board) {
                let end = |(x, e): (&f64, &f64)| (x + e * board.magnification).abs();
                ends.extend(place(board).iter().zip(error(&vectors)).map(end));
            }
        }
        most.max(percentile(&ends, MOST))
    };
    let (x, y) = (half_mm(|b| &b.x_mm, |v| v.x_mm), half_mm(|b| &b.y_mm, |v| v.y_mm));
    Vector2::new(x, y) * 2e-3
}

fn vector_rows(b: &BoardErrors) -> Vec<Vectors<'_>> {
    let fitted = Vectors {
        id: "calibrated",
        title: "",
        x_mm: &b.fitted_x_mm,
        y_mm: &b.fitted_y_mm,
        z_mm: &b.fitted_z_mm,
    };
    let after = Vectors {
        id: "after",
        title: ", after",
        x_mm: &b.after_x_mm,
        y_mm: &b.after_y_mm,
        z_mm: &b.after_z_mm,
    };
    [fitted, after].into_iter().filter(|v| !v.x_mm.is_empty()).collect()
}

fn map_entity(
    board: &BoardErrors,
    v: &Vectors,
    (centre_m, title_m): (&Vector3<f64>, &Vector3<f64>),
    scale: &Scale,
    time_ns: i64,
) -> fox::SceneEntity {
    let mut map = scene_entity(format!("{}/{}", v.id, board.recording_index), time_ns);
    map.metadata.push(key_value("recording", &board.recording));
    map.metadata.push(key_value("magnification", board.magnification));
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
    map.texts.push(billboard_text(title_m, scale.text_m, INK, board_title(board, v)));
    map
}

fn board_title(board: &BoardErrors, v: &Vectors) -> String {
    printable_name(&board.recording) + v.title
}
