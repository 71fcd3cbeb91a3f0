use super::*;
use armcal_core::{Role, Unit};

/// A basis of the span of these columns.
fn weak(columns: &[&[f64]]) -> DMatrix<f64> {
    let columns: Vec<DVector<f64>> = columns.iter().map(|c| DVector::from_column_slice(c)).collect();
    let n = columns.len();
    DMatrix::from_columns(&columns).svd(true, false).u.unwrap().columns(0, n).into_owned()
}

fn unit(values: &[f64]) -> DVector<f64> {
    DVector::from_column_slice(values).normalize()
}

fn any(_: usize, _: usize) -> Simplicity {
    Simplicity::Any
}

/// Whether two unit vectors are one direction.
fn same(a: &DVector<f64>, b: &DVector<f64>) -> bool {
    (a.dot(b).abs() - 1.0).abs() < 1e-9
}

fn assert_spans(found: &[DVector<f64>], weak: &DMatrix<f64>) {
    assert_eq!(found.len(), weak.ncols());
    for direction in found {
        assert!((direction.norm() - 1.0).abs() < 1e-9);
        assert!(((weak.transpose() * direction).norm() - 1.0).abs() < 1e-9, "{direction} lies outside");
    }
    let rank = DMatrix::from_columns(found).svd(false, false).singular_values.min();
    assert!(rank > 1e-3, "dependent: {rank}");
}

#[test]
fn varimax_unmixes_sparse_directions() {
    // Two sparse unit directions, mixed by 0.7 rad.
    let s = 0.5_f64.sqrt();
    let sparse = DMatrix::from_row_slice(6, 2, &[s, 0.0, -s, 0.0, 0.0, 0.6, 0.0, 0.8, 0.0, 0.0, 0.0, 0.0]);
    let (sin, cos) = 0.7_f64.sin_cos();
    let mixed = &sparse * DMatrix::from_row_slice(2, 2, &[cos, -sin, sin, cos]);
    let found = varimax(mixed);
    let overlap = (sparse.transpose() * found).abs();
    // Each found direction is one of the sparse ones, up to sign and order.
    for c in 0..2 {
        assert!((overlap.column(c).amax() - 1.0).abs() < 1e-9, "{overlap}");
    }
}

/// Kaiser's criterion: the variance of squared entries, summed over columns, times the square of the rows.
fn criterion(basis: &DMatrix<f64>) -> f64 {
    let rows = basis.nrows() as f64;
    let of = |c: nalgebra::DVectorView<'_, f64>| {
        rows * c.iter().map(|l| l.powi(4)).sum::<f64>() - c.norm_squared().powi(2)
    };
    basis.column_iter().map(|c| of(c.as_view())).sum()
}

fn turned(basis: &DMatrix<f64>, i: usize, j: usize, angle: f64) -> DMatrix<f64> {
    let (sin, cos) = angle.sin_cos();
    let mut turned = basis.clone();
    turned.set_column(i, &(basis.column(i) * cos + basis.column(j) * sin));
    turned.set_column(j, &(basis.column(j) * cos - basis.column(i) * sin));
    turned
}

/// No turn of any two columns does better, on bases without any zero entry; the span stays.
#[test]
fn varimax_is_the_maximum_of_kaisers_criterion() {
    let entries = |seed: f64| move |k: usize| ((k as f64 + 1.3) * (1.7 + seed)).sin() + 0.4 * seed;
    for (seed, columns) in [(0.0, 2), (0.31, 2), (0.77, 3), (1.4, 4)] {
        let raw = DMatrix::from_fn(7, columns, |r, c| entries(seed)(r * columns + c));
        let basis = raw.svd(true, false).u.unwrap();
        let found = varimax(basis.clone());
        assert!((found.transpose() * &found - DMatrix::identity(columns, columns)).amax() < 1e-9);
        assert!((&found * found.transpose() - &basis * basis.transpose()).amax() < 1e-9);
        let best = criterion(&found);
        // From half way to the next maximum, where the criterion is smallest, too.
        if columns == 2 {
            let again = varimax(turned(&found, 0, 1, std::f64::consts::FRAC_PI_4));
            assert!((criterion(&again) - best).abs() < 1e-9, "{seed}");
        }
        for (i, j) in (0..columns).flat_map(|i| (i + 1..columns).map(move |j| (i, j))) {
            for step in 0..200 {
                let angle = std::f64::consts::PI * f64::from(step) / 200.0;
                assert!(criterion(&turned(&found, i, j, angle)) <= best + 1e-9, "{seed}: {i}, {j}, {angle}");
            }
        }
    }
}

