//! Products of tall matrices.

use nalgebra::{DMatrix, Dyn, Matrix, Storage};

/// Up to this many columns dot products are faster than a transposed copy.
const NARROW: usize = 4;
/// Columns to a block of a product with itself.
const BLOCK: usize = 96;

/// `a'b`; by the blocked product where it is large, as nalgebra's `tr_mul` takes one dot product for each entry.
pub fn inner<A, B>(a: &Matrix<f64, Dyn, Dyn, A>, b: &Matrix<f64, Dyn, Dyn, B>) -> DMatrix<f64>
where
    A: Storage<f64, Dyn, Dyn>,
    B: Storage<f64, Dyn, Dyn>,
{
    if a.ncols().min(b.ncols()) <= NARROW { a.tr_mul(b) } else { a.transpose() * b }
}

/// `a'a`; where it is large, only the blocks on and above the diagonal are reckoned.
pub fn gram(a: &DMatrix<f64>) -> DMatrix<f64> {
    let columns = a.ncols();
    if columns <= BLOCK {
        return inner(a, a);
    }
    let mut product = DMatrix::zeros(columns, columns);
    for from in (0..columns).step_by(BLOCK) {
        let width = BLOCK.min(columns - from);
        let left = a.columns(from, width).transpose();
        let right = a.columns(from, columns - from);
        product.view_mut((from, from), (width, columns - from)).gemm(1.0, &left, &right, 0.0);
    }
    product.fill_lower_triangle_with_upper_triangle();
    product
}

#[cfg(test)]
mod tests {
    use super::{BLOCK, gram, inner};
    use nalgebra::DMatrix;

    #[test]
    fn a_product_with_itself_is_the_same_by_blocks() {
        for columns in [1, 5, BLOCK, BLOCK + 1, 3 * BLOCK - 2] {
            let a = DMatrix::from_fn(150, columns, |i, j| ((i * 31 + j * 17) as f64).sin());
            let (product, whole) = (gram(&a), inner(&a, &a));
            assert_eq!(product, product.transpose());
            assert!((product - whole).amax() < 1e-12 * 150.0, "{columns}");
        }
    }
}
