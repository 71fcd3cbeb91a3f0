//! Springs, beams and plates.

use super::*;

/// The link angle of least energy near the motor's, by a search that knows no torque.
fn least(energy: impl Fn(f64) -> f64, around: f64) -> f64 {
    let golden = 0.5 * (5f64.sqrt() - 1.0);
    let (mut low, mut high) = (around - 0.1, around + 0.1);
    while high - low > 1e-9 {
        let (a, b) = (high - golden * (high - low), low + golden * (high - low));
        if energy(a) < energy(b) { high = b } else { low = a }
    }
    (low + high) / 2.0
}

#[test]
fn springs_come_to_rest_where_energy_is_least() {
    for (text, spring_j) in [
        ("stiffness_nm_rad = 300.0", (|x: f64| 150.0 * x * x) as fn(f64) -> f64),
        ("stiffness_nm_rad = 200.0\nhardening_nm_rad3 = 9e5", |x| 100.0 * x * x + 9e5 / 4.0 * x.powi(4)),
    ] {
        let mut spring = mechanism(&format!("kind = 'compliance'\njoint = 2\n{text}"));
        let motor = [0.3, -0.9, 0.4];
        let mut rest = Rest::at(motor);
        let q2 = least(|q| rest.potential_j(&[0.3, q, 0.4]) + spring_j(q - motor[1]), motor[1]);
        for _ in 0..50 {
            rest = Rest::at([0.3, link(&mut *spring, &rest, motor)[1], 0.4]);
        }
        assert!((rest.link_rad[1] - q2).abs() < 1e-7, "{} {q2}", rest.link_rad[1]);
        assert!((rest.link_rad[1] - motor[1]).abs() > 0.01);
    }
}

#[test]
fn a_belt_holds_the_forearms_absolute_angle_where_energy_is_least() {
    let mut springs = mechanism(
        "kind = 'belt_compliance'\njoint = 2\nstiffness_nm_rad = 300.0\nbelt_stiffness_nm_rad = 100.0",
    );
    let motor = [0.0, -0.9, 0.4];
    let mut rest = Rest::at(motor);
    for _ in 0..50 {
        let q = link(&mut *springs, &rest, motor);
        rest = Rest::at([q[0], q[1], q[2]]);
    }
    let energy = |q2: f64, q23: f64| {
        let springs = 150.0 * (q2 - motor[1]).powi(2) + 50.0 * (q23 - motor[1] - motor[2]).powi(2);
        rest.potential_j(&[0.0, q2, q23 - q2]) + springs
    };
    let (q2, q23) = (rest.link_rad[1], rest.link_rad[1] + rest.link_rad[2]);
    assert!((least(|q| energy(q, q23), q2) - q2).abs() < 1e-7);
    assert!((least(|q| energy(q2, q), q23) - q23).abs() < 1e-7);
}

#[test]
fn a_sagging_link_agrees_with_the_textbook_beam() {
    // Upper arm level and forward, forearm hanging straight on.
    let rest = Rest::at([0.0, -std::f64::consts::FRAC_PI_2, std::f64::consts::FRAC_PI_2]);
    let (stiffness, length) = (40.0, 0.4f64);
    let beam = LinkBending { link: 2, stiffness_nm2: stiffness };
    let sag = beam.sag(&rest.now(), &rest.arm);
    let end = rest.arm.axes[1].point_m + rest.arm.link_m(1);
    let beyond = [
        (rest.arm.carried(2, &rest.arm.mass_centres_m[2], &[0.0, 0.0, rest.link_rad[2]]), 0.6),
        (rest.arm.carried(2, &rest.arm.tip_m, &[0.0, 0.0, rest.link_rad[2]]), 0.65),
    ];
    let force: f64 = beyond.iter().map(|(_, kg)| 9.81 * kg).sum();
    let moment: f64 = beyond.iter().map(|(at, kg)| 9.81 * kg * (at - end).z).sum();
    let weight = 9.81 * 1.2 / length;
    let shift =
        (force * length.powi(3) / 3.0 + moment * length.powi(2) / 2.0 + weight * length.powi(4) / 8.0)
            / stiffness;
    let slope = (force * length.powi(2) / 2.0 + moment * length + weight * length.powi(3) / 6.0) / stiffness;
    assert!((sag.shift_m.norm() / shift - 1.0).abs() < 1e-3, "{} {shift}", sag.shift_m.norm());
    assert!((sag.turn_rad.norm() / slope - 1.0).abs() < 2e-2, "{} {slope}", sag.turn_rad.norm());
    // It goes down.
    let mut arm = rest.arm.clone();
    beam.reshape_arm(&rest.now(), &mut arm);
    let down = rest.arm.tip(&rest.link_rad).z - arm.tip(&rest.link_rad).z;
    assert!(down > shift && down < shift + slope * 0.4, "{down}");
}

#[test]
fn the_base_rocks_towards_where_the_arm_hangs_out() {
    let plate = BaseCompliance { stiffness_nm_rad: 1000.0 };
    for yaw in [0.0, 1.0, -2.0] {
        let rest = Rest::at([yaw, -1.0, 0.2]);
        let rock = plate.rock_rad(&rest.now());
        // A quarter turn from the arm, so that its side of the plate sinks.
        let expected = Vector3::new(-yaw.sin(), yaw.cos(), 0.0);
        assert!((rock.normalize() - expected).norm() < 0.1, "{rock}");
        let mut base = Pose::identity();
        plate.move_base(&rest.now(), &mut base);
        let tip = nalgebra::Point3::from(rest.arm.tip(&rest.link_rad));
        assert!((base * tip).z < tip.z);
    }
}
