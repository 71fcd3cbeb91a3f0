//! Clause 8 against closed forms, on planes through whole paths.

use super::{close, mm, sampled, turned};
use crate::command::CommandPath;
use crate::cornering::{overshoot_m, round_off_m};
use crate::path::{path_accuracy, path_repeatability};
use crate::planes::{Crossing, find_crossings};
use crate::velocity::{velocity_accuracy, velocity_fluctuation_m_s, velocity_repeatability};
use crate::{IsoError, TimedPose, TipPose};
use nalgebra::Vector3;
use std::f64::consts::{PI, TAU};

fn on_planes(
    command: &CommandPath,
    count: usize,
    runs: &[Vec<TimedPose>],
) -> (Vec<TipPose>, Vec<Vec<TipPose>>) {
    let planes = command.planes(count);
    let crossings: Vec<Vec<Option<Crossing>>> =
        runs.iter().map(|run| find_crossings(&planes, run, 0.3 * command.length_m())).collect();
    let attained = |i: usize| crossings.iter().map(|run| run[i].unwrap().pose).collect();
    (planes.iter().map(|p| p.pose).collect(), (0..count).map(attained).collect())
}

fn circle(radius_mm: f64, pieces: usize) -> Vec<TipPose> {
    let turn = |i: usize| TAU * i as f64 / pieces as f64;
    (0..=pieces).map(|i| mm(radius_mm * turn(i).cos(), radius_mm * turn(i).sin(), 0.0)).collect()
}

#[test]
fn a_line_shifted_sideways_is_inaccurate_by_the_shift() {
    let command = CommandPath::new(&[mm(0.0, 0.0, 0.0), mm(300.0, 0.0, 400.0)]).unwrap();
    close(command.length_m(), 0.5, 1e-15);
    // Normal to (3, 0, 4): (4, 0, -3) / 5 by 5 mm, and y by 12 mm: 13 mm. A shift along the path does not count.
    let run = sampled(7e-3, 2.0, |t| mm(300.0 * t - 60.0 + 4.0, 12.0, 400.0 * t - 80.0 - 3.0));
    let (commanded, attained) = on_planes(&command, 50, &[run]);
    close(path_accuracy(&commanded, &attained).unwrap().position_m, 13e-3, 1e-14);
}

#[test]
fn accuracy_takes_the_mean_over_cycles_and_repeatability_their_spread() {
    // Two runs 3 and 1 mm beside the command: mean 2 mm; l = 1, 1 mm and S = 0, so RT = 1 mm.
    let command = CommandPath::new(&[mm(0.0, 0.0, 0.0), mm(100.0, 0.0, 0.0)]).unwrap();
    let runs = [3.0, 1.0].map(|aside| sampled(0.01, 1.2, |t| mm(100.0 * t - 10.0, aside, 0.0)));
    let (commanded, attained) = on_planes(&command, 20, &runs);
    close(path_accuracy(&commanded, &attained).unwrap().position_m, 2e-3, 1e-15);
    close(path_repeatability(&attained).unwrap().position_m, 1e-3, 1e-15);
}

#[test]
fn a_circle_too_large_is_inaccurate_by_its_radius() {
    // Twice around would meet every plane again, and each plane cuts the far side too.
    let command = CommandPath::new(&circle(100.0, 3600)).unwrap();
    let run = sampled(1e-3, 1.0, |t| {
        let turn = TAU * t * 1.2 - 0.3;
        mm(101.5 * turn.cos(), 101.5 * turn.sin(), 0.0)
    });
    let (commanded, attained) = on_planes(&command, 100, &[run]);
    let at = path_accuracy(&commanded, &attained).unwrap();
    // A polyline lies inside its circle by the sagitta r (1 - cos(step / 2)).
    close(at.position_m, 1.5e-3, 0.1015 * (1.0 - (TAU * 1.2e-3 / 2.0).cos()) + 1e-7);
}