#[test]
fn what_is_beyond_is_orthogonal_to_all_that_is_spanned() {
    let spanned = [unit(&[1.0, 0.0, 0.0]), unit(&[0.0, 3.0, 4.0])];
    let rest = orthogonal_part(&DVector::from_vec(vec![2.0, 5.0, 10.0]), &spanned);
    // 5 * 0.6 + 10 * 0.8 = 11 along (0, 0.6, 0.8).
    assert!((rest - DVector::from_vec(vec![0.0, 5.0 - 6.6, 10.0 - 8.8])).amax() < 1e-12);
}

#[test]
fn shares_are_sorted_by_size_and_the_first_is_positive() {
    let none = DMatrix::zeros(4, 4);
    let shares = shares_of(&DVector::from_vec(vec![0.3, -0.9, 0.05, 0.1]), &none);
    // 0.1 takes part, 0.05 does not; the sign is turned over for all.
    assert_eq!(shares, [(1, 0.9), (0, -0.3), (3, -0.1)]);
    let positive = shares_of(&DVector::from_vec(vec![0.3, 0.9, 0.0, -0.2]), &none);
    assert_eq!(positive, [(1, 0.9), (0, 0.3), (3, -0.2)]);
    // Equal to a millionth: the model's order.
    let tied = shares_of(&DVector::from_vec(vec![0.0, -0.5, 0.500_000_1, 0.7]), &none);
    assert_eq!(tied.iter().map(|s| s.0).collect::<Vec<_>>(), [3, 1, 2]);
    let apart = shares_of(&DVector::from_vec(vec![0.0, -0.5, 0.500_01, 0.7]), &none);
    assert_eq!(apart.iter().map(|s| s.0).collect::<Vec<_>>(), [3, 2, 1]);
}

/// A parameter of a small share takes part when alone it would move the residuals about as much as the most visible one,
/// and anybody could see that.
#[test]
fn a_small_share_that_is_needed_to_cancel_a_large_one_takes_part() {
    let direction = DVector::from_vec(vec![0.99, 0.05, -0.03, 0.02]);
    let who = |effects: [f64; 4]| -> Vec<usize> {
        let information = [0, 1, 2, 3].map(|k| (effects[k] / direction[k]).powi(2));
        let diagonal = DMatrix::from_diagonal(&DVector::from_row_slice(&information));
        shares_of(&direction, &diagonal).iter().map(|s| s.0).collect()
    };
    assert_eq!(who([10.0, 10.0, 4.0, 2.0]), [0, 1, 2]);
    assert_eq!(who([10.0, 2.0, 1.0, 0.0]), [0]);
    // Together below the noise.
    assert_eq!(who([0.9, 0.9, 0.9, 0.9]), [0]);
    // On the edges: 0.05 x 20 is no more than the noise; 0.03 x 100 is three tenths of 0.05 x 200.
    let edge = |at_1: f64, at_2: f64| -> Vec<usize> {
        let diagonal = DVector::from_vec(vec![0.0, at_1 * at_1, at_2 * at_2, 0.0]);
        shares_of(&direction, &DMatrix::from_diagonal(&diagonal)).iter().map(|s| s.0).collect()
    };
    assert_eq!(edge(20.0, 0.0), [0]);
    assert_eq!(edge(200.0, 100.0), [0, 1, 2]);
    // Rounding may leave an information below zero.
    let below = DMatrix::from_diagonal(&DVector::from_vec(vec![-1e-12; 4]));
    assert_eq!(shares_of(&direction, &below), [(0, 0.99)]);
}

#[test]
fn a_pair_is_taken_where_the_weak_subspace_holds_it() {
    let projector = |w: &DMatrix<f64>| w * w.transpose();
    let exact = projector(&weak(&[&[0.6, 0.0, -0.8, 0.0]]));
    assert!(same(&nearest_weak_direction(&exact, 0, 2).unwrap(), &unit(&[0.6, 0.0, -0.8, 0.0])));
    // The span of 0 and 1 holds only 36 % of it.
    assert_eq!(nearest_weak_direction(&exact, 0, 1), None);
    // Parameter 0 all but alone: 5 % of partner 1, though all of it is inside.
    assert_eq!(nearest_weak_direction(&projector(&weak(&[&[1.0, 0.05, 0.0, 0.0]])), 0, 1), None);
    // Just enough of a partner.
    assert!(nearest_weak_direction(&projector(&weak(&[&[0.99, 0.14, 0.0, 0.0]])), 0, 1).is_some());
    // Nearly inside: the nearest direction of the subspace itself, not of the pair's plane.
    let w = weak(&[&[0.7, -0.7, 0.1, 0.0], &[0.0, 0.05, 0.3, 1.0]]);
    let near = nearest_weak_direction(&projector(&w), 0, 1).unwrap();
    assert!((w.transpose() * &near).norm() > 1.0 - 1e-12 && near[2].abs() > 0.01, "{near}");
    let in_plane = projector(&w).view((0, 0), (2, 2)).symmetric_eigen();
    let best = in_plane.eigenvectors.column(in_plane.eigenvalues.imax());
    let expected = (projector(&w) * DVector::from_vec(vec![best[0], best[1], 0.0, 0.0])).normalize();
    assert!(same(&near, &expected));
    // Too far outside: 10 % of the square.
    assert_eq!(nearest_weak_direction(&projector(&weak(&[&[0.67, -0.67, 0.32, 0.0]])), 0, 1), None);
    // A single one is its own column.
    let single = projector(&weak(&[&[0.995, 0.0, 0.1, 0.0]]));
    assert!(same(&nearest_weak_direction(&single, 0, 0).unwrap(), &unit(&[0.995, 0.0, 0.1, 0.0])));
}

