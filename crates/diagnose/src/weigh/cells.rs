//! The open set: every channel with every driver (notes 4.7 i), and smooth discrepancies (4.7 ii).
//!
//! A *cell* says where an unlisted effect enters and what it depends on: channel columns times functions of the
//! driver, scaled so that one unit moves the tip by `unlisted_effect_mm` rms. A *discrepancy* (Kennedy and O'Hagan
//! 2001) only says what it depends on: three axes of displacement times a kernel over poses, directions, time,
//! recordings or load, low rank. Both are projected like any term, which makes the discrepancy orthogonal to the
//! geometry (Brynjarsdottir and O'Hagan 2014 on why it must be).

use crate::config::DiagnosisConfig;
use crate::enters::{DependsOn, EntersAt};
use crate::problem::{Columns, Problem};
use crate::weigh::drivers::{Driver, drivers, is_varying, mean_and_sd, range, standardised_joints};
use nalgebra::{DMatrix, DVector};
use std::sync::Arc;

/// Most functions of a discrepancy per axis.
const DISCREPANCY_RANK: usize = 24;
/// Most dwells at which its kernel is decomposed.
const ANCHORS: usize = 160;

/// An explanation outside the catalogue.
#[derive(Debug, Clone)]
pub(crate) struct Unlisted {
    /// Index of the channel; none for a discrepancy.
    pub channel: Option<usize>,
    /// Index of the driver; none for a discrepancy.
    pub driver: Option<usize>,
    /// Where it enters.
    pub enters: EntersAt,
    /// What it depends on.
    pub depends: DependsOn,
    /// Columns.
    pub columns: Columns,
    /// SI amplitude (of the channel's unit) of one unit of the columns.
    pub unit_si: f64,
}

impl Unlisted {
    /// Name: `joint1 <- q1`, `displacement <- pose`.
    pub fn name(&self) -> String {
        format!("{} <- {}", self.enters, self.depends)
    }
}

/// Every channel with every driver.
pub(crate) fn cells(problem: &Problem, drivers: &[Driver], config: &DiagnosisConfig) -> Vec<Unlisted> {
    let mut all = Vec::new();
    for (c, channel) in problem.channels.iter().enumerate() {
        let power: Vec<f64> = problem.dwells.iter().map(|d| d.moved_m2(&channel.columns)).collect();
        for (k, driver) in drivers.iter().enumerate() {
            if driver.only_at.is_some_and(|j| channel.enters != EntersAt::Joint(j)) {
                continue;
            }
            let mean: f64 =
                power.iter().enumerate().map(|(i, p)| p * driver.basis.row(i).norm_squared()).sum::<f64>()
                    / power.len() as f64;
            if mean.is_nan() || mean <= 0.0 {
                continue;
            }
            let unit_si = config.unlisted_effect_mm * 1e-3 / mean.sqrt();
            all.push(Unlisted {
                channel: Some(c),
                driver: Some(k),
                enters: channel.enters.clone(),
                depends: driver.what,
                columns: Columns::Product {
                    base: channel.columns.clone(),
                    basis: driver.basis.clone(),
                    size: unit_si,
                },
                unit_si,
            });
        }
    }
    all
}

/// What the unlisted may depend on: the same in all problems that differ in what is fitted alone.
#[derive(Debug)]
pub(crate) struct Dependences {
    /// Drivers of the cells.
    pub drivers: Vec<Driver>,
    /// Of each kind of smooth discrepancy its functions at the dwells.
    smooth: Vec<(DependsOn, Arc<DMatrix<f64>>)>,
}

impl Dependences {
    /// Of the dwells of a problem.
    pub fn of(problem: &Problem) -> Dependences {
        Dependences { drivers: drivers(problem), smooth: discrepancy_functions(problem) }
    }
}

/// Smooth discrepancies over poses, directions, time, recordings and load: displacements that depend on them alone.
pub(crate) fn discrepancies(
    problem: &Problem,
    dependences: &Dependences,
    config: &DiagnosisConfig,
) -> Vec<Unlisted> {
    let base = world_axes(problem);
    let size = config.unlisted_effect_mm * 1e-3 / 3f64.sqrt();
    let of = |(depends, functions): &(DependsOn, Arc<DMatrix<f64>>)| Unlisted {
        channel: None,
        driver: None,
        enters: EntersAt::Displacement,
        depends: *depends,
        columns: Columns::Product { base: base.clone(), basis: functions.clone(), size },
        unit_si: size,
    };
    dependences.smooth.iter().map(of).collect()
}

