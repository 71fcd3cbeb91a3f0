//! Products of tall matrices.

use matrixmultiply::dgemm;
use nalgebra::{DMatrix, Dyn, Matrix, Storage};

/// Up to this many columns dot products are faster.
const NARROW: usize = 4;
/// Columns to a block of a product with itself.
const BLOCK: usize = 96;

/// `a'b`; by the blocked product where it is large, as nalgebra's `tr_mul` takes one dot product for each entry.
pub fn inner_product<A, B>(a: &Matrix<f64, Dyn, Dyn, A>, b: &Matrix<f64, Dyn, Dyn, B>) -> DMatrix<f64>
where
    A: Storage<f64, Dyn, Dyn>,
    B: Storage<f64, Dyn, Dyn>,
{
    if a.ncols().min(b.ncols()) <= NARROW {
        return a.tr_mul(b);
    }
    assert_eq!(a.nrows(), b.nrows(), "rows of the factors of a'b");
    let (rows, columns) = (a.ncols(), b.ncols());
    let mut product = DMatrix::zeros(rows, columns);
    // A transposed copy, which a product of nalgebra's wants, takes longer than the product where one factor is long.
    let ((down_a, along_a), (down_b, along_b)) = (a.strides(), b.strides());
    #[expect(unsafe_code, reason = "no safe interface reads a transposed factor where it is")]
    // SAFETY: both factors live through the call and have the sizes and strides that they say, of which the inner ones were
    // found equal; the product is another matrix, of rows x columns, one column behind the other.
    unsafe {
        dgemm(
            rows,
            a.nrows(),
            columns,
            1.0,
            a.as_ptr(),
            along_a as isize,
            down_a as isize,
            b.as_ptr(),
            down_b as isize,
            along_b as isize,
            0.0,
            product.as_mut_ptr(),
            1,
            rows as isize,
        );
    }
    product
}

/// `a'a`; where it is large, only the blocks on and above the diagonal are reckoned.
pub fn gram(a: &DMatrix<f64>) -> DMatrix<f64> {
    let columns = a.ncols();
    if columns <= BLOCK {
        return inner_product(a, a);
    }
    let mut product = DMatrix::zeros(columns, columns);
    for from in (0..columns).step_by(BLOCK) {
        let width = BLOCK.min(columns - from);
        let of_block = inner_product(&a.columns(from, width), &a.columns(from, columns - from));
        product.view_mut((from, from), of_block.shape()).copy_from(&of_block);
    }
    product.fill_lower_triangle_with_upper_triangle();
    product
}

#[cfg(test)]
mod tests {
    use super::{BLOCK, gram, inner_product};
    use nalgebra::DMatrix;

    #[test]
    fn a_product_with_itself_is_the_same_by_blocks() {
        for columns in [1, 5, BLOCK, BLOCK + 1, 3 * BLOCK - 2] {
            let a = DMatrix::from_fn(150, columns, |i, j| ((i * 31 + j * 17) as f64).sin());
            let (product, whole) = (gram(&a), inner_product(&a, &a));
            assert_eq!(product, product.transpose());
            assert!((product - whole).amax() < 1e-12 * 150.0, "{columns}");
        }
    }
}
