//! Normal equations in the shape of an arrow, solved by eliminating each group's own unknowns.
//!
//! With group k's rows `[A_k | B_k]` for its own unknowns x_k and the shared ones s, and a diagonal D of priors and
//! damping, the matrix is `H = sum_k [A_k B_k]'[A_k B_k] + D`. Orthogonal elimination (Golub, Plemmons and Sameh 1988,
//! the square-root form of the Schur complement; Triggs et al. 2000, section 6.1):
//!
//! ```text
//! Q_k' [A_k B_k; sqrt(D_k) 0] = [R_k T_k; 0 S_k],   Q' [S_1; ..; S_n; sqrt(D_s)] = [R; 0]
//! ```
//!
//! so that `R'R` is the Schur complement of the own unknowns, without its squares being formed: work and memory
//! grow with the number of groups. Groups are reduced in their order, so that threads do not change the result.

use crate::objective::products::gram;
use crate::objective::structure::Structure;
use crate::outcome::covariance::{Covariance, Own};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::sync::Arc;

/// Groups whose rows for the shared unknowns are stacked before they are reduced.
const STACKED: usize = 16;

/// The matrix H.
#[derive(Debug, Clone)]
pub(crate) struct Arrow {
    structure: Arc<Structure>,
    /// `[A_k | B_k]` of every group, as the triangle that has the same squares ([`gram_root`]).
    triangles: Arc<Vec<DMatrix<f64>>>,
    /// D, by axis.
    diagonal: DVector<f64>,
}

/// H after elimination, over the unknowns that are not held.
struct Eliminated {
    groups: Vec<EliminatedGroup>,
    /// Axes of s.
    shared: Vec<usize>,
    /// R.
    factor: DMatrix<f64>,
}

struct EliminatedGroup {
    /// Axes of x_k.
    own: Vec<usize>,
    /// R_k.
    factor: DMatrix<f64>,
    /// T_k.
    coupling: DMatrix<f64>,
}

impl Arrow {
    /// `triangles`: one a group, columns in the order of [`Structure::axes`]; see [`gram_root`].
    pub fn new(structure: Arc<Structure>, triangles: Vec<DMatrix<f64>>, diagonal: DVector<f64>) -> Arrow {
        Arrow { structure, triangles: Arc::new(triangles), diagonal }
    }

    /// `H + diag(by)`.
    pub fn damped(&self, by: &DVector<f64>) -> Arrow {
        Arrow { diagonal: &self.diagonal + by, ..self.clone() }
    }

    /// `H d`.
    pub fn times(&self, d: &DVector<f64>) -> DVector<f64> {
        let mut product = self.diagonal.component_mul(d);
        for (group, triangle) in self.triangles.iter().enumerate() {
            let part = DVector::from_iterator(triangle.ncols(), self.structure.axes(group).map(|a| d[a]));
            let image = triangle.tr_mul(&(triangle * part));
            self.structure.axes(group).zip(image.iter()).for_each(|(axis, value)| product[axis] += value);
        }
        product
    }

    /// `H d = right` over the unknowns that are not held, the others zero; `None` where H is singular there.
    pub fn solve_free(&self, right: &DVector<f64>, held: &[bool]) -> Option<DVector<f64>> {
        let eliminated = self.eliminate(1.0, held)?;
        let of = |axes: &[usize]| DVector::from_iterator(axes.len(), axes.iter().map(|&a| right[a]));
        let mut reduced = of(&eliminated.shared);
        let mut halves = Vec::with_capacity(eliminated.groups.len());
        for group in &eliminated.groups {
            let half = group.factor.tr_solve_upper_triangular(&of(&group.own))?;
            reduced -= group.coupling.tr_mul(&half);
            halves.push(half);
        }
        let shared = eliminated
            .factor
            .solve_upper_triangular(&eliminated.factor.tr_solve_upper_triangular(&reduced)?)?;
        let mut solution = DVector::zeros(right.len());
        let mut put = |axes: &[usize], values: &DVector<f64>| {
            axes.iter().zip(values.iter()).for_each(|(&axis, value)| solution[axis] = *value);
        };
        put(&eliminated.shared, &shared);
        for (group, half) in eliminated.groups.iter().zip(halves) {
            put(&group.own, &group.factor.solve_upper_triangular(&(half - &group.coupling * &shared))?);
        }
        Some(solution)
    }

