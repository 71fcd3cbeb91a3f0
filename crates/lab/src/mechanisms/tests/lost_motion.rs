//! Gaps and friction.

use super::*;

#[test]
fn a_gap_follows_on_one_flank_or_the_other_and_never_leaves_them() {
    let (half, rest) = (0.3f64.to_radians(), Rest::at([0.0, -0.8, 0.0]));
    let mut gap = mechanism("kind = 'gap'\njoint = 2\nwidth_deg = 0.6");
    let at = |m: &mut dyn Mechanism, q: f64| link(m, &rest, [0.0, q, 0.0])[1] - q;
    at(&mut *gap, 0.0);
    for (q, lag) in
        [(0.2, -half), (0.2 - half, 0.0), (0.1, half), (0.1 + half / 2.0, half / 2.0), (0.3, -half)]
    {
        assert!((at(&mut *gap, q) - lag).abs() < 1e-12, "{q}");
    }
    // The hand drives: the link leads, so the sign is the other one.
    let mut gap = mechanism("kind = 'gap'\njoint = 2\nwidth_deg = 0.6");
    let mut lead = |q: f64| q - motor(&mut *gap, &rest, [0.0, q, 0.0])[1];
    lead(0.0);
    for (q, lag) in [(0.2, half), (0.2 - half, 0.0), (0.1, -half), (0.3, half)] {
        assert!((lead(q) - lag).abs() < 1e-12, "{q}");
    }
}

#[test]
fn what_lags_has_a_third_of_its_way_left_after_a_time_constant() {
    let mut rest = Rest::at([0.0; 3]);
    for (kind, expected) in
        [(link as fn(&mut dyn Mechanism, &Rest, [f64; 3]) -> Vec<f64>, false), (motor, true)]
    {
        let mut lag = mechanism("kind = 'lag'\njoint = 2\ntime_constant_s = 0.4");
        let mut at = |time_s: f64, q: f64, jogged: bool| {
            (rest.session_s, rest.motors_lead) = (time_s, jogged);
            kind(&mut *lag, &rest, [0.0, q, 0.0])[1]
        };
        assert_eq!(at(0.0, 0.1, false), 0.1);
        // However many looks there are on the way.
        at(1.1, 0.3, false);
        let _ = (at(1.1, 0.5, false), at(1.3, 0.5, false));
        let before = at(1.3, 0.5, false);
        assert!((at(1.7, 0.5, false) - 0.5 - (before - 0.5) / std::f64::consts::E).abs() < 1e-12);
        // Jogged there, it is there.
        assert_eq!(at(1.7, 0.2, true) == 0.2, expected);
    }
}

#[test]
fn gravity_closes_a_gap_unless_friction_is_stronger() {
    let half = 0.3f64.to_radians();
    for (q2, side) in [(-0.8, -1.0), (0.8, 1.0)] {
        let rest = Rest::at([0.0, q2, if q2 > 0.0 { 0.9 } else { 0.0 }]);
        // Leaning forwards gravity turns joint 2 on, towards -q; leaning backwards towards +q.
        assert!(rest.gravity_nm[1] * side > 1.0);
        let mut loose = mechanism("kind = 'gap'\njoint = 2\nwidth_deg = 0.6\nfriction_nm = 0.5");
        for q in [0.0, 0.2, 0.1] {
            assert!((link(&mut *loose, &rest, [0.0, q, 0.0])[1] - q - side * half).abs() < 1e-12);
            assert!((q - motor(&mut *loose, &rest, [0.0, q, 0.0])[1] - side * half).abs() < 1e-12);
        }
        let mut tight = mechanism("kind = 'gap'\njoint = 2\nwidth_deg = 0.6\nfriction_nm = 50.0");
        link(&mut *tight, &rest, [0.0; 3]);
        assert!((link(&mut *tight, &rest, [0.0, 0.2, 0.0])[1] - 0.2 + half).abs() < 1e-12);
    }
}

#[test]
fn a_belt_gap_is_in_the_sum_of_both_angles() {
    let (half, rest) = (0.3f64.to_radians(), Rest::at([0.0; 3]));
    let mut gap = mechanism("kind = 'gap'\njoint = 3\nbelt_over = 2\nwidth_deg = 0.6");
    link(&mut *gap, &rest, [0.0, 0.0, 0.0]);
    // The sum stays: no flank is touched, whatever the two joints do.
    assert!(link(&mut *gap, &rest, [0.0, 0.3, -0.3])[2] + 0.3 < 1e-12);
    assert!((link(&mut *gap, &rest, [0.0, 0.5, -0.3])[2] + 0.3 + half).abs() < 1e-12);
}

#[test]
fn friction_winds_a_shaft_up_by_friction_over_stiffness_and_with_the_load() {
    let rest = Rest::at([0.0, -1.2, 0.5]);
    let mut wound = mechanism(
        "kind = 'friction_windup'\njoint = 2\nstiffness_nm_rad = 500.0\nfriction_nm = 2.0\nload_share = 0.3\n\
         balanced = false",
    );
    let (limit, sag) = ((2.0 + 0.3 * rest.gravity_nm[1].abs()) / 500.0, rest.gravity_nm[1] / 500.0);
    let mut off = |q: f64| link(&mut *wound, &rest, [0.0, q, 0.0])[1] - q;
    off(0.0);
    for (q, lag) in [(0.2, -limit), (0.1, limit), (0.1 + limit, 0.0)] {
        assert!((off(q) - lag - sag).abs() < 1e-12, "{q}");
    }
    let mut lead = |q: f64| q - motor(&mut *wound, &rest, [0.0, q, 0.0])[1];
    assert!((lead(0.3) - limit - sag).abs() < 1e-12 && (lead(0.1) + limit - sag).abs() < 1e-12);
}

#[test]
fn motors_that_lead_push_the_flank_ahead() {
    let half = 0.3f64.to_radians();
    let rest = Rest { motors_lead: true, ..Rest::at([0.0, -0.8, 0.0]) };
    let mut gap = mechanism("kind = 'gap'\njoint = 2\nwidth_deg = 0.6");
    let mut lag = |q: f64| q - motor(&mut *gap, &rest, [0.0, q, 0.0])[1];
    lag(0.0);
    // The link is where the motor's own path through the play would leave it.
    for (q, off) in [(0.2, -half), (0.2, -half), (0.199, half), (0.1, half), (0.3, -half)] {
        assert!((lag(q) - off).abs() < 1e-12, "{q}");
    }
}
