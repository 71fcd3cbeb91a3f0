//! Where the boards lie on their map.

use nalgebra::{Vector2, Vector3};

/// Between two drawings at least [m], and as a share of what is drawn on one: a line of words lies there.
const GAP_M: f64 = 0.01;
const GAP: f64 = 0.2;
/// Lines of words above all.
pub(super) const LEGEND_LINES: usize = 3;
/// Width of the panel of the map over its height: between a laptop's with a sidebar open and with none.
pub(crate) const PANEL: f64 = 1.4;

/// Where each board is drawn: side by side, in as many lines as fill the panel best.
pub(super) struct Grid {
    boards: usize,
    /// Boards in a line.
    across: usize,
    /// Of each board: with the calibrated model, and with what was found.
    rows: usize,
    /// What one drawing takes [m].
    extent_m: Vector2<f64>,
    /// Between two drawings, and of a line of words [m].
    pub gap_m: f64,
}

impl Grid {
    /// `boards` with `rows` drawings each, which take `extent_m`.
    pub fn of(boards: usize, rows: usize, extent_m: Vector2<f64>) -> Grid {
        let (boards, rows) = (boards.max(1), rows.max(1));
        let gap_m = GAP_M.max(GAP * extent_m.max());
        let with = |across| Grid { boards, across, rows, extent_m, gap_m };
        // The camera must be the lower, the better the map has the shape of the panel.
        let seen_from = |grid: &Grid| {
            let [width_m, height_m] = grid.middle_and_size_m().1;
            height_m.max(width_m / PANEL)
        };
        let best = (1..=boards).map(with).min_by(|a, b| seen_from(a).total_cmp(&seen_from(b)));
        best.unwrap_or_else(|| with(1))
    }

    /// Room of one drawing with the gap [m].
    pub fn cell_m(&self) -> Vector2<f64> {
        self.extent_m + Vector2::repeat(self.gap_m)
    }

    fn lines(&self) -> usize {
        self.boards.div_ceil(self.across) * self.rows
    }

    /// Middle of a drawing [m].
    pub fn centre_m(&self, board: usize, row: usize) -> Vector3<f64> {
        let (column, line) = (board % self.across, board / self.across * self.rows + row);
        Vector3::new(column as f64 * self.cell_m().x, -(line as f64) * self.cell_m().y, 0.0)
    }

    /// Middle of the title over a drawing: in the gap above it, so that it lies on no data [m].
    pub fn title_m(&self, board: usize, row: usize) -> Vector3<f64> {
        self.centre_m(board, row) + Vector3::new(0.0, (self.extent_m.y + self.gap_m) / 2.0, 0.0)
    }

    /// Middle of the lines of words above all [m].
    pub fn legend_m(&self) -> Vector3<f64> {
        let above_m = self.extent_m.y / 2.0 + self.gap_m * (1.0 + LEGEND_LINES as f64 / 2.0);
        Vector3::new((self.across as f64 - 1.0) * self.cell_m().x / 2.0, above_m, 0.0)
    }

    /// Middle of the map, and its width and height with the lines of words above it [m].
    pub fn middle_and_size_m(&self) -> ([f64; 3], [f64; 2]) {
        let (across, down) = (self.across as f64, self.lines() as f64);
        let height_m = down * self.cell_m().y + LEGEND_LINES as f64 * self.gap_m;
        let top_m = self.extent_m.y / 2.0 + self.gap_m * (1 + LEGEND_LINES) as f64;
        let middle_m = [(across - 1.0) * self.cell_m().x / 2.0, top_m - height_m / 2.0, 0.0];
        (middle_m, [across * self.cell_m().x, height_m])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boards_lie_so_that_the_panel_is_filled() {
        let across = |boards, rows, x, y| Grid::of(boards, rows, Vector2::new(x, y)).across;
        assert_eq!((across(1, 1, 0.1, 0.1), across(4, 1, 0.12, 0.02), across(3, 2, 0.3, 0.3)), (1, 2, 3));
        let grid = Grid::of(4, 1, Vector2::new(0.12, 0.02));
        assert!((grid.centre_m(3, 0) - Vector3::new(0.144, -0.044, 0.0)).norm() < 1e-12);
        let ([x, y, _], [width_m, height_m]) = grid.middle_and_size_m();
        // From half a cell left of the first to half a cell right of the last; the words are the highest, and nothing is lower
        // than the last drawing.
        assert!((x - width_m / 2.0 + 0.072).abs() < 1e-12);
        assert!(
            (y + height_m / 2.0 - grid.legend_m().y - LEGEND_LINES as f64 / 2.0 * grid.gap_m).abs() < 1e-12
        );
        assert!((y - height_m / 2.0 - (grid.centre_m(3, 0).y - 0.01)).abs() < 1e-12);
        // A title is above its own drawing and below the one above it.
        assert!((grid.title_m(3, 0).y - (grid.centre_m(3, 0).y + 0.01 + grid.gap_m / 2.0)).abs() < 1e-12);
    }
}
