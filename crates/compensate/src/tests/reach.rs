//! What happens at the edge of what the arm can do?

use super::*;
use crate::Target;
use proptest::prelude::*;

/// Farthest the tip gets from the shoulder: both links stretched, the elbow's offset beside them [m].
fn reach_m() -> f64 {
    (0.4_f64 + 0.3543).hypot(0.012)
}

#[test]
fn an_unreachable_target_is_named_with_the_distance_left() {
    let nominal = bare(RIGHT_ARM);
    let shoulder = Vector3::new(0.0, 0.0, 0.076);
    let target = shoulder + Vector3::new(0.9, 0.3, 0.2);
    let left_mm = ((target - shoulder).norm() - reach_m()) * 1e3;
    let all = compensator(&nominal, (&nominal, &nominal.nominal()));
    let good = Target::in_world("good", Vector3::new(0.4, 0.05, 0.2), None);
    let error = all.set_points(&[good, Target::in_world("far", target, None)], None).unwrap_err();
    let words = error.to_string();
    let crate::CompensateError::Unreachable { target, left_mm: said_mm, .. } = error else {
        panic!("{words}")
    };
    assert_eq!(target, "far");
    assert!((said_mm - left_mm).abs() < 1e-2, "{said_mm} mm said, {left_mm} mm true");
    assert!(words.contains("move the target"), "{words}");
}

#[test]
fn a_stretched_arm_is_bent_to_come_back() {
    let nominal = bare(RIGHT_ARM);
    // Upper arm and forearm in one line: nothing moves the tip along it.
    let stretched = vec![0.0, -0.8, 90f64.to_radians()];
    let tip = tip_after(&nominal, &nominal.nominal(), std::slice::from_ref(&stretched));
    let shoulder = Vector3::new(0.0, 0.0, 0.076);
    assert!(((tip - shoulder).norm() - reach_m()).abs() < 1e-12);
    let target = Target::in_world("inwards", shoulder + (tip - shoulder) * 0.8, None);
    let mut all = compensator(&nominal, (&nominal, &nominal.nominal()));
    all.recorded_rad = stretched.iter().map(|q| [*q; 2]).collect();
    all.postures_rad = vec![stretched];
    let point = &all.set_points(&[target], None).unwrap()[0];
    assert!(point.reached.as_ref().unwrap().after_m < 1e-6);
}

#[test]
fn a_limit_in_the_way_is_named() {
    let nominal = bare(RIGHT_ARM);
    let mut all = compensator(&nominal, (&nominal, &nominal.nominal()));
    let target = || Target::in_world("beside", Vector3::new(0.3, 0.3, 0.3), None);
    assert!(all.set_points(&[target()], None).is_ok());
    all.limits.0[0] = [-0.2, 0.2];
    let words = all.set_points(&[target()], None).unwrap_err().to_string();
    assert!(words.contains("joint1") && words.contains("limit") && words.contains("beside"), "{words}");
}

#[test]
fn nonsense_is_refused_by_name() {
    let nominal = bare(RIGHT_ARM);
    let all = compensator(&nominal, (&nominal, &nominal.nominal()));
    let turned = Target::in_world("turned", Vector3::new(0.4, 0.0, 0.2), Some(Default::default()));
    let words = all.set_points(&[turned], None).unwrap_err().to_string();
    assert!(words.contains("turned") && words.contains("3 joints"), "{words}");
    let missing = Target::in_world("missing", Vector3::new(0.4, f64::NAN, 0.2), None);
    assert!(all.set_points(&[missing], None).unwrap_err().to_string().contains("missing"));
    assert!(all.set_points(&[], None).is_err());
    let good = Target::in_world("good", Vector3::new(0.4, 0.0, 0.2), None);
    assert!(all.set_points(&[good], Some(&[0.0])).unwrap_err().to_string().contains("3 finite"));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn what_is_found_lies_within_the_limits(q in prop::array::uniform3(-0.6..0.6f64), half in 0.1..0.7f64) {
        let nominal = bare(RIGHT_ARM);
        let q = vec![q[0], q[1] - 0.5, q[2]];
        let tip = tip_after(&nominal, &nominal.nominal(), std::slice::from_ref(&q));
        let mut all = compensator(&nominal, (&nominal, &nominal.nominal()));
        all.limits = Limits(vec![[-half, half], [-0.5 - half, -0.5 + half], [-half, half]]);
        let inside = q.iter().zip(&all.limits.0).all(|(q, [low, high])| (low..=high).contains(&q));
        match all.set_points(&[Target::in_world("t", tip, None)], None) {
            Ok(points) => {
                let found = points[0].joint_rad.iter().zip(&all.limits.0);
                for (q, [low, high]) in found {
                    prop_assert!(low <= q && q <= high);
                }
            }
            Err(error) => prop_assert!(!inside, "{error}"),
        }
    }
}