#[test]
fn singles_come_first_then_pairs_then_the_rest() {
    let s = 0.5_f64.sqrt();
    let w = weak(&[
        &[0.0, 1.0, 0.0, 0.0, 0.0, 0.0],
        &[s, 0.0, s, 0.0, 0.0, 0.0],
        &[0.0, 0.0, 0.0, 1.0, 1.0, -1.0],
    ]);
    let basis = simple_basis(&w, Vec::new(), &any);
    assert_spans(&basis, &w);
    assert!(same(&basis[0], &unit(&[0.0, 1.0, 0.0, 0.0, 0.0, 0.0])), "{}", basis[0]);
    assert!(same(&basis[1], &unit(&[1.0, 0.0, 1.0, 0.0, 0.0, 0.0])), "{}", basis[1]);
    assert!(same(&basis[2], &unit(&[0.0, 0.0, 0.0, 1.0, 1.0, -1.0])), "{}", basis[2]);
}

/// Four that move alike: three pairs say it all; which three is decided by how readily they are understood.
#[test]
fn pairs_that_are_readily_understood_are_preferred_and_none_is_repeated() {
    let w = weak(&[&[1.0, -1.0, 0.0, 0.0], &[0.0, 1.0, -1.0, 0.0], &[0.0, 0.0, 1.0, -1.0]]);
    let known = |i: usize, j: usize| if (i, j) == (1, 3) { Simplicity::Known } else { Simplicity::SameUnit };
    let basis = simple_basis(&w, Vec::new(), &known);
    assert_spans(&basis, &w);
    assert!(same(&basis[0], &unit(&[0.0, 1.0, 0.0, -1.0])), "{}", basis[0]);
    for direction in &basis {
        assert_eq!(direction.iter().filter(|v| v.abs() > 1e-9).count(), 2, "{direction}");
    }
    // What is named beforehand comes first and is not said again.
    let named = unit(&[1.0, -1.0, 0.0, 0.0]);
    let basis = simple_basis(&w, vec![named.clone()], &any);
    assert_spans(&basis, &w);
    assert_eq!(basis[0], named);
    assert!(basis[1..].iter().all(|direction| !same(direction, &named)));
}

/// Two combinations of three parameters each that share one: no single, no pair; the rest is orthonormal, also beside what
/// is named.
#[test]
fn what_no_pair_explains_is_turned_to_few_large_shares() {
    let (a, b) = (unit(&[1.0, 1.0, 1.0, 0.0, 0.0, 0.0]), unit(&[1.0, -1.0, 0.0, 1.0, 1.0, 0.0]));
    let w = weak(&[a.as_slice(), b.as_slice()]);
    let basis = simple_basis(&w, Vec::new(), &any);
    assert_spans(&basis, &w);
    assert!(basis[0].dot(&basis[1]).abs() < 1e-9);

    // A third, named: what is left is orthogonal to it, and of two directions.
    let c = unit(&[0.5, -0.5, 0.0, -1.0, 0.0, 2.0]);
    let w = weak(&[a.as_slice(), b.as_slice(), c.as_slice()]);
    let left = remaining_directions(&w, std::slice::from_ref(&c));
    assert_eq!(left.len(), 2);
    assert!(left.iter().all(|direction| direction.dot(&c).abs() < 1e-9));
    let mut all = vec![c];
    all.extend(left);
    assert_spans(&all, &w);
    // Nothing is left of what is spanned.
    let spanned: Vec<DVector<f64>> = w.column_iter().map(|column| column.into_owned()).collect();
    assert!(remaining_directions(&w, &spanned).is_empty());
}

pub(crate) fn axis(index: usize, scale: f64) -> Axis {
    Axis { index, centre: 0.0, scale, precision: 1.0, lower: -1.0, upper: 1.0 }
}

