//! Is the direction that the model is told the direction of the move?

use super::*;
use crate::{Kind, Target};

const WIDTH_RAD: f64 = 0.02;

/// Points on a circle about the base: only joint 1 moves, so its set-points have a closed form.
fn around(angles_rad: &[f64]) -> (Vec<Target>, Vec<f64>) {
    let nominal = bare(RIGHT_ARM);
    let posture = |a: f64| vec![a, -0.6, 0.2];
    let tip = |a: &f64| tip_after(&nominal, &nominal.nominal(), &[posture(*a)]);
    let target = |(i, a): (usize, &f64)| Target::in_world(format!("t{i}"), tip(a), None);
    (angles_rad.iter().enumerate().map(target).collect(), posture(angles_rad[0] - 0.3))
}

fn first_joint(points: &[crate::SetPoint]) -> Vec<f64> {
    points.iter().map(|point| point.joint_rad[0]).collect()
}

#[test]
fn a_joint_that_turns_back_is_sent_further_by_its_gap() {
    let (model, values) = deviating(RIGHT_ARM, &[], &[("backlash:1", &[WIDTH_RAD])]);
    let nominal = bare(RIGHT_ARM);
    // The third step back is shorter than the gap, and the fourth target is the third again.
    let angles = [0.1, 0.3, 0.299, 0.299, 0.1];
    let (targets, start) = around(&angles);
    let points = compensator(&nominal, (&model, &values)).set_points(&targets, Some(&start)).unwrap();
    let half = WIDTH_RAD / 2.0;
    let expected = [0.1 + half, 0.3 + half, 0.299 - half, 0.299 - half, 0.1 - half];
    for (found, expected) in first_joint(&points).into_iter().zip(expected) {
        assert!((found - expected).abs() < 1e-6, "{found} {expected}");
    }
    assert!(points.iter().all(|p| p.reached.as_ref().unwrap().after_m < 1e-6));
    // Half the gap at the distance of the tip from the axis.
    let lever_m = targets[0].position_m().xy().norm();
    let before_m = points[0].reached.as_ref().unwrap().before_m;
    assert!((before_m - 2.0 * lever_m * (half / 2.0).sin()).abs() < 1e-6);
    // The nominal set-point of the third does not move the link at all.
    let stuck_m = points[2].reached.as_ref().unwrap().before_m;
    assert!((stuck_m - 2.0 * lever_m * ((half - 0.001) / 2.0).sin()).abs() < 1e-6, "{stuck_m}");
}

#[test]
fn where_no_direction_agrees_with_itself_it_is_said_and_an_approach_helps() {
    // A link that leads its encoder: to go a little up, the encoder would have to come from above.
    let (model, values) = deviating(RIGHT_ARM, &[], &[("backlash:1", &[-WIDTH_RAD])]);
    let nominal = bare(RIGHT_ARM);
    let (targets, start) = around(&[0.1, 0.102]);
    let mut all = compensator(&nominal, (&model, &values));
    let points = all.set_points(&targets, Some(&start)).unwrap();
    let [.., last] = &points[..] else { panic!("no points") };
    if last.reached.as_ref().unwrap().after_m > 1e-6 {
        assert!(last.warnings.iter().any(|w| w.contains("agrees with itself")), "{:?}", last.warnings);
    }
    all.approach_rad = 0.05;
    let points = all.set_points(&targets, Some(&start)).unwrap();
    assert_eq!(points.len(), 4);
    assert!(points.iter().step_by(2).all(|p| p.kind == Kind::Approach));
    for point in points.iter().skip(1).step_by(2) {
        assert!(point.reached.as_ref().unwrap().after_m < 1e-6, "{point:?}");
    }
}