#[test]
fn a_tremor_at_rest_on_the_way_does_not_confuse_the_planes() {
    let command = CommandPath::new(&[mm(0.0, 0.0, 0.0), mm(100.0, 0.0, 0.0)]).unwrap();
    // Stops at 35 mm for a second and trembles through a plane hundreds of times, then comes back at the end.
    let x_mm = |t: f64| match t {
        t if t < 0.5 => 90.0 * t - 10.0,
        t if t < 1.5 => 35.0 + 0.2 * (2000.0 * t).sin(),
        t if t < 2.5 => 35.0 + 80.0 * (t - 1.5),
        _ => 115.0 - 100.0 * (t - 2.5),
    };
    let run = sampled(1e-3, 3.5, |t| mm(x_mm(t), if t > 2.5 { 7.0 } else { 2.0 }, 0.0));
    let (commanded, attained) = on_planes(&command, 50, &[run]);
    close(path_accuracy(&commanded, &attained).unwrap().position_m, 2e-3, 1e-12);
}

#[test]
fn a_plane_that_a_run_does_not_reach_stays_empty() {
    let command = CommandPath::new(&[mm(0.0, 0.0, 0.0), mm(100.0, 0.0, 0.0)]).unwrap();
    let planes = command.planes(10);
    let half = sampled(0.01, 0.5, |t| mm(100.0 * t, 0.0, 0.0));
    let crossed: Vec<bool> = find_crossings(&planes, &half, 0.03).iter().map(Option::is_some).collect();
    assert_eq!(crossed, [[true; 5], [false; 5]].concat());
    let far = sampled(0.01, 1.0, |t| mm(100.0 * t, 31.0, 0.0));
    assert!(find_crossings(&planes, &far, 0.03).iter().all(Option::is_none));
    assert!(find_crossings(&planes, &[], 0.03).iter().all(Option::is_none));
}

#[test]
fn angles_along_a_path_are_compared_on_the_planes() {
    // The command turns by 60 deg about x on its way; the tip lags by 1 deg, and one run by 3 deg.
    let command: Vec<TipPose> = (0..=60)
        .map(|i| turned(mm(5.0 * i as f64, 0.0, 0.0), [f64::from(i).to_radians(), 0.0, 0.0]))
        .collect();
    let command = CommandPath::new(&command).unwrap();
    let runs = [1.0, 3.0].map(|lag: f64| {
        sampled(1e-2, 1.2, |t| {
            turned(mm(300.0 * t - 30.0, 0.0, 0.0), [(60.0 * t - 6.0 - lag).to_radians(), 0.0, 0.0])
        })
    });
    close(command.reorientation_rad().unwrap(), PI / 3.0, 1e-12);
    let (commanded, attained) = on_planes(&command, 40, &runs);
    let at = path_accuracy(&commanded, &attained).unwrap().angles_rad.unwrap();
    let rt = path_repeatability(&attained).unwrap().angles_rad.unwrap();
    close(at.x.to_degrees(), 2.0, 1e-9);
    // S of -1, 1 deg is sqrt(2) deg.
    close(rt.x.to_degrees(), 3.0 * 2.0_f64.sqrt(), 1e-9);
}

