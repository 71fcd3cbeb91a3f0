//! The greedy choice against formula (11) written out, on numbers without an arm.

use super::{AMPLITUDE_PRECISION, Geometry, PoolDwell, Survivor, choose_dwells, pair_delta};
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const PARAMETERS: usize = 4;
/// Rows of the data at hand, and of each dwell below.
const ROWS: usize = 60;
const DWELL_ROWS: usize = 3;

fn normal_matrix(rows: usize, columns: usize, rng: &mut ChaCha8Rng) -> DMatrix<f64> {
    DMatrix::from_fn(rows, columns, |_, _| StandardNormal.sample(rng))
}

/// Two effects that the data hardly tell apart (their columns differ by little beside the geometry), and dwells in which they
/// differ as much as they are large, the last `useless` alike in both.
fn two_effects(useless: usize, seed: u64) -> (Geometry, Vec<Survivor>, Vec<PoolDwell>) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let geometry = Geometry {
        columns: normal_matrix(ROWS, PARAMETERS, &mut rng),
        precision: DVector::from_element(PARAMETERS, 1.0),
    };
    let first = normal_matrix(ROWS, 1, &mut rng);
    let second = &first + 0.1 * normal_matrix(ROWS, 1, &mut rng);
    let survivors = [("first", first), ("second", second)].map(|(name, columns)| Survivor {
        name: name.to_owned(),
        columns,
        theta: DVector::from_element(1, 1.0),
    });
    let mut dwell = |i: usize| {
        let alike = normal_matrix(DWELL_ROWS, 1, &mut rng);
        let own = normal_matrix(DWELL_ROWS, 1, &mut rng);
        let effects = if i < useless { vec![alike.clone(), alike] } else { vec![alike, own] };
        PoolDwell { geometry: normal_matrix(DWELL_ROWS, PARAMETERS, &mut rng), effects }
    };
    let pool = (0..20 + useless).rev().map(&mut dwell).collect();
    (geometry, survivors.to_vec(), pool)
}

/// Delta = |g|^2 - b'A^-1 b with the chosen dwells among the data, the smaller of both directions.
fn dense_delta(geometry: &Geometry, survivors: &[Survivor], dwells: &[&PoolDwell]) -> f64 {
    let rows = ROWS + DWELL_ROWS * dwells.len();
    let stacked = |data: &DMatrix<f64>, of: &dyn Fn(&PoolDwell) -> DMatrix<f64>| {
        let mut all = DMatrix::zeros(rows, data.ncols());
        all.rows_mut(0, ROWS).copy_from(data);
        for (i, dwell) in dwells.iter().enumerate() {
            all.rows_mut(ROWS + DWELL_ROWS * i, DWELL_ROWS).copy_from(&of(dwell));
        }
        all
    };
    let effect = |k: usize| stacked(&survivors[k].columns, &|d| d.effects[k].clone());
    let parameters = stacked(&geometry.columns, &|d| d.geometry.clone());
    let one_way = |k: usize, l: usize| {
        let (g, rival) = (effect(k), effect(l));
        let mut x = DMatrix::zeros(rows, PARAMETERS + 1);
        x.columns_mut(0, PARAMETERS).copy_from(&parameters);
        x.columns_mut(PARAMETERS, 1).copy_from(&rival);
        let mut a = x.tr_mul(&x);
        (0..PARAMETERS).for_each(|j| a[(j, j)] += geometry.precision[j]);
        a[(PARAMETERS, PARAMETERS)] += AMPLITUDE_PRECISION;
        let b = x.tr_mul(&g);
        g.norm_squared() - (b.transpose() * a.cholesky().unwrap().solve(&b))[(0, 0)]
    };
    one_way(0, 1).min(one_way(1, 0))
}