/// The functions of each kind at the dwells.
fn discrepancy_functions(problem: &Problem) -> Vec<(DependsOn, Arc<DMatrix<f64>>)> {
    let n = problem.dwells.len();
    let pose = pose_kernel(problem);
    let time: Vec<f64> = problem.dwells.iter().map(|d| d.time_s).collect();
    let load: Vec<f64> = problem.dwells.iter().map(|d| d.load_kg).collect();
    let (start, end) = range(&time);
    let span = end - start;
    let mut all = Vec::new();
    let mut add = |depends: DependsOn, kernel: &dyn Fn(usize, usize) -> f64| {
        let functions = low_rank(n, kernel);
        if functions.ncols() > 0 {
            all.push((depends, Arc::new(functions)));
        }
    };
    add(DependsOn::Pose, &|i, j| pose(i, j));
    let moving: Vec<usize> = (0..problem.joints())
        .filter(|j| is_varying(&problem.dwells.iter().map(|d| d.arrival[*j]).collect::<Vec<_>>()))
        .collect();
    if !moving.is_empty() {
        add(DependsOn::Directions, &|i, j| {
            let (a, b) = (&problem.dwells[i].arrival, &problem.dwells[j].arrival);
            let same: f64 = moving.iter().map(|k| a[*k] * b[*k]).sum();
            same / moving.len() as f64 * (0.4 + 0.6 * pose(i, j))
        });
    }
    if span > 0.0 {
        add(DependsOn::Time, &|i, j| (-0.5 * ((time[i] - time[j]) / (0.08 * span)).powi(2)).exp());
    }
    let first = problem.dwells[0].id.recording;
    if problem.dwells.iter().any(|d| d.id.recording != first) {
        add(DependsOn::Recording, &|i, j| {
            let same = problem.dwells[i].id.recording == problem.dwells[j].id.recording;
            if same { 0.3 + 0.7 * pose(i, j) } else { 0.0 }
        });
    }
    if is_varying(&load) {
        let (mean, sd) = mean_and_sd(&load);
        add(DependsOn::Load, &|i, j| {
            (load[i] - mean) * (load[j] - mean) / (sd * sd) * (0.4 + 0.6 * pose(i, j))
        });
    }
    all
}

/// Whitened rows of one metre along each world axis.
fn world_axes(problem: &Problem) -> Arc<DMatrix<f64>> {
    let mut base = DMatrix::zeros(problem.rows(), 3);
    for d in &problem.dwells {
        base.rows_mut(d.first_row, d.rows).copy_from(&d.displaced);
    }
    Arc::new(base)
}

/// Mean of squared-exponential kernels of three lengths over the joints that move, in units of their spread.
fn pose_kernel(problem: &Problem) -> impl Fn(usize, usize) -> f64 {
    let z = standardised_joints(problem);
    let dimensions = (z.ncols() as f64 / 3.0).max(1.0);
    move |i, j| {
        let square = (z.row(i) - z.row(j)).norm_squared() / dimensions;
        // Half a range is about 1.7 standard deviations of a uniform spread.
        [0.15, 0.35, 0.7].iter().map(|l| (-0.5 * square / (l * 1.7f64).powi(2)).exp()).sum::<f64>() / 3.0
    }
}

/// Functions F (n x r) with F F' close to the kernel matrix, by Nystroem from evenly spread dwells.
fn low_rank(n: usize, kernel: &dyn Fn(usize, usize) -> f64) -> DMatrix<f64> {
    let count = n.min(ANCHORS);
    let anchors: Vec<usize> = (0..count).map(|k| k * n / count).collect();
    let m = DMatrix::from_fn(count, count, |i, j| kernel(anchors[i], anchors[j]));
    let eigen = m.symmetric_eigen();
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let keep: Vec<usize> = order
        .into_iter()
        .take(DISCREPANCY_RANK)
        .filter(|k| eigen.eigenvalues[*k] > 1e-6 * count as f64)
        .collect();
    let mut basis = DMatrix::zeros(count, keep.len());
    for (c, k) in keep.iter().enumerate() {
        let scaled: DVector<f64> = eigen.eigenvectors.column(*k) / eigen.eigenvalues[*k].sqrt();
        basis.set_column(c, &scaled);
    }
    let cross = DMatrix::from_fn(n, count, |i, j| kernel(i, anchors[j]));
    cross * basis
}
