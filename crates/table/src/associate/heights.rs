//! The plane of seated tips among heights: hovering tips are above it, nothing is below it.

use super::at_least::sum_of_at_least;
use super::emission::hover_share;
use super::field::Field;
use super::problem::Problem;
use nalgebra::Vector3;

/// Scatter of seated heights about a plane, curvature included [m].
const SIGMA_M: f64 = 0.003;
/// Planes through three places that are tried.
const TRIES: usize = 160;
/// Two planes nearer than this in the middle are one [m].
const DISTINCT_M: f64 = 0.004;
/// A second plane this much less likely than the first (as a logarithm) is not pursued.
const WORTH_LN: f64 = 12.0;
/// Places beside a cavity by less than this share of the spacing take part.
const BESIDE: f64 = 0.5;
/// Heights further from the board than this have nothing to do with it [m].
const RANGE_M: f64 = 0.2;

/// A height over the cavity below: place in the board relative to the field's centre, height, weight.
struct Height {
    x: f64,
    y: f64,
    over_m: f64,
    weight: f64,
}

/// Corrections `a + b vx + c vy` that bring the seated tips of an alignment to the height of their cavities;
/// the best first, a second where it is nearly as good.
pub(super) fn planes(problem: &Problem, field: &Field) -> Vec<[f64; 3]> {
    let heights = site_heights(problem, field);
    let n = heights.len();
    let flat = heights.iter().map(|h| [-h.over_m, 0.0, 0.0]);
    let tilted = (0..if n < 3 { 0 } else { TRIES }).filter_map(|i| {
        // Co-prime strides visit many different triplets without chance.
        plane_through(&heights[i % n], &heights[(i * 7 + n / 3) % n], &heights[(i * 13 + 2 * n / 3) % n])
    });
    let (mut scored, mut top) = (Vec::new(), f64::NEG_INFINITY);
    for plane in flat.chain(tilted) {
        if let Some(score) = plane_ln_likelihood(problem, &heights, &plane, top - WORTH_LN) {
            top = f64::max(top, score);
            scored.push((score, plane));
        }
    }
    scored.sort_by(|a, b| b.0.total_cmp(&a.0));
    let Some(&(top, best)) = scored.first() else { return vec![[0.0; 3]] };
    let second = scored.iter().find(|(s, p)| (p[0] - best[0]).abs() > DISTINCT_M && top - s < WORTH_LN);
    [Some(best), second.map(|s| s.1)].into_iter().flatten().collect()
}

fn site_heights(problem: &Problem, field: &Field) -> Vec<Height> {
    problem.sites.iter().filter_map(|s| site_height(problem, field, &s.at_m, s.weight)).collect()
}

fn site_height(problem: &Problem, field: &Field, at_m: &Vector3<f64>, weight: f64) -> Option<Height> {
    let aligned = field.aligned_m(at_m);
    let cavity = problem.layout.points_m[*problem.layout.near(&aligned).first()? as usize];
    let gap = aligned - cavity;
    let v = field.supposed_m(at_m) - field.centre_m;
    let beside = gap.x.hypot(gap.y) < BESIDE * problem.layout.spacing_m;
    (beside && gap.z.abs() < RANGE_M).then_some(Height { x: v.x, y: v.y, over_m: gap.z, weight })
}

fn plane_through(a: &Height, b: &Height, c: &Height) -> Option<[f64; 3]> {
    let rows = nalgebra::Matrix3::new(1.0, a.x, a.y, 1.0, b.x, b.y, 1.0, c.x, c.y);
    let planes = rows.try_inverse()? * -Vector3::new(a.over_m, b.over_m, c.over_m);
    planes.iter().all(|v| v.is_finite()).then(|| planes.into())
}

/// ln likelihood of heights with a plane; none where it is less than `least`.
fn plane_ln_likelihood(problem: &Problem, heights: &[Height], plane: &[f64; 3], least: f64) -> Option<f64> {
    let hover_m = problem.config.hover_min_mm * 1e-3..problem.config.hover_max_mm * 1e-3;
    let seat = 0.55 / (SIGMA_M * std::f64::consts::TAU.sqrt());
    let hover = 0.25 / (hover_m.end - hover_m.start);
    let out = 0.2 / (2.0 * RANGE_M);
    let density = |h: &Height| {
        let z = h.over_m + plane[0] + plane[1] * h.x + plane[2] * h.y;
        let above = hover * hover_share(z, &hover_m);
        let aside = if z < -hover_m.start { 0.01 * out } else { out };
        seat * (-0.5 * (z / SIGMA_M).powi(2)).exp() + above + aside
    };
    let prior = &problem.prior;
    let slopes = (plane[1].powi(2) + plane[2].powi(2)) / prior.slope.powi(2);
    let far = 0.5 * (slopes + (plane[0] / prior.offset_m).powi(2));
    let (whole, most) = (heights.iter().map(|h| h.weight).sum(), (seat + hover + out).ln());
    let fit =
        sum_of_at_least(least + far, (whole, most), heights.iter().map(|h| (h.weight, density(h).ln())));
    Some(fit? - far)
}

#[cfg(test)]
mod tests {
    use super::super::tests::planted::{Plan, Planted, paper, rng};
    use super::*;
    use crate::AssociationConfig;
    use crate::associate::BoardStart;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn a_plane_is_dropped_only_where_all_heights_say_less_than_was_asked(
            seed in 0_u64..1000, plane in prop::array::uniform3(-0.02..0.02), share in 0.0..2.0f64
        ) {
            let mut rng = rng(seed);
            let plan = Plan::random(&mut rng, &paper(), Some(0.01));
            let planted = Planted::new(&mut rng, paper(), &plan);
            let config = AssociationConfig::default();
            let problem = Problem::new(&planted.board, &planted.tips, &BoardStart::Unknown, &config);
            let field = Field::none(planted.world_from_board.inverse(), Vector3::zeros());
            let heights = site_heights(&problem, &field);
            prop_assume!(!heights.is_empty());
            let of_all = plane_ln_likelihood(&problem, &heights, &plane, f64::NEG_INFINITY).expect("nothing was asked");
            let least = share * of_all;
            match plane_ln_likelihood(&problem, &heights, &plane, least) {
                Some(score) => prop_assert_eq!(score, of_all),
                None => prop_assert!(of_all < least),
            }
        }
    }
}
