//! The directions the data do not determine, chosen so that they are readable.
//!
//! An eigenvector of a zero eigenvalue is any mixture of the physical reasons, so the weak subspace gets a basis of
//! simple directions instead: first the symmetries that the problem itself names, then single parameters that lie in it, then pairs (those with a known physical reason
//! before those of equal unit before the rest), as long as each adds something to those already chosen. What is left
//! is turned by the varimax rotation (Kaiser 1958), which looks for few large shares. The directions are unit vectors
//! in units of the prior; they span the weak subspace but need not be orthogonal.

use crate::objective::axes::Axis;
use crate::objective::problem::Symmetry;
use crate::outcome::UndeterminedDirection;
use crate::precision::describe::{self, Simplicity};
use crate::precision::statistics::Weak;
use armcal_core::Parameter;
use nalgebra::{DMatrix, DVector, Matrix2};

/// Shares below this (of a unit direction) are left out, unless they are needed to cancel a larger one.
const SMALLEST_SHARE: f64 = 0.1;
/// A parameter takes part, however small its share, when it moves the residuals by at least this share of what the
/// most visible one does: a base known to 0.3 mm and a link known to 4 mm cancel each other one to one.
const SMALLEST_EFFECT: f64 = 0.3;
/// A simple direction lies in the weak subspace when at least this share of its square does.
const INSIDE: f64 = 0.98;
/// A direction adds something when at least this share of its square is orthogonal to those chosen.
const NEW: f64 = 0.1;

/// Undetermined directions in words, in the order of their leading parameters.
pub(crate) fn directions(
    undetermined: &[Weak],
    axes: &[Axis],
    parameters: &[Parameter],
    symmetries: &[Symmetry],
) -> Vec<UndeterminedDirection> {
    let of = |weak: &Weak| directions_of(weak, axes, parameters, symmetries);
    let mut found: Vec<(usize, UndeterminedDirection)> = undetermined.iter().flat_map(of).collect();
    found.sort_by_key(|(lead, _)| *lead);
    found.into_iter().map(|(_, direction)| direction).collect()
}

/// The directions among some of the axes, each with the first axis in it.
fn directions_of(
    over: &Weak,
    all_axes: &[Axis],
    parameters: &[Parameter],
    symmetries: &[Symmetry],
) -> Vec<(usize, UndeterminedDirection)> {
    let axes: Vec<Axis> = over.axes.iter().map(|&axis| all_axes[axis]).collect();
    let axes = axes.as_slice();
    let simplicity =
        |i: usize, j: usize| describe::simplicity(&parameters[axes[i].index], &parameters[axes[j].index]);
    let weak = &over.basis;
    let (named, texts): (Vec<DVector<f64>>, Vec<&str>) =
        unseen_symmetries(weak, axes, symmetries).into_iter().unzip();
    let texts = texts.into_iter().map(Some).chain(std::iter::repeat(None));
    simple_basis(weak, named, &simplicity)
        .into_iter()
        .zip(texts)
        .map(|(direction, text)| {
            let shares = shares_of(&direction, &over.information);
            let lead = shares.iter().map(|s| over.axes[s.0]).min().unwrap_or(usize::MAX);
            let in_words = || describe::describe_direction(&shares, axes, parameters, &over.information);
            let mut text = text.map_or_else(in_words, str::to_owned);
            if over.followed {
                text += ", once what each recording has for itself may follow";
            }
            let name = |k: usize| parameters[axes[k].index].name.clone();
            let shares = shares.iter().map(|&(k, v)| (name(k), v)).collect();
            (lead, UndeterminedDirection { shares, text })
        })
        .collect()
}

/// The symmetries that lie in the weak subspace, as unit vectors in units of the prior, independent of each other.
fn unseen_symmetries<'s>(
    weak: &DMatrix<f64>,
    axes: &[Axis],
    symmetries: &'s [Symmetry],
) -> Vec<(DVector<f64>, &'s str)> {
    let mut found: Vec<(DVector<f64>, &str)> = Vec::new();
    let mut spanned: Vec<DVector<f64>> = Vec::new();
    for symmetry in symmetries {
        let change = axes.iter().map(|a| symmetry.direction[a.index] / a.scale);
        let whole = DVector::from_iterator(axes.len(), change);
        let Some(direction) = whole.try_normalize(0.0) else { continue };
        if (weak.transpose() * &direction).norm_squared() < INSIDE {
            continue;
        }
        let rest = orthogonal_part(&direction, &spanned);
        if rest.norm_squared() >= NEW {
            spanned.push(rest.normalize());
            found.push((direction, &symmetry.text));
        }
    }
    found
}

/// What of a direction is orthogonal to those already spanned.
fn orthogonal_part(direction: &DVector<f64>, spanned: &[DVector<f64>]) -> DVector<f64> {
    let mut rest = direction.clone();
    for s in spanned {
        rest.axpy(-s.dot(&rest), s, 1.0);
    }
    rest
}

