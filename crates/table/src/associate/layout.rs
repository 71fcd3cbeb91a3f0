//! The board as the search sees it: cavities in the order of their names (so that the order in the file
//! cannot matter), who is next to whom, and a raster that answers "which cavities are near here" at once.

use crate::Board;
use nalgebra::Vector3;
use std::cell::OnceCell;

/// Raster cell [m].
const CELL_M: f64 = 0.002;
/// How far the raster reaches beyond the outermost cavities [m].
const MARGIN_M: f64 = 0.045;
/// Raster cells are made coarser rather than more than this many.
const MOST_CELLS: f64 = 250_000.0;
/// Nearest cavities kept in each cell.
const NEAREST: usize = 4;
/// Cavities within this many times the distance to the nearest are neighbours.
const NEIGHBOUR: f64 = 1.5;
/// Stands in for the spacing of a board with one cavity [m].
const LONE_SPACING_M: f64 = 0.1;

pub(super) struct Layout {
    pub names: Vec<String>,
    pub points_m: Vec<Vector3<f64>>,
    /// Smallest distance between two cavities.
    pub spacing_m: f64,
    /// Height of the lowest cavity and of the highest.
    pub heights_m: [f64; 2],
    /// Volume in which a dwell that belongs to no cavity may lie.
    pub volume_m3: f64,
    neighbours: Vec<Vec<bool>>,
    neighbour_count: Vec<usize>,
    low_m: [f64; 2],
    cell_m: f64,
    columns: usize,
    rows: usize,
    /// Filled where it is asked for: few of its cells ever are.
    cells: Vec<OnceCell<[u32; NEAREST]>>,
    nearest: usize,
}

impl Layout {
    pub fn new(board: &Board) -> Layout {
        let mut cavities: Vec<_> = board.cavities.iter().collect();
        cavities.sort_by(|a, b| a.name.cmp(&b.name));
        let points_m: Vec<Vector3<f64>> = cavities.iter().map(|c| c.in_board_m).collect();
        let n = points_m.len();
        let own_spacing_m: Vec<f64> = (0..n)
            .map(|i| {
                let others = (0..n).filter(|&j| j != i).map(|j| (points_m[i] - points_m[j]).norm());
                others.fold(f64::INFINITY, f64::min)
            })
            .collect();
        let smallest_m = own_spacing_m.iter().copied().fold(f64::INFINITY, f64::min);
        let neighbours: Vec<Vec<bool>> = (0..n)
            .map(|i| {
                let near = |j: usize| (points_m[i] - points_m[j]).norm() <= NEIGHBOUR * own_spacing_m[i];
                (0..n).map(|j| j != i && near(j)).collect()
            })
            .collect();
        let neighbour_count = neighbours.iter().map(|row| row.iter().filter(|&&b| b).count()).collect();
        let bound = |axis: usize, pick: fn(f64, f64) -> f64, from: f64| {
            points_m.iter().map(|p| p[axis]).fold(from, pick)
        };
        let low_m = [0, 1].map(|axis| bound(axis, f64::min, f64::INFINITY) - MARGIN_M);
        let high_m = [0, 1].map(|axis| bound(axis, f64::max, f64::NEG_INFINITY) + MARGIN_M);
        let (width_m, depth_m) = (high_m[0] - low_m[0], high_m[1] - low_m[1]);
        let cell_m = CELL_M.max((width_m * depth_m / MOST_CELLS).sqrt());
        let (columns, rows) = ((width_m / cell_m).ceil() as usize, (depth_m / cell_m).ceil() as usize);
        Layout {
            names: cavities.iter().map(|c| c.name.clone()).collect(),
            spacing_m: if smallest_m.is_finite() { smallest_m } else { LONE_SPACING_M },
            heights_m: [bound(2, f64::min, f64::INFINITY), bound(2, f64::max, f64::NEG_INFINITY)],
            volume_m3: (width_m + 0.1) * (depth_m + 0.1) * 0.3,
            points_m,
            neighbours,
            neighbour_count,
            low_m,
            cell_m,
            columns,
            rows,
            cells: vec![OnceCell::new(); columns * rows],
            nearest: NEAREST.min(n),
        }
    }

    pub fn len(&self) -> usize {
        self.points_m.len()
    }

    /// The nearest cavities beside a point over or under the board; none far from it.
    pub fn near(&self, at_m: &Vector3<f64>) -> &[u32] {
        let column = (at_m.x - self.low_m[0]) / self.cell_m;
        let row = (at_m.y - self.low_m[1]) / self.cell_m;
        if !(column >= 0.0 && row >= 0.0) || column >= self.columns as f64 || row >= self.rows as f64 {
            return &[];
        }
        let cell = row as usize * self.columns + column as usize;
        &self.cells[cell].get_or_init(|| self.nearest_to(cell))[..self.nearest]
    }

    /// The nearest cavity in space, wherever the point is.
    pub fn nearest(&self, at_m: &Vector3<f64>) -> (usize, f64) {
        let distances = self.points_m.iter().map(|c| (at_m - c).norm()).enumerate();
        distances.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, f64::INFINITY))
    }

    pub fn are_neighbours(&self, a: usize, b: usize) -> bool {
        self.neighbours[a][b]
    }

    pub fn neighbour_count(&self, a: usize) -> usize {
        self.neighbour_count[a]
    }

    /// Steps from a cavity to each of its nearest neighbours, each kind of step once.
    pub fn steps_m(&self) -> Vec<Vector3<f64>> {
        let mut steps: Vec<Vector3<f64>> = Vec::new();
        for (i, j) in (0..self.len()).flat_map(|i| (0..self.len()).map(move |j| (i, j))) {
            let step = self.points_m[j] - self.points_m[i];
            let same = |s: &Vector3<f64>| (s - step).norm() < 0.2 * self.spacing_m;
            if self.neighbours[i][j] && !steps.iter().any(same) {
                steps.push(step);
            }
        }
        steps
    }

    /// The cavities nearest to the middle of a cell.
    fn nearest_to(&self, cell: usize) -> [u32; NEAREST] {
        let x = self.low_m[0] + ((cell % self.columns) as f64 + 0.5) * self.cell_m;
        let y = self.low_m[1] + ((cell / self.columns) as f64 + 0.5) * self.cell_m;
        let mut best = [(f64::INFINITY, u32::MAX); NEAREST];
        for (k, c) in self.points_m.iter().enumerate() {
            let square = (c.x - x).powi(2) + (c.y - y).powi(2);
            // The most are further than the last that is kept.
            if square >= best[NEAREST - 1].0 {
                continue;
            }
            let mut entry = (square, k as u32);
            for slot in &mut best {
                if entry.0 < slot.0 {
                    std::mem::swap(slot, &mut entry);
                }
            }
        }
        best.map(|b| b.1)
    }
}
