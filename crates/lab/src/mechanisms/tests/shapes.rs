//! Gears, axes, heat and knocks.

use super::*;
use crate::mechanism::Body;

#[test]
fn an_offset_wheel_errs_once_a_turn_with_a_small_second_harmonic() {
    let text = "kind = 'eccentricity'\njoint = 1\noffset_mm = 0.5\nradius_mm = 20.0\nphase_deg = 20.0";
    let (rest, n) = (Rest::at([0.0; 3]), 720);
    let mut harmonics = [(0.0, 0.0); 3];
    let mut wheel = mechanism(text);
    for i in 0..n {
        let q = std::f64::consts::TAU * f64::from(i) / f64::from(n);
        let lead = motor(&mut *wheel, &rest, [q, 0.0, 0.0])[0] - q;
        for (k, (sin, cos)) in harmonics.iter_mut().enumerate() {
            let a = (k + 1) as f64 * q;
            (*sin, *cos) = (*sin + lead * a.sin(), *cos + lead * a.cos());
        }
        // There and back again.
        let round = link(&mut *wheel, &rest, [q + lead, 0.0, 0.0])[0];
        assert!((round - q).abs() < 1e-12);
    }
    let size = harmonics.map(|(s, c): (f64, f64)| 2.0 * s.hypot(c) / f64::from(n));
    let ratio = 0.5f64 / 20.0;
    // The series of the exact angle: e/r, (e/r)^2 / 2, (e/r)^3 / 3.
    for (k, size) in size.iter().enumerate() {
        let order = k as i32 + 1;
        assert!((size - ratio.powi(order) / f64::from(order)).abs() < 1e-9, "{order}: {size}");
    }
    let mut reading = vec![0.7, 0.0, 0.0];
    let disc = mechanism(&format!("{text}\non = 'encoder'"));
    disc.distort_encoder(&rest.now(), &mut reading);
    assert!((reading[0] - motor(&mut *wheel, &rest, [0.7, 0.0, 0.0])[0]).abs() < 1e-15);
}

#[test]
fn warm_links_grow_to_their_limit_exponentially() {
    let text = "kind = 'warm_up'\nlinks = [2]\nper_kelvin_ppm = 70.0\nrise_k = 20.0\ntime_constant_s = 900.0";
    let mut warm = mechanism(text);
    let mut rest = Rest::at([0.0; 3]);
    for session_s in [0.0, 17.0, 450.0, 900.0, 20_000.0] {
        rest.session_s = session_s;
        link(&mut *warm, &rest, [0.0; 3]);
        let mut arm = rest.arm.clone();
        warm.reshape_arm(&rest.now(), &mut arm);
        let grown = arm.link_m(1).norm() / 0.4 - 1.0;
        let limit = 70e-6 * 20.0 * (1.0 - (-session_s / 900.0f64).exp());
        // The next axis lies 12 mm beside: the tip moves with it, the forearm stays as long as it was.
        assert!((grown - limit).abs() < 2e-6, "{session_s}: {grown} {limit}");
        assert!((arm.link_m(2) - rest.arm.link_m(2)).norm() < 1e-12);
    }
    let mut seen = mechanism("kind = 'thermal_growth'\nper_kelvin_ppm = 50.0");
    link(&mut *seen, &rest, [0.0; 3]);
    let mut arm = rest.arm.clone();
    seen.reshape_arm(&rest.now(), &mut arm);
    assert!((arm.link_m(2).norm() / rest.arm.link_m(2).norm() - 1.0 - 500e-6).abs() < 1e-9);
}

