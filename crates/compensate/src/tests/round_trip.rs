//! Does the model, told the whole commanded path, put the tip on every target?

use super::*;
use crate::Target;
use crate::inverse::solve;
use armcal_core::Pose;
use proptest::prelude::*;

/// Postures of the paper's arm in front of it, elbow on one side.
fn posture() -> impl Strategy<Value = Vec<f64>> {
    (-1.0..1.0f64, -1.2..0.3f64, -0.9..0.8f64).prop_map(|(a, b, c)| vec![a, b, c])
}

/// Targets at the tips of the nominal arm in these postures.
fn where_nominal_goes(nominal: &Model, postures: &[Vec<f64>]) -> Vec<Target> {
    let tip_m = |q: &Vec<f64>| tip_after(nominal, &nominal.nominal(), std::slice::from_ref(q));
    let target = |(i, q): (usize, &Vec<f64>)| Target::in_world(format!("t{i}"), tip_m(q), None);
    postures.iter().enumerate().map(target).collect()
}

/// Of the Jacobian at readings `q`, rotation [rad] against position [m]; zero at a singular posture.
fn least_singular_value(model: &Model, target: &Target, q: &[f64]) -> f64 {
    let arm = Arm { model, values: model.nominal() };
    let o = unloaded().observation(target, q.len());
    arm.linearised(&o, &Past::unknown(q.len()), q).1.singular_values().min()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    #[test]
    fn targets_after_any_path_with_gaps_springs_and_eccentric_gears(
        off in prop::collection::vec(-1.0..1.0f64, 16),
        gaps in prop::array::uniform3(0.006..0.03f64),
        path in prop::collection::vec(posture(), 1..12),
        start in posture(),
    ) {
        let (model, values) = deviating(RIGHT_ARM, &off, &[
            ("backlash:1", &gaps[..1]), ("backlash:2", &gaps[1..2]), ("backlash:3", &gaps[2..]),
            ("compliance:2", &[1.5e-3]), ("eccentricity:3", &[3e-3, -2e-3]),
        ]);
        let nominal = bare(RIGHT_ARM);
        let targets = where_nominal_goes(&nominal, &path);
        let points = compensator(&nominal, (&model, &values)).set_points(&targets, Some(&start)).unwrap();
        let mut commanded = vec![start];
        for (target, point) in targets.iter().zip(&points) {
            commanded.push(point.joint_rad.clone());
            let off_m = (tip_after(&model, &values, &commanded) - target.position_m()).norm();
            prop_assert!(off_m < 2e-6, "{}: {:.3e} m off, {:?}", target.name, off_m, point);
            prop_assert!((point.reached.as_ref().unwrap().after_m - off_m).abs() < 1e-9);
        }
    }

    #[test]
    fn a_belt_that_passes_a_joint_and_friction_in_the_next_one(
        path in prop::collection::vec(posture(), 1..8), start in posture(),
    ) {
        let (model, values) = deviating(RIGHT_ARM, &[], &[
            ("belt_backlash:3", &[0.012]), ("friction_windup:2", &[4e-3]), ("gravity_backlash:2", &[0.01]),
        ]);
        let nominal = bare(RIGHT_ARM);
        let targets = where_nominal_goes(&nominal, &path);
        let points = compensator(&nominal, (&model, &values)).set_points(&targets, Some(&start)).unwrap();
        let mut commanded = vec![start];
        for (target, point) in targets.iter().zip(&points) {
            commanded.push(point.joint_rad.clone());
            let after_m = point.reached.as_ref().unwrap().after_m;
            let off_m = (tip_after(&model, &values, &commanded) - target.position_m()).norm();
            prop_assert!((after_m - off_m).abs() < 1e-9, "{}: said {after_m:.3e}, is {off_m:.3e} m", target.name);
            prop_assert!(after_m < 2e-6 || point.warnings.iter().any(|w| w.contains("agrees with itself")));
        }
    }

    #[test]
    fn poses_of_a_six_joint_arm(
        off in prop::collection::vec(-1.0..1.0f64, 24),
        q in prop::array::uniform6(-0.8..0.8f64),
        start in prop::array::uniform6(-0.15..0.15f64),
    ) {
        let (model, values) = deviating(UR10, &off, &[("compliance:2", &[5e-4])]);
        let q: Vec<f64> = q.iter().zip([0.0, -1.2, 1.6, -1.0, -1.4, 0.0]).map(|(q, about)| q + about).collect();
        let pose: Pose = model.tip_in_base(&values, &q);
        let target = Target::in_world("pose", pose.translation.vector, Some(pose.rotation));
        let nominal = bare(UR10);
        // The nominal arm cannot take every pose of the deviating one where the elbow is stretched, the wrist aligned or
        // its centre above the shoulder.
        prop_assume!(least_singular_value(&nominal, &target, &q) > 0.05);
        let mut all = compensator(&nominal, (&model, &values));
        all.postures_rad = vec![q.iter().zip(start).map(|(q, off)| q + off).collect()];
        let point = &all.set_points(std::slice::from_ref(&target), None).unwrap()[0];
        let [before_rad, after_rad] = point.reached.as_ref().unwrap().turn_rad.unwrap();
        prop_assert!(point.reached.as_ref().unwrap().after_m < 1e-6 && after_rad < 1e-6);
        prop_assert!(before_rad > after_rad);
    }
}

/// A redundant arm takes the least way: no motion in the null space of its Jacobian on the way to a near target.
#[test]
fn a_redundant_arm_stays_near_its_start() {
    let rows: String = (0..4)
        .map(|i| format!("[[rows]]\nname = \"j{i}\"\njoint = \"revolute\"\ntheta_deg = 0\nd_mm = 0\na_mm = 250\nalpha_deg = {}\n", 90 * (i % 2)))
        .collect();
    let model = bare(&format!("name = \"four\"\nconvention = \"standard\"\n{rows}"));
    let start = vec![0.3, 0.4, -0.5, 0.6];
    let tip = tip_after(&model, &model.nominal(), std::slice::from_ref(&start));
    let target = Target::in_world("near", tip + Vector3::new(1e-3, -2e-3, 1.5e-3), None);
    let arm = Arm { model: &model, values: model.nominal() };
    let o = unloaded().observation(&target, 4);
    let unknown = Past::unknown(4);
    let q = solve(|q| arm.linearised(&o, &unknown.then(q), q), &start, &Limits::none(4)).unwrap();
    let (_, slope) = arm.linearised(&o, &unknown.then(&q), &q);
    let svd = slope.clone().svd(false, true);
    let rows = svd.v_t.unwrap();
    let moved = nalgebra::DVector::from_iterator(4, q.iter().zip(&start).map(|(a, b)| a - b));
    let within = rows.transpose() * (&rows * &moved);
    assert!((&moved - within).norm() < 0.02 * moved.norm());
}
