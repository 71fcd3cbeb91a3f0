//! What an effect may depend on, as numbers at the dwells, and smooth functions of it.

use crate::enters::DependsOn;
use crate::problem::Problem;
use armcal_calibrate::gram;
use nalgebra::{DMatrix, DVector};
use std::collections::BTreeSet;
use std::sync::Arc;

/// Functions kept for a smooth driver, and for a joint's own angle in detail.
const FUNCTIONS: usize = 8;
const FINE_FUNCTIONS: [usize; 2] = [30, 60];
/// Dwells to each function of a joint's own angle, between those.
const DWELLS_A_FUNCTION: usize = 5;
/// Bins over which the kernel is decomposed.
const BINS: usize = 41;
const FINE_BINS: usize = 121;
/// Lengths of the two kernels, in half ranges (notes 4.7).
const LENGTHS: [f64; 2] = [0.2, 0.5];
/// Lengths for a joint's own angle in detail: gears and encoders err on a short scale.
const FINE_LENGTHS: [f64; 2] = [0.04, 0.12];
/// Lengths for a direction along an angle: wear has the size of the stroke it comes from.
const ALONG_LENGTHS: [f64; 2] = [0.1, 0.4];
const ALONG_FUNCTIONS: usize = 16;
/// Lengths for time: events are shorter.
const TIME_LENGTHS: [f64; 2] = [0.05, 0.3];
const TIME_FUNCTIONS: usize = 20;

/// One driver with the functions of it that a cell uses.
#[derive(Debug, Clone)]
pub(crate) struct Driver {
    /// What varies.
    pub what: DependsOn,
    /// The joint at which alone it enters: of its own angle in detail, and of its direction times functions of its angle, which
    /// is lost motion that is not the same everywhere.
    pub only_at: Option<usize>,
    /// Its value at each dwell; of a direction along an angle, the angle.
    pub value: Vec<f64>,
    /// Functions of it at the dwells: dwells x m.
    pub basis: Arc<DMatrix<f64>>,
    /// Kernel behind a smooth basis, for evaluation between the dwells.
    pub kernel: Option<Kernel>,
}

impl Driver {
    /// One that takes a few values, with functions at the dwells alone.
    fn switched(what: DependsOn, value: Vec<f64>, basis: DMatrix<f64>) -> Driver {
        Driver { what, only_at: None, value, basis: Arc::new(basis), kernel: None }
    }
}

/// All drivers that vary in a problem.
pub(crate) fn drivers(problem: &Problem) -> Vec<Driver> {
    let joints = problem.joints();
    let column = |f: &dyn Fn(&crate::DwellRow) -> f64| -> Vec<f64> { problem.dwells.iter().map(f).collect() };
    let mut all = Vec::new();
    for j in 0..joints {
        all.extend(smooth_driver(DependsOn::Angle(j), None, column(&|d| d.joint_rad[j])));
    }
    for j in 0..joints {
        all.extend(smooth_driver(DependsOn::Angle(j), Some(j), column(&|d| d.joint_rad[j])));
    }
    for j in 1..joints.saturating_sub(1) {
        let value = column(&|d| d.joint_rad[j] + d.joint_rad[j + 1]);
        all.extend(smooth_driver(DependsOn::AngleSum(j), None, value));
    }
    all.extend(smooth_driver(DependsOn::SessionTime, None, column(&|d| d.time_s)));
    let temperatures: Option<Vec<f64>> = problem.dwells.iter().map(|d| d.temperature_c).collect();
    all.extend(temperatures.and_then(|v| smooth_driver(DependsOn::Temperature, None, v)));
    let standard = standardised_joints(problem);
    let with_pose = |value: &[f64]| {
        DMatrix::from_fn(value.len(), joints + 1, |i, k| {
            value[i] * if k == 0 { 1.0 } else { standard[(i, k - 1)] }
        })
    };
    for j in 0..joints {
        let value = column(&|d| d.arrival[j]);
        if is_varying(&value) {
            let basis = with_pose(&value);
            all.push(Driver::switched(DependsOn::Direction(j), value, basis));
            all.extend(direction_along(problem, j));
        }
    }
    let load = column(&|d| d.load_kg);
    if is_varying(&load) {
        let (mean, sd) = mean_and_sd(&load);
        let basis = with_pose(&load.iter().map(|v| (v - mean) / sd).collect::<Vec<_>>());
        all.push(Driver::switched(DependsOn::Load, load, basis));
    }
    let recordings: BTreeSet<usize> = problem.dwells.iter().map(|d| d.id.recording).collect();
    if recordings.len() > 1 {
        let basis = DMatrix::from_fn(problem.dwells.len(), recordings.len(), |i, k| {
            f64::from(recordings.iter().nth(k) == Some(&problem.dwells[i].id.recording))
        });
        let value = column(&|d| d.id.recording as f64);
        all.push(Driver::switched(DependsOn::Recording, value, basis));
    }
    all
}