#[test]
fn a_rounded_corner_is_cut_by_its_closed_form() {
    // A fillet of radius r misses a right corner by r (sqrt(2) - 1): 4.142136 mm for 10 mm. Another run cuts by
    // twice that.
    let command = CommandPath::new(&[mm(0.0, 0.0, 0.0), mm(100.0, 0.0, 0.0), mm(100.0, 50.0, 0.0)]).unwrap();
    let corners = command.corners(0.5);
    assert_eq!(corners.len(), 1);
    close(corners[0].straight_m, 0.05, 1e-15);
    let fillet = |r: f64| -> Vec<Vector3<f64>> {
        let arc = (0..=900).map(move |i| -PI / 2.0 + PI / 2.0 * f64::from(i) / 900.0);
        let arc = arc.map(move |a| mm(100.0 - r + r * a.cos(), r + r * a.sin(), 0.0).position_m);
        [mm(0.0, 0.0, 0.0).position_m]
            .into_iter()
            .chain(arc)
            .chain([mm(100.0, 50.0, 0.0).position_m])
            .collect()
    };
    let cr = round_off_m(&corners[0], &[fillet(10.0), fillet(20.0)]).unwrap();
    close(cr, 15.0 * (2.0_f64.sqrt() - 1.0) * 1e-3, 1e-8);
    close(overshoot_m(&corners[0], &[fillet(10.0)]).unwrap(), 0.0, 1e-15);
}

#[test]
fn an_overshoot_counts_beyond_the_second_leg_only() {
    let command = [mm(0.0, 0.0, 0.0), mm(100.0, 0.0, 0.0), mm(100.0, 50.0, 0.0), mm(0.0, 50.0, 0.0)];
    let corners = CommandPath::new(&command).unwrap().corners(0.5);
    assert_eq!(corners.len(), 2);
    let run = |beyond: f64| -> Vec<Vector3<f64>> {
        let points = [
            mm(0.0, 0.0, 0.0),
            mm(100.0, 0.0, 0.0),
            mm(100.0 + beyond, 2.0, 4.0),
            mm(99.0, 10.0, 0.0),
            // Beyond the end of the second leg: the second corner's business.
            mm(103.0, 56.0, 0.0),
            mm(0.0, 50.0, 0.0),
        ];
        points.iter().map(|p| p.position_m).collect()
    };
    // First cycle 3 beyond and 4 out of the plane: 5 mm; the second stays inside: 0. Mean 2.5 mm.
    close(overshoot_m(&corners[0], &[run(3.0), run(-3.0)]).unwrap(), 2.5e-3, 1e-15);
    close(overshoot_m(&corners[1], &[run(3.0)]).unwrap(), 6e-3, 1e-15);
    close(round_off_m(&corners[0], &[run(3.0)]).unwrap(), 0.0, 1e-15);
}

#[test]
fn velocity_by_hand() {
    // Means 0.20 and 0.22 m/s of 0.20: AV = 0.01 / 0.20 = 5 %. S_v = sqrt(2 * 0.01^2 / 1) = 0.0141421, RV = 21.213 %.
    // Spans 0.04 and 0.02 m/s: FV = 0.04 m/s.
    let runs = [vec![0.18, 0.20, 0.22], vec![0.21, 0.22, 0.23]];
    close(velocity_accuracy(0.2, &runs).unwrap(), 0.05, 1e-12);
    close(velocity_repeatability(0.2, &runs).unwrap(), 0.212_132_034, 1e-9);
    close(velocity_fluctuation_m_s(&runs).unwrap(), 0.04, 1e-12);
    assert!(velocity_accuracy(0.0, &runs).is_err());
    assert!(velocity_repeatability(0.2, &runs[..1]).is_err());
    assert!(velocity_fluctuation_m_s(&[vec![]]).is_err());
}

#[test]
fn a_command_without_length_is_refused_and_doubled_points_are_not() {
    assert_eq!(CommandPath::new(&[mm(1.0, 0.0, 0.0); 3]), Err(IsoError::NoLength));
    assert_eq!(CommandPath::new(&[]), Err(IsoError::NoLength));
    let doubled = [mm(0.0, 0.0, 0.0), mm(0.0, 0.0, 0.0), mm(1.0, 0.0, 0.0), mm(1.0, 0.0, 0.0)];
    close(CommandPath::new(&doubled).unwrap().length_m(), 1e-3, 1e-18);
    assert!(CommandPath::new(&[mm(0.0, 0.0, 0.0), mm(f64::INFINITY, 0.0, 0.0)]).is_err());
}
