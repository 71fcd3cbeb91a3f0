//! Cholesky's factor of large matrices, and the inverse from it, by blocks: most of the work is products of matrices, which take a
//! tenth of the time of the same work column by column (Golub and Van Loan, *Matrix Computations*, 4th ed., section 4.2.9).

use crate::objective::products::{gram, inner_product};
use nalgebra::{Cholesky, DMatrix, Dyn};

/// Columns to a block. Up to twice as many are left to nalgebra.
const BLOCK: usize = 64;

/// The factor L of a symmetric matrix `a = LL'`, of which the lower half counts; none where it is not positive definite.
pub(crate) fn cholesky(mut a: DMatrix<f64>) -> Option<Cholesky<f64, Dyn>> {
    let n = a.nrows();
    if n <= 2 * BLOCK {
        return a.cholesky();
    }
    for from in (0..n).step_by(BLOCK) {
        let width = BLOCK.min(n - from);
        let rest = from + width;
        let own = a.view((from, from), (width, width)).into_owned().cholesky()?.unpack();
        let below = a.view((rest, from), (n - rest, width)).transpose();
        let below = own.solve_lower_triangular(&below)?;
        for at in (rest..n).step_by(BLOCK) {
            let columns = below.columns(at - rest, BLOCK.min(n - at));
            let product = inner_product(&below.columns(at - rest, n - at), &columns);
            let mut left = a.view_mut((at, at), product.shape());
            left -= product;
        }
        a.view_mut((rest, from), (n - rest, width)).copy_from(&below.transpose());
        a.view_mut((from, from), (width, width)).copy_from(&own);
    }
    Some(Cholesky::pack_dirty(a))
}

/// The inverse of the matrix that was factored.
pub(crate) fn inverse(factor: &Cholesky<f64, Dyn>) -> Option<DMatrix<f64>> {
    let l = factor.l_dirty();
    let n = l.nrows();
    if n <= 2 * BLOCK {
        return Some(factor.inverse());
    }
    // Of L itself first, block row by block row.
    let mut of_l = DMatrix::zeros(n, n);
    for from in (0..n).step_by(BLOCK) {
        let width = BLOCK.min(n - from);
        let own = l.view((from, from), (width, width));
        let own = own.solve_lower_triangular(&DMatrix::identity(width, width))?;
        let before = l.view((from, 0), (width, from)) * of_l.view((0, 0), (from, from));
        of_l.view_mut((from, 0), (width, from)).copy_from(&-(&own * before));
        of_l.view_mut((from, from), (width, width)).copy_from(&own);
    }
    Some(gram(&of_l))
}

#[cfg(test)]
mod tests {
    use super::{BLOCK, cholesky, inverse};
    use nalgebra::DMatrix;

    /// Of a matrix whose columns are of very different sizes, as parameters of different units are.
    fn matrix(n: usize) -> DMatrix<f64> {
        let rows = DMatrix::from_fn(2 * n, n, |i, j| {
            ((i * j * 31 + i * i * 7 + j * j * 17) as f64).sin() * 10_f64.powi(j as i32 % 5)
        });
        rows.tr_mul(&rows) + DMatrix::identity(n, n)
    }

    #[test]
    fn blocks_give_what_nalgebra_gives() {
        for n in [5, 2 * BLOCK, 2 * BLOCK + 1, 4 * BLOCK - 3] {
            let a = matrix(n);
            let (blocked, plain) =
                (cholesky(a.clone()).expect("a factor"), a.clone().cholesky().expect("a factor"));
            let size = a.diagonal().map(f64::sqrt);
            let off = (blocked.l() - plain.l()).abs();
            assert!((0..n).all(|i| off.row(i).amax() <= 1e-11 * size[i]), "{n}");
            let of_a = inverse(&blocked).expect("an inverse");
            let (off, plain) = ((&of_a - plain.inverse()).abs(), plain.inverse().diagonal().map(f64::sqrt));
            assert!((0..n).all(|i| (0..n).all(|j| off[(i, j)] <= 1e-9 * plain[i] * plain[j])), "{n}");
        }
    }

    #[test]
    fn what_is_not_positive_definite_has_no_factor() {
        let mut a = matrix(3 * BLOCK);
        a[(2 * BLOCK + 5, 2 * BLOCK + 5)] = -1.0;
        assert!(cholesky(a).is_none());
    }
}