fn direction_along(problem: &Problem, joint: usize) -> Option<Driver> {
    let angle = problem.dwells.iter().map(|d| d.joint_rad[joint]).collect();
    let mut driver = smooth_driver(DependsOn::AngleByDirection(joint), Some(joint), angle)?;
    for (d, mut row) in problem.dwells.iter().zip(Arc::make_mut(&mut driver.basis).row_iter_mut()) {
        row *= d.arrival[joint];
    }
    Some(driver)
}

/// Joint readings with mean 0 and standard deviation 1; a joint that does not move stays 0.
pub(crate) fn standardised_joints(problem: &Problem) -> DMatrix<f64> {
    let mut all = DMatrix::zeros(problem.dwells.len(), problem.joints());
    for j in 0..problem.joints() {
        let value: Vec<f64> = problem.dwells.iter().map(|d| d.joint_rad[j]).collect();
        let (mean, sd) = mean_and_sd(&value);
        (0..value.len()).for_each(|i| all[(i, j)] = if sd > 1e-9 { (value[i] - mean) / sd } else { 0.0 });
    }
    all
}

pub(crate) fn is_varying(value: &[f64]) -> bool {
    value.iter().any(|v| (v - value[0]).abs() > 1e-9 * (1.0 + value[0].abs()))
}

/// The smallest and the largest value.
pub(crate) fn range(value: &[f64]) -> (f64, f64) {
    let of = value.iter().copied();
    (of.clone().fold(f64::INFINITY, f64::min), of.fold(f64::NEG_INFINITY, f64::max))
}