#[test]
fn planned_delta_is_the_dense_one() {
    for seed in 0..4 {
        let (geometry, survivors, pool) = two_effects(0, seed);
        let before = dense_delta(&geometry, &survivors, &[]);
        let planned = choose_dwells(&geometry, &survivors, &pool, 6);
        assert!(!planned.chosen.is_empty() && planned.smallest_delta.is_sorted(), "{planned:?}");
        assert!(before < 6.0 && planned.smallest_delta.last().is_some_and(|d| *d > 6.0), "{planned:?}");
        for (n, found) in planned.smallest_delta.iter().enumerate() {
            let chosen: Vec<&PoolDwell> = planned.chosen[..=n].iter().map(|i| &pool[*i]).collect();
            let expected = dense_delta(&geometry, &survivors, &chosen);
            let whole = pair_delta(&geometry, &survivors, &chosen, (0, 1));
            assert!((found - expected).abs() < 1e-9 * expected, "{found} {expected}");
            assert!((whole - expected).abs() < 1e-9 * expected, "{whole} {expected}");
        }
    }
}

#[test]
fn the_first_dwell_is_the_one_that_tells_most() {
    let (geometry, survivors, pool) = two_effects(10, 7);
    let planned = choose_dwells(&geometry, &survivors, &pool, 1);
    // The gain of both directions together; none of these dwells settles a pair by itself.
    let both = |dwell: &PoolDwell| {
        let nothing = |k: usize| {
            let mut one = survivors.clone();
            one[1 - k].theta = DVector::zeros(0);
            one
        };
        (0..2).map(|k| pair_delta(&geometry, &nothing(k), &[dwell], (0, 1)).min(20.0)).sum::<f64>()
    };
    let gains: Vec<f64> = pool.iter().map(both).collect();
    let best = (0..pool.len()).max_by(|a, b| gains[*a].total_cmp(&gains[*b])).unwrap();
    assert_eq!(planned.chosen, [best], "{gains:?}");
}

#[test]
fn a_pair_that_is_settled_or_that_nothing_separates_asks_for_no_dwell() {
    let (geometry, mut survivors, pool) = two_effects(0, 3);
    assert!(choose_dwells(&geometry, &survivors[..1], &pool, 6).chosen.is_empty(), "there is no rival");
    assert!(choose_dwells(&geometry, &survivors, &[], 6).chosen.is_empty(), "there is no dwell");
    survivors[1].columns = survivors[0].columns.clone();
    let alike = |mut d: PoolDwell| {
        d.effects[1] = d.effects[0].clone();
        d
    };
    let same: Vec<PoolDwell> = pool.iter().cloned().map(alike).collect();
    assert!(choose_dwells(&geometry, &survivors, &same, 6).chosen.is_empty(), "the same in every dwell");
    survivors[1].columns = normal_matrix(ROWS, 1, &mut ChaCha8Rng::seed_from_u64(5));
    assert!(choose_dwells(&geometry, &survivors, &pool, 6).chosen.is_empty(), "the data tell them apart");
}

#[test]
fn nothing_is_a_rival_and_never_the_truth() {
    let (geometry, mut survivors, pool) = two_effects(0, 11);
    survivors[1] =
        Survivor { name: "nothing".to_owned(), columns: DMatrix::zeros(ROWS, 0), theta: DVector::zeros(0) };
    // Small on the data, so that there is something to plan.
    survivors[0].columns *= 0.05;
    let without = |mut d: PoolDwell| {
        d.effects[1] = DMatrix::zeros(DWELL_ROWS, 0);
        d
    };
    let pool: Vec<PoolDwell> = pool.into_iter().map(without).collect();
    let planned = choose_dwells(&geometry, &survivors, &pool, 3);
    let chosen: Vec<&PoolDwell> = planned.chosen.iter().map(|i| &pool[*i]).collect();
    let whole = pair_delta(&geometry, &survivors, &chosen, (0, 1));
    assert!(planned.smallest_delta.last().is_some_and(|d| (d - whole).abs() < 1e-9 * whole), "{planned:?}");
    assert_eq!(pair_delta(&geometry, &survivors[1..], &[], (0, 0)), f64::INFINITY);
}
