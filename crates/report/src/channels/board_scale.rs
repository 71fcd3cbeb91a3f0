//! Colours and sizes on the map of the boards.

use super::arrows::POINTS;
use super::board_grid::Grid;
use crate::findings::Findings;
use armcal_core::units::format_mm;
use armcal_result::Run;

/// Height of text as a share of the line that it lies in, where it is not too wide.
const TEXT_HEIGHT: f64 = 0.75;
/// Width of a letter over its height.
const LETTER: f64 = 0.62;

/// Share of the width that the words above all may take: the viewers' buttons stand in the upper corner.
const LEGEND_WIDTH: f64 = 0.84;

/// Green is where the noise ends, and red the largest calibrated error.
pub(super) struct Scale {
    pub small_m: f64,
    pub large_m: f64,
    /// Width of what the panel shows [m].
    pub width_m: f64,
    /// Height of text [m].
    pub text_m: f64,
}

impl Scale {
    /// For a panel that shows `width_m`, and the titles of drawings in a grid.
    pub fn of(run: &Run, findings: &Findings, width_m: f64, (titles, grid): (&[String], &Grid)) -> Scale {
        let positive = |x: f64| if x.is_finite() && x > 0.0 { x } else { 1e-6 };
        let small_m = positive(run.calibration.noise_floor_m);
        let largest_mm = findings.course.fitted_mm.iter().copied().fold(0.0, f64::max);
        let large_m = (largest_mm * 1e-3).max(3.0 * small_m);
        let mut scale = Scale { small_m, large_m, width_m, text_m: TEXT_HEIGHT * grid.gap_m };
        let fits = |room_m: f64, line: &str| room_m / (LETTER * line.chars().count().max(1) as f64);
        let words = scale.words(findings.boards.first().map_or(1.0, |b| b.magnification));
        let lines = words.lines().map(|line| fits(LEGEND_WIDTH * width_m, line));
        scale.text_m =
            titles.iter().map(|title| fits(grid.cell_m().x, title)).chain(lines).fold(scale.text_m, f64::min);
        scale
    }

    /// The scale in words, in as many lines as the grid has room for: the longest says how large they can be.
    pub fn words(&self, magnification: f64) -> String {
        // In two lines, so that its letters can be large.
        let (from, to) = POINTS.split_once(" to ").unwrap_or((POINTS, ""));
        format!(
            "errors x {magnification}, {from}\n\
             to {to}\n\
             green {} mm, red {} mm and more",
            format_mm(self.small_m),
            format_mm(self.large_m)
        )
    }
}