#[test]
fn an_unknown_past_is_said() {
    let (model, values) = deviating(RIGHT_ARM, &[], &[("backlash:1", &[WIDTH_RAD])]);
    let nominal = bare(RIGHT_ARM);
    let (targets, start) = around(&[0.1, 0.3]);
    let all = compensator(&nominal, (&model, &values));
    let blind = all.set_points(&targets, None).unwrap();
    assert!(blind[0].warnings.iter().any(|w| w.contains("joint1") && w.contains("not known")), "{blind:?}");
    assert!(blind[1].warnings.is_empty(), "{:?}", blind[1].warnings);
    assert_eq!(blind[0].arrival[0], Arrival::Unknown);
    assert!(all.set_points(&targets, Some(&start)).unwrap()[0].warnings.is_empty());
    // Only joints on which something depends are worth a word.
    assert!(!blind[0].warnings.iter().any(|w| w.contains("joint2")));
}

/// Gaps in all joints, on a closed path at 50 points a second: every point is met, and a joint leaps over its gap only
/// where its link turns back.
#[test]
fn on_a_path_joints_leap_where_links_turn_back_and_nowhere_else() {
    let (model, values) = deviating(
        RIGHT_ARM,
        &[0.5; 16],
        &[("backlash:1", &[0.0175]), ("backlash:2", &[0.0175]), ("backlash:3", &[0.021])],
    );
    let nominal = bare(RIGHT_ARM);
    let corner = |k: i32| {
        let a = std::f64::consts::TAU * f64::from(k) / 12.0;
        let at = Vector3::new(0.42 + 0.07 * a.cos(), 0.09 * a.sin(), 0.18 + 0.03 * (2.0 * a).sin());
        Target::in_world(format!("w{k}"), at, None).at(f64::from(k))
    };
    let path = crate::resample(&(0..=12).map(corner).collect::<Vec<_>>(), 50.0).unwrap();
    let mut all = compensator(&nominal, (&model, &values));
    let start = [0.0, -0.5, 0.2];
    let points = all.set_points(&path, Some(&start)).unwrap();
    let worst_m = points.iter().filter_map(|p| p.reached.as_ref()).map(|r| r.after_m).fold(0.0, f64::max);
    assert!(worst_m < 1e-6, "{worst_m}");
    for joint in 0..3 {
        // The link follows the set-point at half a gap, on the side of the direction of travel.
        let half = [0.0175, 0.0175, 0.021][joint] / 2.0;
        let link: Vec<f64> =
            points.iter().map(|p| p.joint_rad[joint] - half * p.arrival[joint].sign()).collect();
        let turns = link.windows(3).filter(|q| (q[1] - q[0]) * (q[2] - q[1]) < -1e-14).count();
        let steps = points.windows(2).map(|p| (p[1].joint_rad[joint] - p[0].joint_rad[joint]).abs());
        let leaps = steps.filter(|step| *step > half).count();
        assert!(turns >= 2 && leaps <= turns + 1, "joint {joint}: {leaps} leaps at {turns} turns");
    }
    // With time to cross, no step of a joint is a leap, and links are off by no more than a T^2 / 8; a is bounded by the
    // amplitudes of the curve times the squares of their frequencies.
    all.crossing_s = 0.4;
    let calm = all.set_points(&path, Some(&start)).unwrap();
    let steps = calm.windows(2).flat_map(|p| {
        p[1].joint_rad.iter().zip(&p[0].joint_rad).map(|(b, a)| (b - a).abs()).collect::<Vec<_>>()
    });
    assert!(steps.fold(0.0, f64::max) < 0.0175 / 4.0);
    let off: Vec<f64> = calm.iter().filter_map(|p| p.reached.as_ref()).map(|r| r.after_m).collect();
    let acceleration =
        (std::f64::consts::TAU / 12.0_f64).powi(2) * 0.14 + (std::f64::consts::TAU / 6.0_f64).powi(2) * 0.03;
    println!(
        "largest {:.3} mm, bound {:.3} mm",
        off.iter().fold(0.0f64, |a, b| a.max(*b)) * 1e3,
        acceleration * 0.02 * 1e3
    );
    // At the start of the path the crossing cannot begin before it: there it takes its whole time.
    assert!(off[40..].iter().all(|m| *m < acceleration * 0.4 * 0.4 / 8.0), "{off:?}");
    assert!(off.iter().filter(|m| **m < 1e-6).count() > off.len() / 2);
}