/// Mean and standard deviation.
pub(crate) fn mean_and_sd(value: &[f64]) -> (f64, f64) {
    let n = value.len().max(1) as f64;
    let mean = value.iter().sum::<f64>() / n;
    (mean, (value.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt())
}

fn smooth_driver(what: DependsOn, only_at: Option<usize>, value: Vec<f64>) -> Option<Driver> {
    if !is_varying(&value) {
        return None;
    }
    let (lengths, bins, functions) = match what {
        DependsOn::SessionTime => (TIME_LENGTHS, FINE_BINS, TIME_FUNCTIONS),
        DependsOn::AngleByDirection(_) => (ALONG_LENGTHS, FINE_BINS, ALONG_FUNCTIONS),
        DependsOn::Angle(_) if only_at.is_some() => {
            let [fewest, most] = FINE_FUNCTIONS;
            (FINE_LENGTHS, FINE_BINS, (value.len() / DWELLS_A_FUNCTION).clamp(fewest, most))
        }
        _ => (LENGTHS, BINS, FUNCTIONS),
    };
    let kernel = Kernel::new(&value, lengths, bins, functions);
    let mut basis = DMatrix::zeros(value.len(), kernel.len());
    for (i, v) in value.iter().enumerate() {
        basis.set_row(i, &kernel.at(*v).transpose());
    }
    Some(Driver { what, only_at, value, basis: Arc::new(basis), kernel: Some(kernel) })
}

/// Leading functions of a mixture of two squared-exponential kernels over the range of the data (Nystroem on a grid,
/// weighted by where the data are), each with the standard deviation the kernel gives it.
#[derive(Debug, Clone)]
pub(crate) struct Kernel {
    centre: f64,
    half: f64,
    lengths: [f64; 2],
    grid: Vec<f64>,
    /// Grid x functions: kernel row at x times this gives the functions at x.
    weights: DMatrix<f64>,
}

impl Kernel {
    fn new(value: &[f64], lengths: [f64; 2], bins: usize, functions: usize) -> Kernel {
        let (low, high) = range(value);
        let (centre, half) = (0.5 * (low + high), 0.5 * (high - low));
        let grid: Vec<f64> = (0..bins).map(|k| -1.0 + 2.0 * k as f64 / (bins - 1) as f64).collect();
        // A floor keeps empty stretches of the range in the basis.
        let mut share = vec![0.02 / bins as f64; bins];
        for v in value {
            let bin = (((v - centre) / half + 1.0) * 0.5 * (bins - 1) as f64).round();
            share[(bin.max(0.0) as usize).min(bins - 1)] += 0.98 / value.len() as f64;
        }
        let root = DVector::from_iterator(bins, share.iter().map(|w| w.sqrt()));
        // What it is worth depends on the distance alone.
        let apart: Vec<f64> = grid.iter().map(|g| kernel(g - grid[0], lengths)).collect();
        let k = DMatrix::from_fn(bins, bins, |i, j| root[i] * root[j] * apart[i.abs_diff(j)]);
        let (worth, vectors) = low_rank_eigen(k);
        let mut order: Vec<usize> = (0..worth.len()).collect();
        order.sort_by(|a, b| worth[*b].total_cmp(&worth[*a]));
        let keep: Vec<usize> = order.into_iter().take(functions).filter(|k| worth[*k] > 1e-6).collect();
        let weights = DMatrix::from_fn(bins, keep.len(), |i, c| {
            root[i] * vectors[(i, keep[c])] / worth[keep[c]].sqrt()
        });
        Kernel { centre, half, lengths, grid, weights }
    }

    /// Number of functions.
    pub fn len(&self) -> usize {
        self.weights.ncols()
    }

    /// The functions at a value of the driver.
    pub fn at(&self, value: f64) -> DVector<f64> {
        let x = (value - self.centre) / self.half;
        let row =
            DVector::from_iterator(self.grid.len(), self.grid.iter().map(|g| kernel(x - g, self.lengths)));
        self.weights.tr_mul(&row)
    }
}

/// Eigenvalues and -vectors of a positive matrix, those of no worth left out where few have any: with `K = L L'` and
/// `L'L v = w v` they are `w` and `L v / sqrt(w)`, which are those of a much smaller matrix.
fn low_rank_eigen(k: DMatrix<f64>) -> (DVector<f64>, DMatrix<f64>) {
    let Some(factor) = pivoted_cholesky(&k) else {
        let whole = k.symmetric_eigen();
        return (whole.eigenvalues, whole.eigenvectors);
    };
    let small = gram(&factor).symmetric_eigen();
    let mut vectors = factor * small.eigenvectors;
    for (mut vector, worth) in vectors.column_iter_mut().zip(small.eigenvalues.iter()) {
        vector /= worth.max(f64::MIN_POSITIVE).sqrt();
    }
    (small.eigenvalues, vectors)
}

/// `L` of `K = L L'` to rounding, by Cholesky's method with the largest pivot first; none of more than half as many columns
/// as rows, which would save nothing.
fn pivoted_cholesky(k: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let most = k.nrows() / 2;
    let (mut left, mut factor) = (k.diagonal(), DMatrix::zeros(k.nrows(), most));
    let rounding = f64::EPSILON * left.sum();
    for c in 0..most {
        let pivot = left.imax();
        if left[pivot] <= rounding {
            return Some(factor.columns(0, c).into_owned());
        }
        let (before, root) = (factor.columns(0, c), left[pivot].sqrt());
        let column = (k.column(pivot) - before * before.row(pivot).transpose()) / root;
        left -= column.component_mul(&column);
        factor.set_column(c, &column);
    }
    None
}

fn kernel(distance: f64, lengths: [f64; 2]) -> f64 {
    lengths.iter().map(|l| 0.5 * (-0.5 * (distance / l).powi(2)).exp()).sum()
}