    /// `(data sum_k [A_k B_k]'[A_k B_k] + D)^-1`; `None` where that is singular.
    pub fn inverse(&self, data: f64) -> Option<Covariance> {
        let count = self.diagonal.len();
        let Eliminated { groups, shared, factor } = self.eliminate(data.sqrt(), &vec![false; count])?;
        let inverse_of = |factor: &DMatrix<f64>| {
            factor.solve_upper_triangular(&DMatrix::identity(factor.nrows(), factor.nrows()))
        };
        let mut own = Vec::with_capacity(groups.len());
        for group in groups {
            let inverse = inverse_of(&group.factor)?;
            let gain = -(&inverse * group.coupling);
            own.push(Own { index: group.own, conditional: &inverse * inverse.transpose(), gain });
        }
        let inverse = inverse_of(&factor)?;
        Some(Covariance::new(count, shared, &inverse * inverse.transpose(), own))
    }

    /// The squares `[A_k B_k]'[A_k B_k]` of a group: own, own with shared, shared.
    pub fn squares(&self, group: usize) -> [DMatrix<f64>; 3] {
        let own = self.structure.groups[group].own.len();
        let triangle = &self.triangles[group];
        let [a, b] = [triangle.columns(0, own), triangle.columns(own, triangle.ncols() - own)];
        [a.tr_mul(&a), a.tr_mul(&b), b.tr_mul(&b)]
    }

    pub fn structure(&self) -> &Structure {
        &self.structure
    }

    /// `sum_k [A_k B_k]'[A_k B_k]` as one matrix.
    pub fn dense_squares(&self) -> DMatrix<f64> {
        let mut dense = DMatrix::zeros(self.diagonal.len(), self.diagonal.len());
        for (group, triangle) in self.triangles.iter().enumerate() {
            let squares = triangle.tr_mul(triangle);
            for (c, column) in self.structure.axes(group).enumerate() {
                for (r, row) in self.structure.axes(group).enumerate() {
                    dense[(row, column)] += squares[(r, c)];
                }
            }
        }
        dense
    }

    /// Diagonal of [`Arrow::dense_squares`].
    pub fn square_diagonal(&self) -> DVector<f64> {
        let mut diagonal = DVector::zeros(self.diagonal.len());
        for (group, triangle) in self.triangles.iter().enumerate() {
            let squares = triangle.column_iter().map(|column| column.norm_squared());
            self.structure.axes(group).zip(squares).for_each(|(axis, square)| diagonal[axis] += square);
        }
        diagonal
    }

    /// `weight` multiplies the rows of the data.
    fn eliminate(&self, weight: f64, held: &[bool]) -> Option<Eliminated> {
        let shared: Vec<usize> = self.structure.shared.iter().copied().filter(|&a| !held[a]).collect();
        let parts: Vec<(EliminatedGroup, DMatrix<f64>)> = (0..self.triangles.len())
            .into_par_iter()
            .map(|group| self.eliminate_group(group, weight, held))
            .collect();
        let (groups, rest): (Vec<EliminatedGroup>, Vec<DMatrix<f64>>) = parts.into_iter().unzip();
        let stacks: Vec<DMatrix<f64>> =
            rest.par_chunks(STACKED).map(|rows| triangular_factor(stack_rows(rows))).collect();
        let prior = DVector::from_iterator(shared.len(), shared.iter().map(|&a| self.diagonal[a].sqrt()));
        let mut factor = DMatrix::from_diagonal(&prior);
        for rows in stacks {
            factor = triangular_factor(stack_rows(&[factor, rows]));
        }
        let regular = |r: &DMatrix<f64>| r.diagonal().iter().all(|v| v.is_finite() && *v != 0.0);
        let all_regular = regular(&factor) && groups.iter().all(|group| regular(&group.factor));
        all_regular.then_some(Eliminated { groups, shared, factor })
    }

    /// R_k and T_k of a group, and S_k.
    fn eliminate_group(&self, group: usize, weight: f64, held: &[bool]) -> (EliminatedGroup, DMatrix<f64>) {
        let rows = &self.triangles[group];
        let free: Vec<(usize, usize)> =
            self.structure.axes(group).enumerate().filter(|(_, axis)| !held[*axis]).collect();
        let count = self.structure.groups[group].own.len();
        let own: Vec<usize> = free.iter().filter(|(c, _)| *c < count).map(|(_, axis)| *axis).collect();
        let known = rows.nrows();
        let mut augmented = DMatrix::zeros(known + own.len(), free.len());
        for (to, (from, _)) in free.iter().enumerate() {
            augmented.view_mut((0, to), (known, 1)).copy_from(&(rows.column(*from) * weight));
        }
        for (k, &axis) in own.iter().enumerate() {
            augmented[(known + k, k)] = self.diagonal[axis].sqrt();
        }
        if own.is_empty() {
            let nothing = DMatrix::zeros(0, 0);
            let coupling = DMatrix::zeros(0, free.len());
            return (EliminatedGroup { own, factor: nothing, coupling }, augmented);
        }
        let reduced = triangular_factor(augmented);
        let (n, shared) = (own.len(), free.len() - own.len());
        let rest = reduced.nrows().saturating_sub(n);
        let eliminated = EliminatedGroup {
            own,
            factor: reduced.view((0, 0), (n, n)).into_owned(),
            coupling: reduced.view((0, n), (n, shared)).into_owned(),
        };
        (eliminated, reduced.view((n, n), (rest, shared)).into_owned())
    }
}