fn symmetry(direction: &[f64], text: &str) -> Symmetry {
    Symmetry { direction: direction.to_vec(), text: text.to_owned() }
}

/// Axes are in units of their priors and in an order of their own; symmetries in SI, in the order of all parameters.
#[test]
fn symmetries_in_the_weak_subspace_are_found_in_units_of_the_prior() {
    // Parameters 2 and 0 are axes 0 and 1; parameter 1 is fixed.
    let axes = [axis(2, 2.0), axis(0, 0.5), axis(3, 1.0)];
    let w = weak(&[&[3.0, 4.0, 0.0]]);
    // A change of 6 and 2 in SI is one of 3 and 4 in units of 2.0 and 0.5.
    let of_both = symmetry(&[2.0, 0.0, 6.0, 0.0], "both move");
    let other = symmetry(&[2.0, 0.0, -6.0, 0.0], "they move apart");
    let nothing = symmetry(&[0.0, 1.0, 0.0, 0.0], "what is fixed moves");
    let again = symmetry(&[-1.0, 0.0, -3.0, 0.0], "both move back");
    let all = [other, nothing, of_both, again];
    let found = unseen_symmetries(&w, &axes, &all);
    assert_eq!(found.iter().map(|f| f.1).collect::<Vec<_>>(), ["both move"]);
    assert!((&found[0].0 - DVector::from_vec(vec![0.6, 0.8, 0.0])).amax() < 1e-12, "{}", found[0].0);
    // Where the subspace holds both, both are told, and their sum is not.
    let w = weak(&[&[3.0, 4.0, 0.0], &[0.0, 0.0, 1.0]]);
    let third = symmetry(&[0.0, 0.0, 0.0, 1.0], "the third moves");
    let sum = symmetry(&[2.0, 0.0, 6.0, 5.0], "all move");
    let all = [all[2].clone(), third, sum];
    assert_eq!(
        unseen_symmetries(&w, &axes, &all).iter().map(|f| f.1).collect::<Vec<_>>(),
        ["both move", "the third moves"]
    );
}

pub(crate) fn parameter(name: &str) -> Parameter {
    Parameter {
        name: name.to_owned(),
        unit: Unit::Metre,
        nominal: 0.0,
        lower: -1.0,
        upper: 1.0,
        prior_sigma: None,
        usual: None,
        assumed: None,
        free: true,
        role: Role::Robot,
        meaning: String::new(),
    }
}

/// The whole way: groups of axes each with their weak directions, told in the order of the parameters that lead them.
#[test]
fn directions_come_in_the_order_of_the_model_with_names_and_reasons() {
    let parameters = ["joint1.a", "joint2.d", "joint3.d", "joint4.a", "tip.x"].map(parameter);
    let axes: Vec<Axis> = (0..5).map(|index| axis(index, 1.0)).collect();
    let information = |n: usize| DMatrix::identity(n, n) * 100.0;
    let late =
        Weak { axes: vec![3, 4], information: information(2), basis: weak(&[&[1.0, -1.0]]), followed: true };
    let early = Weak {
        axes: vec![0, 1, 2],
        information: information(3),
        basis: weak(&[&[0.0, 1.0, -1.0], &[1.0, 0.0, 0.0]]),
        followed: false,
    };
    let found = directions(&[late, early], &axes, &parameters, &[]);
    let names: Vec<Vec<&str>> =
        found.iter().map(|d| d.shares.iter().map(|(name, _)| name.as_str()).collect()).collect();
    assert_eq!(names, [vec!["joint1.a"], vec!["joint2.d", "joint3.d"], vec!["joint4.a", "tip.x"]]);
    assert!(found[1].text.starts_with("joint2.d - joint3.d: the axes of joint2 and joint3 are parallel"));
    assert!(!found[1].text.contains("may follow"));
    assert!(
        found[2].text.ends_with(", once what each recording has for itself may follow"),
        "{}",
        found[2].text
    );
    assert!((found[2].shares[0].1 - 0.5_f64.sqrt()).abs() < 1e-9);
    // A symmetry lends its own words to the direction that it is, and to no other.
    let both = symmetry(&[0.0, 1.0, -1.0, 0.0, 0.0], "somebody's own words");
    let early = Weak {
        axes: vec![0, 1, 2],
        information: information(3),
        basis: weak(&[&[0.0, 1.0, -1.0], &[1.0, 0.0, 0.0]]),
        followed: false,
    };
    let found = directions(&[early], &axes, &parameters, &[both]);
    let texts: Vec<&str> = found.iter().map(|d| d.text.as_str()).collect();
    assert_eq!(texts[1], "somebody's own words");
    assert!(texts[0].starts_with("joint1.a: "), "{texts:?}");
}
