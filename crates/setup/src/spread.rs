//! How large the data are: what a change of a unit or a scale makes of every error, it makes of this.

use armcal_core::{FeatureId, Observation};
use armcal_stages::Fitted;
use std::collections::BTreeMap;

/// Root mean square distance of measured positions from their mean [m]: those that a sensor saw of each tip or marker in the
/// world, those of cavities in the board. Where nothing measured is a position, that of the joints' readings, a metre away from
/// all axes: a reading that hardly moves makes the errors of tips in one point as small.
pub fn spread_m(observations: &[Observation]) -> f64 {
    let mut all: BTreeMap<(bool, bool, FeatureId), Vec<&[f64]>> = BTreeMap::new();
    for o in observations {
        let (seen_m, in_board_m) = (o.seen_m(), o.in_board_m());
        let at = seen_m.or(in_board_m).map_or(&o.joint_rad[..], |p| p.as_slice());
        all.entry((seen_m.is_some(), in_board_m.is_some(), o.feature)).or_default().push(at);
    }
    let from_mean_m2 = |points: &Vec<&[f64]>| -> f64 {
        let along = |k: usize| {
            let values = || points.iter().map(|p| p[k]);
            let mean = values().sum::<f64>() / points.len() as f64;
            values().map(|v| (v - mean).powi(2)).sum::<f64>()
        };
        (0..points[0].len()).map(along).sum()
    };
    (all.values().map(from_mean_m2).sum::<f64>() / observations.len().max(1) as f64).sqrt()
}

/// Root mean square way [m] of what was measured if each joint alone were held at its mean reading: what a joint that is taken
/// for another may err by. Dwells in one place, come to with other joints each time, move by far more than they spread.
pub fn moved_m(fitted: &Fitted) -> f64 {
    let (model, all) = (&fitted.model, &fitted.observations);
    let n = all.len().max(1) as f64;
    let mean_of = |j: usize| all.iter().map(|o| o.joint_rad[j]).sum::<f64>() / n;
    let means_rad: Vec<f64> = (0..model.joint_count()).map(mean_of).collect();
    let nominal = model.nominal();
    let of_dwell = |o: &Observation| -> f64 {
        let jacobian = model.joint_jacobian(&nominal, o);
        let from_mean_rad = o.joint_rad.iter().zip(&means_rad).map(|(q, mean)| q - mean);
        jacobian.column_iter().zip(from_mean_rad).map(|(c, by)| c.norm_squared() * by * by).sum()
    };
    (all.iter().map(of_dwell).sum::<f64>() / n).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use armcal_core::{DwellId, Reference};
    use proptest::prelude::*;

    fn seen(points_m: &[[f64; 3]]) -> Vec<Observation> {
        let of = |p: &[f64; 3]| {
            let position_m = (*p).into();
            let reference =
                Reference::Tracked { position_m, orientation: None, orientation_sigma_rad: f64::INFINITY };
            Observation::bare(DwellId { recording: 0, dwell: 0 }, vec![0.0], reference)
        };
        points_m.iter().map(of).collect()
    }

    proptest! {
        #[test]
        fn what_was_measured_spreads_as_it_is_scaled_wherever_it_is(
            points_m in prop::collection::vec(prop::array::uniform3(-2.0f64..2.0), 1..20),
            by_m in prop::array::uniform3(-5.0f64..5.0),
            scale in 1e-3f64..1e3,
        ) {
            let other: Vec<[f64; 3]> = points_m.iter().map(|p| [0, 1, 2].map(|k| scale * (p[k] + by_m[k]))).collect();
            let (before_m, after_m) = (spread_m(&seen(&points_m)), spread_m(&seen(&other)));
            prop_assert!((after_m - scale * before_m).abs() < 1e-9 * scale);
        }
    }

    #[test]
    fn one_point_does_not_spread_and_two_do() {
        assert!(spread_m(&seen(&[[0.5, 0.1, 0.2]; 7])) < 1e-12);
        assert!((spread_m(&seen(&[[0.0; 3], [0.0, 0.0, 0.4]])) - 0.2).abs() < 1e-12);
    }
}