/// A square root of `m'm`: an upper triangle R with `R'R = m'm`. Very tall matrices go through their product with themselves, which
/// takes a fraction of the time and is as exact as that of a [`super::Curvature::Dense`]. Where columns depend on each other, its diagonal is raised by
/// what its own rounding may have taken from it (Higham, Accuracy and Stability of Numerical Algorithms, 2002, theorem 10.7).
pub(crate) fn gram_root(m: DMatrix<f64>) -> DMatrix<f64> {
    if is_tall(m.nrows(), m.ncols()) { root_of(gram(&m), m.nrows(), || m) } else { triangular_factor(m) }
}

/// [`gram_root`] of the squares of so many rows; the rows themselves where their squares have none.
pub(crate) fn root_of(squares: DMatrix<f64>, rows: usize, m: impl FnOnce() -> DMatrix<f64>) -> DMatrix<f64> {
    let raised = || {
        let mut raised = squares.clone();
        let rounding = squares.ncols() as f64 * (2.0 + (rows as f64).sqrt()) * f64::EPSILON;
        let up = |square: f64| (square * (1.0 + rounding)).max(f64::MIN_POSITIVE);
        (0..squares.ncols()).for_each(|k| raised[(k, k)] = up(raised[(k, k)]));
        raised.cholesky()
    };
    let factor = squares.clone().cholesky().or_else(raised);
    factor.map_or_else(|| triangular_factor(m()), |factor| factor.unpack().transpose())
}

/// Whether a matrix is so tall that its root goes through its squares.
pub(crate) fn is_tall(rows: usize, columns: usize) -> bool {
    rows >= TALL * columns
}

/// From so many rows a column on reflections are most of the time of a fit.
const TALL: usize = 16;

/// Rows, for each column, that a triangle takes up at once: so much stays in the processor's cache.
const ROWS_A_COLUMN: usize = 3;

/// The upper triangle R with `R'R = m'm` (Householder); no more rows than `m`. Of a tall matrix piece by piece, each below the
/// triangle of those before it (Demmel, Grigori, Hoemmen, Langou, SIAM J. Sci. Comput. 34, 2012: sequential TSQR).
pub(crate) fn triangular_factor(m: DMatrix<f64>) -> DMatrix<f64> {
    if m.nrows() == 0 || m.ncols() == 0 {
        return m;
    }
    let step = ROWS_A_COLUMN * m.ncols();
    if m.nrows() < 2 * step {
        return m.qr().unpack_r();
    }
    let mut r = m.rows(0, step).into_owned().qr().unpack_r();
    for from in (step..m.nrows()).step_by(step) {
        let piece = m.rows(from, step.min(m.nrows() - from));
        r = stack_rows(&[r, piece.into_owned()]).qr().unpack_r();
    }
    r
}

fn stack_rows(parts: &[DMatrix<f64>]) -> DMatrix<f64> {
    let columns = parts.first().map_or(0, DMatrix::ncols);
    let mut all = DMatrix::zeros(parts.iter().map(DMatrix::nrows).sum(), columns);
    let mut at = 0;
    for part in parts {
        all.rows_mut(at, part.nrows()).copy_from(part);
        at += part.nrows();
    }
    all
}

#[cfg(test)]
mod tests {
    use super::{gram_root, triangular_factor};
    use nalgebra::DMatrix;

    /// Through the product as by reflections, of columns in any units, one of which is the sum of others and one nothing.
    #[test]
    fn a_root_has_the_squares_of_its_matrix() {
        let mut m = DMatrix::from_fn(400, 9, |i, j| ((i * 31 + j * j * 17) as f64).sin());
        m.column_iter_mut().enumerate().for_each(|(j, mut column)| column *= 10_f64.powi(j as i32 - 4));
        m.set_column(7, &(m.column(1) + m.column(2)));
        m.column_mut(8).fill(0.0);
        let squares = m.tr_mul(&m);
        for r in [gram_root(m.clone()), triangular_factor(m.clone())] {
            assert_eq!((r.shape(), &r), ((9, 9), &r.upper_triangle()));
            let off = r.tr_mul(&r) - &squares;
            let size = squares.diagonal().map(f64::sqrt);
            let of_size = off.zip_map(&(&size * size.transpose()), |off, size| off.abs() - 1e-12 * size);
            assert!(of_size.max() <= f64::MIN_POSITIVE, "{of_size}");
        }
    }
}
