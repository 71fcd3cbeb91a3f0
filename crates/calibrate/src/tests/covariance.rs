use crate::outcome::covariance::{Covariance, Own};
use nalgebra::{DMatrix, DVector};

/// Seven parameters: two shared at 4 and 1, a group at 0 and 6, a group at 3; 2 and 5 are fixed.
struct Parts {
    shared: DMatrix<f64>,
    conditional: [DMatrix<f64>; 2],
    gain: [DMatrix<f64>; 2],
}

const SHARED: [usize; 2] = [4, 1];
const FIRST: [usize; 2] = [0, 6];
const SECOND: [usize; 1] = [3];

fn parts() -> Parts {
    Parts {
        shared: DMatrix::from_row_slice(2, 2, &[4.0, 1.0, 1.0, 3.0]),
        conditional: [
            DMatrix::from_row_slice(2, 2, &[2.0, -0.5, -0.5, 1.0]),
            DMatrix::from_row_slice(1, 1, &[0.7]),
        ],
        gain: [
            DMatrix::from_row_slice(2, 2, &[0.5, -1.0, 2.0, 0.25]),
            DMatrix::from_row_slice(1, 2, &[-3.0, 0.4]),
        ],
    }
}

fn covariance() -> Covariance {
    let Parts { shared, conditional: [k0, k1], gain: [g0, g1] } = parts();
    let own = vec![
        Own { index: FIRST.to_vec(), conditional: k0, gain: g0 },
        Own { index: SECOND.to_vec(), conditional: k1, gain: g1 },
    ];
    Covariance::new(7, SHARED.to_vec(), shared, own)
}

/// The same by the definition: every parameter is a row of a linear map of independent draws (s, e_1, e_2), where
/// x_k = G_k s + e_k.
fn by_definition() -> DMatrix<f64> {
    let p = parts();
    let mut draws = DMatrix::zeros(5, 5);
    draws.view_mut((0, 0), (2, 2)).copy_from(&p.shared);
    draws.view_mut((2, 2), (2, 2)).copy_from(&p.conditional[0]);
    draws.view_mut((4, 4), (1, 1)).copy_from(&p.conditional[1]);
    let mut map = DMatrix::zeros(7, 5);
    for (at, &index) in SHARED.iter().enumerate() {
        map[(index, at)] = 1.0;
    }
    for (at, &index) in FIRST.iter().enumerate() {
        map.view_mut((index, 0), (1, 2)).copy_from(&p.gain[0].row(at));
        map[(index, 2 + at)] = 1.0;
    }
    map.view_mut((SECOND[0], 0), (1, 2)).copy_from(&p.gain[1].row(0));
    map[(SECOND[0], 4)] = 1.0;
    &map * draws * map.transpose()
}

fn assert_close(a: &DMatrix<f64>, b: &DMatrix<f64>) {
    assert_eq!(a.shape(), b.shape());
    assert!((a - b).amax() < 1e-12, "{a}{b}");
}

#[test]
fn a_covariance_in_parts_is_that_of_the_linear_map_it_stands_for() {
    let (covariance, dense) = (covariance(), by_definition());
    assert_close(&covariance.dense(), &dense);
    assert!((covariance.variances() - dense.diagonal()).amax() < 1e-12);
    let index = [6, 1, 2, 3];
    let block = DMatrix::from_fn(4, 4, |r, c| dense[(index[r], index[c])]);
    assert_close(&covariance.block(&index), &block);
    assert_eq!((covariance.get(2, 2), covariance.get(5, 4)), (0.0, 0.0));
    assert_eq!((covariance.len(), covariance.is_empty()), (7, false));
}

#[test]
fn a_covariance_of_no_parameter_is_empty_and_a_dense_one_is_itself() {
    let none = Covariance::from(DMatrix::zeros(0, 0));
    assert_eq!((none.len(), none.is_empty()), (0, true));
    let m = DMatrix::from_row_slice(2, 2, &[2.0, 0.3, 0.3, 5.0]);
    let dense = Covariance::from(m.clone());
    assert_eq!((dense.dense(), dense.is_empty()), (m, false));
}

/// In other units a covariance is `D S D`, whatever the parts it is kept in, and rows go where they are sent.
#[test]
fn units_and_order_change_rows_and_columns_alike() {
    let unit = [1e3, 0.5, 1.0, 57.3, 2.0, 1.0, 0.1];
    let to = |k: usize| (8 - k, unit[k]);
    let rescaled = covariance().rescaled(9, &to);
    let dense = by_definition();
    let mut expected = DMatrix::zeros(9, 9);
    for r in 0..7 {
        for c in 0..7 {
            expected[(8 - r, 8 - c)] = unit[r] * unit[c] * dense[(r, c)];
        }
    }
    assert_eq!(rescaled.len(), 9);
    let error = (rescaled.dense() - &expected).component_div(&expected.map(|v| v.abs().max(1.0))).amax();
    assert!(error < 1e-12, "{error}");
}

/// Parameters fixed here and known to a fit of their own, once with own groups and once without: they are independent of
/// everything that was free.
#[test]
fn adopted_parameters_are_independent_of_what_was_free() {
    let mut covariance = covariance();
    let before = by_definition();
    let frozen = Covariance::new(
        7,
        vec![5],
        DMatrix::from_row_slice(1, 1, &[9.0]),
        vec![Own {
            index: vec![2],
            conditional: DMatrix::from_row_slice(1, 1, &[0.5]),
            gain: DMatrix::from_row_slice(1, 1, &[2.0]),
        }],
    );
    covariance.adopt(&frozen);
    let mut expected = before;
    (expected[(5, 5)], expected[(2, 2)]) = (9.0, 2.0 * 9.0 * 2.0 + 0.5);
    assert_close(&covariance.dense(), &expected);

    // Two at once keep their correlation; nothing to adopt changes nothing.
    let mut of_two = Covariance::new(3, vec![1], DMatrix::identity(1, 1), Vec::new());
    of_two.adopt(&Covariance::new(3, vec![], DMatrix::zeros(0, 0), Vec::new()));
    assert_eq!(of_two.variances(), DVector::from_vec(vec![0.0, 1.0, 0.0]));
    of_two.adopt(&Covariance::new(3, vec![0, 2], parts().shared, Vec::new()));
    let all = DMatrix::from_row_slice(3, 3, &[4.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 3.0]);
    assert_close(&of_two.dense(), &all);
}