/// The parameters that matter in a direction, largest share first and positive.
fn shares_of(direction: &DVector<f64>, information: &DMatrix<f64>) -> Vec<(usize, f64)> {
    // What each parameter alone would do to the whitened residuals; below 1 nobody would see it.
    let effect = |k: usize| direction[k].abs() * information[(k, k)].max(0.0).sqrt();
    let largest = (0..direction.len()).map(effect).fold(0.0, f64::max);
    let takes_part = |k: usize| {
        direction[k].abs() >= SMALLEST_SHARE || (largest > 1.0 && effect(k) >= SMALLEST_EFFECT * largest)
    };
    let mut shares: Vec<(usize, f64)> =
        (0..direction.len()).filter(|&k| takes_part(k)).map(|k| (k, direction[k])).collect();
    // Ties (two equal axes) are broken by the model's order, not by rounding.
    shares.sort_by(|a, b| in_millionths(b.1).cmp(&in_millionths(a.1)).then(a.0.cmp(&b.0)));
    let sign = shares.first().map_or(1.0, |s| s.1.signum());
    shares.iter_mut().for_each(|s| s.1 *= sign);
    shares
}

/// Unit vectors spanning the columns of `weak` (orthonormal): the `named` ones, then simple ones.
fn simple_basis(
    weak: &DMatrix<f64>,
    named: Vec<DVector<f64>>,
    simplicity: &dyn Fn(usize, usize) -> Simplicity,
) -> Vec<DVector<f64>> {
    let projector = weak * weak.transpose();
    let mut candidates = Vec::new();
    for i in 0..weak.nrows() {
        if projector[(i, i)] >= INSIDE {
            candidates.push((Simplicity::Single, i, i));
        }
        candidates.extend((i + 1..weak.nrows()).map(|j| (simplicity(i, j), i, j)));
    }
    candidates.sort_unstable();
    let mut spanned: Vec<DVector<f64>> = Vec::new();
    for direction in &named {
        spanned.push(orthogonal_part(direction, &spanned).normalize());
    }
    let mut chosen = named;
    let mut single = vec![false; weak.nrows()];
    for (_, i, j) in candidates {
        if spanned.len() >= weak.ncols() {
            break;
        }
        // Of two chosen parameters every mixture is spanned.
        if i != j && single[i] && single[j] {
            continue;
        }
        let Some(direction) = nearest_weak_direction(&projector, i, j) else { continue };
        let rest = orthogonal_part(&direction, &spanned);
        if rest.norm_squared() >= NEW {
            spanned.push(rest.normalize());
            chosen.push(direction);
            single[i] |= i == j;
        }
    }
    chosen.extend(remaining_directions(weak, &spanned));
    chosen
}

/// The direction of the weak subspace nearest to the span of two parameters (one, if i = j), if it is near enough.
fn nearest_weak_direction(projector: &DMatrix<f64>, i: usize, j: usize) -> Option<DVector<f64>> {
    if i == j {
        return Some(projector.column(i).normalize());
    }
    let block = Matrix2::new(projector[(i, i)], projector[(i, j)], projector[(j, i)], projector[(j, j)]);
    let eigen = block.symmetric_eigen();
    let best = eigen.eigenvalues.imax();
    let direction = eigen.eigenvectors.column(best);
    // A pair in which one partner hardly takes part is a single in disguise.
    if eigen.eigenvalues[best] < INSIDE || direction.abs().min() < SMALLEST_SHARE {
        return None;
    }
    let nearest = projector.column(i) * direction[0] + projector.column(j) * direction[1];
    Some(nearest.normalize())
}

/// What the chosen directions leave of the weak subspace, turned to few large shares.
fn remaining_directions(weak: &DMatrix<f64>, spanned: &[DVector<f64>]) -> Vec<DVector<f64>> {
    if spanned.len() >= weak.ncols() {
        return Vec::new();
    }
    let mut rest = weak.clone();
    for s in spanned {
        rest -= s * (s.transpose() * &rest);
    }
    let svd = rest.svd(true, false);
    let Some(u) = svd.u else { return Vec::new() };
    let mut order: Vec<usize> = (0..svd.singular_values.len()).collect();
    order.sort_by(|&a, &b| svd.singular_values[b].total_cmp(&svd.singular_values[a]));
    order.truncate(weak.ncols() - spanned.len());
    let basis = varimax(u.select_columns(&order));
    basis.column_iter().map(|c| c.into_owned()).collect()
}

/// Size of a share to a millionth, so that equal ones compare equal.
fn in_millionths(share: f64) -> i64 {
    (share.abs() * 1e6).round() as i64
}

/// Rotates the columns of an orthonormal basis so that the variance of their squared entries is largest: Jacobi-like
/// sweeps over pairs of columns with Kaiser's closed-form angle.
fn varimax(mut basis: DMatrix<f64>) -> DMatrix<f64> {
    for _sweep in 0..100 {
        let mut largest: f64 = 0.0;
        for i in 0..basis.ncols() {
            for j in i + 1..basis.ncols() {
                // The sums of u and v, which Kaiser takes off, are zero of orthonormal columns.
                let (mut c, mut d) = (0.0, 0.0);
                for r in 0..basis.nrows() {
                    let (x, y) = (basis[(r, i)], basis[(r, j)]);
                    let (u, v) = (x * x - y * y, 2.0 * x * y);
                    c += u * u - v * v;
                    d += 2.0 * u * v;
                }
                let angle = 0.25 * d.atan2(c);
                let (sin, cos) = angle.sin_cos();
                for r in 0..basis.nrows() {
                    let (x, y) = (basis[(r, i)], basis[(r, j)]);
                    basis[(r, i)] = cos * x + sin * y;
                    basis[(r, j)] = cos * y - sin * x;
                }
                largest = largest.max(angle.abs());
            }
        }
        if largest < 1e-10 {
            break;
        }
    }
    basis
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may stop")]
#[path = "../tests/undetermined.rs"]
pub(crate) mod tests;