#[test]
fn a_bump_is_a_rigid_motion_of_everything_after_it() {
    let knock = |body: &str| {
        mechanism(&format!(
            "kind = 'bump'\nbody = '{body}'\nshift_mm = [1.0, -2.0, 0.5]\nturn_deg = [0.1, 0.0, 0.3]\nrecording = 1\nat_s = 60.0"
        ))
    };
    let turn =
        nalgebra::UnitQuaternion::from_scaled_axis(Vector3::new(0.1f64, 0.0, 0.3).map(f64::to_radians));
    let motion = nalgebra::Isometry3::from_parts(nalgebra::Translation3::new(1e-3, -2e-3, 0.5e-3), turn);
    let mut rest = Rest::at([0.3, -0.5, 0.1]);
    let start: Pose = nalgebra::Isometry3::new(Vector3::new(1.0, 2.0, 3.0), Vector3::new(0.3, 0.2, 0.1));
    for (recording, session_s, after) in
        [(0, 500.0, false), (1, 59.9, false), (1, 60.0, true), (2, 0.0, true)]
    {
        (rest.recording, rest.session_s) = (recording, session_s);
        let expected = if after { start * motion } else { start };
        let mut base = start;
        knock("base").move_base(&rest.now(), &mut base);
        let (mut tip, mut camera) = (start, start);
        knock("marker").distort_camera(&rest.now(), Body::Tip, &mut tip);
        knock("cameras").distort_camera(&rest.now(), Body::Table, &mut camera);
        let mut arm = rest.arm.clone();
        knock("tool").reshape_arm(&rest.now(), &mut arm);
        let before = rest.arm.tip_pose(&rest.link_rad);
        let expected_tip = if after { before * motion } else { before };
        assert!((base.to_homogeneous() - expected.to_homogeneous()).norm() < 1e-12);
        assert!((tip.to_homogeneous() - expected.to_homogeneous()).norm() < 1e-12);
        let reported = if after { motion * start } else { start };
        assert!((camera.to_homogeneous() - reported.to_homogeneous()).norm() < 1e-12);
        assert!(
            (arm.tip_pose(&rest.link_rad).to_homogeneous() - expected_tip.to_homogeneous()).norm() < 1e-12
        );
    }
}

#[test]
fn transmissions_are_undone_by_turning_them_round() {
    let rest = Rest::at([0.0; 3]);
    for text in [
        "kind = 'second_harmonic'\njoint = 1\namplitude_deg = 0.4",
        "kind = 'tooth_runout'\njoint = 1\namplitude_deg = 0.4\nper_turn = 30",
        "kind = 'gear_ratio'\njoint = 1\nerror_percent = 1.5",
        "kind = 'damaged_teeth'\njoint = 1\nheight_deg = 0.5\ncentre_deg = 5\nspan_deg = 7",
        "kind = 'sawtooth'\njoint = 1\namplitude_deg = 0.1\nper_turn = 12",
        "kind = 'soft_stop'\njoint = 1\nfrom_deg = 10\ngive_percent = 8",
        "kind = 'cable_drag'\njoint = 1\nby = 2\ncable_nm_rad = 3\nslack_deg = 5\ngear_nm_rad = 400",
        "kind = 'belt_coupling'\nshare_percent = 2",
    ] {
        let mut gear = mechanism(text);
        let mut largest = 0.0f64;
        for i in -40..40 {
            let q = [0.02 * f64::from(i), -0.4, 0.2];
            let there = motor(&mut *gear, &rest, q);
            let back = link(&mut *gear, &rest, [there[0], there[1], there[2]]);
            largest = largest.max(there.iter().zip(&q).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max));
            assert!(
                back.iter().zip(&q).all(|(a, b)| (a - b).abs() < 1e-9),
                "{text}: {q:?} {there:?} {back:?}"
            );
        }
        assert!(largest > 1e-3, "{text} does nothing");
    }
    let mut ratio = mechanism("kind = 'gear_ratio'\njoint = 1\nerror_percent = 1.5");
    assert!((link(&mut *ratio, &rest, [0.5, 0.0, 0.0])[0] - 0.5 * 1.015).abs() < 1e-12);
}

#[test]
fn axes_lean_and_wobble_by_the_angle_they_say() {
    let rest = Rest::at([0.6, -0.7, 0.2]);
    let mut arm = rest.arm.clone();
    AxisTilt { joint: 3, tilt_deg: 0.5 }.reshape_arm(&rest.now(), &mut arm);
    let leaning = arm.axes[2].direction.angle(&rest.arm.axes[2].direction).to_degrees();
    assert!((leaning - 0.5).abs() < 1e-9);
    assert!((arm.axes[2].point_m - rest.arm.axes[2].point_m).norm() < 1e-12);
    assert_eq!(arm.axes[1], rest.arm.axes[1]);
    let wobble = AxisWobble { joint: 1, tilt_deg: 0.2, per_turn: 3.0, phase_deg: 0.0 };
    let leans: Vec<Vector3<f64>> = [0.0, std::f64::consts::TAU / 3.0, 0.5]
        .map(|q| {
            let rest = Rest::at([q, -0.7, 0.2]);
            let mut arm = rest.arm.clone();
            wobble.reshape_arm(&rest.now(), &mut arm);
            // Where the frame of the first link has its z, seen from the base.
            arm.tip_pose(&rest.link_rad) * rest.arm.tip_pose(&rest.link_rad).inverse() * Vector3::z()
        })
        .to_vec();
    assert!((leans[0] - leans[1]).norm() < 1e-12 && (leans[0] - leans[2]).norm() > 1e-3);
    assert!((leans[2].angle(&Vector3::z()).to_degrees() - 0.2).abs() < 1e-9);
}
