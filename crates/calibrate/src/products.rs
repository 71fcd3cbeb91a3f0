//! Products of tall matrices.

use nalgebra::DMatrix;

/// Up to this many columns dot products are faster than a transposed copy.
const NARROW: usize = 4;

/// `a'b`; by the blocked product where it is large, as nalgebra's `tr_mul` takes one dot product for each entry.
pub fn inner(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    if a.ncols().min(b.ncols()) <= NARROW { a.tr_mul(b) } else { a.transpose() * b }
}
