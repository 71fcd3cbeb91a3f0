//! Waypoints with times become a dense path: Cartesian cubic splines (Li et al. 2016, eq. 3).
//!
//! Each section is a cubic with position and velocity given at both ends, at rest at both ends of the path; at an
//! inner waypoint the velocity is the mean of the neighbouring sections', each weighted by the other's duration, so
//! that a parabola is followed exactly. Orientations turn at constant speed between waypoints (slerp).

use crate::{CompensateError, Target};
use armcal_core::Reference;
use nalgebra::Vector3;

/// The path through timed targets, `rate_hz` points a second, both ends included.
///
/// Errors name the first target without a time, one that is not later than the one before it, and one in another
/// frame.
pub fn resample(waypoints: &[Target], rate_hz: f64) -> Result<Vec<Target>, CompensateError> {
    let bad = |target: &Target, problem: &str| {
        Err(CompensateError::BadTarget { target: target.name.clone(), problem: problem.to_owned() })
    };
    let (Some(first), true) = (waypoints.first(), waypoints.len() > 1) else {
        return Err(CompensateError::NoTargets);
    };
    for pair in waypoints.windows(2) {
        match (pair[0].time_s, pair[1].time_s) {
            (Some(a), Some(b)) if b > a => {}
            (None, _) => return bad(&pair[0], "a path needs a time for every target; give t_s"),
            (_, None) => return bad(&pair[1], "a path needs a time for every target; give t_s"),
            _ => return bad(&pair[1], "its time is not later than that of the target before it"),
        }
        let same = std::mem::discriminant(&pair[0].place) == std::mem::discriminant(&pair[1].place);
        if !same || pair[0].has_orientation() != pair[1].has_orientation() {
            return bad(&pair[1], "a path must stay in one frame, with orientations everywhere or nowhere");
        }
    }
    let times: Vec<f64> = waypoints.iter().filter_map(|w| w.time_s).collect();
    let points: Vec<Vector3<f64>> = waypoints.iter().map(Target::position_m).collect();
    let velocities = waypoint_velocities(&times, &points);
    let (from_s, to_s) = (times[0], times[times.len() - 1]);
    let count = ((to_s - from_s) * rate_hz).round().max(1.0) as usize;
    let width = count.to_string().len();
    let at = |i: usize| {
        let time_s = from_s + (to_s - from_s) * i as f64 / count as f64;
        let section = times.partition_point(|t| *t <= time_s).clamp(1, times.len() - 1) - 1;
        let duration_s = times[section + 1] - times[section];
        let share = ((time_s - times[section]) / duration_s).clamp(0.0, 1.0);
        let ends = [points[section], points[section + 1]];
        let position_m = hermite(ends, [velocities[section], velocities[section + 1]], duration_s, share);
        let place = interpolate_reference(&waypoints[section], &waypoints[section + 1], position_m, share);
        Target { name: format!("{}+{i:0width$}", first.name), place, time_s: Some(time_s) }
    };
    Ok((0..=count).map(at).collect())
}

/// Velocities at the waypoints [m/s].
fn waypoint_velocities(times: &[f64], points: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let mean = |i: usize| (points[i + 1] - points[i]) / (times[i + 1] - times[i]);
    let inner = |i: usize| {
        let (before_s, after_s) = (times[i] - times[i - 1], times[i + 1] - times[i]);
        (mean(i - 1) * after_s + mean(i) * before_s) / (before_s + after_s)
    };
    let last = points.len() - 1;
    (0..=last).map(|i| if i == 0 || i == last { Vector3::zeros() } else { inner(i) }).collect()
}

/// The cubic of one section at a share of its duration.
fn hermite(ends: [Vector3<f64>; 2], speeds: [Vector3<f64>; 2], duration_s: f64, share: f64) -> Vector3<f64> {
    let (s2, s3) = (share * share, share * share * share);
    ends[0] * (2.0 * s3 - 3.0 * s2 + 1.0)
        + speeds[0] * ((s3 - 2.0 * s2 + share) * duration_s)
        + ends[1] * (3.0 * s2 - 2.0 * s3)
        + speeds[1] * ((s3 - s2) * duration_s)
}

fn interpolate_reference(from: &Target, to: &Target, position_m: Vector3<f64>, share: f64) -> Reference {
    match (&from.place, &to.place) {
        (
            Reference::Tracked { orientation: Some(a), .. },
            Reference::Tracked { orientation: Some(b), .. },
        ) => {
            // Opposite orientations have no shortest way between them: the first is kept.
            let orientation = Some(a.try_slerp(b, share, 1e-9).unwrap_or(*a));
            Reference::Tracked { position_m, orientation, orientation_sigma_rad: 0.0 }
        }
        (Reference::Seated { cavity, .. }, _) => {
            Reference::Seated { cavity: cavity.clone(), in_board_m: position_m }
        }
        _ => Reference::Tracked { position_m, orientation: None, orientation_sigma_rad: 0.0 },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn way(points: &[(f64, [f64; 3])]) -> Vec<Target> {
        let target = |(t, x): &(f64, [f64; 3])| Target::in_world(format!("w{t}"), (*x).into(), None).at(*t);
        points.iter().map(target).collect()
    }

    #[test]
    fn a_path_passes_its_waypoints_at_their_times_and_rests_at_its_ends() {
        let waypoints = way(&[(1.0, [0.0, 0.0, 0.1]), (2.0, [0.1, 0.0, 0.1]), (4.0, [0.1, 0.2, 0.0])]);
        let path = resample(&waypoints, 100.0).unwrap();
        assert_eq!(path.len(), 301);
        for (index, waypoint) in [(0, 0), (100, 1), (300, 2)] {
            let off_m = path[index].position_m() - waypoints[waypoint].position_m();
            assert!(off_m.norm() < 1e-12, "{waypoint}: {off_m}");
        }
        let speed = |i: usize| (path[i + 1].position_m() - path[i].position_m()).norm() * 100.0;
        // From rest the way grows with the square of time: 3 v t / T after t.
        assert!(speed(0) < 0.02 * 3.0 * 0.1 && speed(299) < 0.02 * 3.0 * 0.2);
        assert!(speed(100) > 0.05);
    }

    #[test]
    fn a_parabola_is_followed_exactly_between_inner_waypoints() {
        let at = |t: f64| [0.3 * t * t - t, 0.2 * t, 0.5 - 0.1 * t * t];
        let waypoints = way(&[0.0, 0.7, 1.5, 2.0, 3.0].map(|t| (t, at(t))));
        for point in resample(&waypoints, 50.0).unwrap() {
            let t = point.time_s.unwrap();
            if (0.7..=2.0).contains(&t) {
                assert!((point.position_m() - Vector3::from(at(t))).norm() < 1e-12, "at {t} s");
            }
        }
    }

    #[test]
    fn times_that_do_not_rise_are_refused_by_name() {
        let error = resample(&way(&[(1.0, [0.0; 3]), (1.0, [0.1; 3])]), 10.0).unwrap_err();
        assert!(error.to_string().contains("w1") && error.to_string().contains("later"), "{error}");
        let mut open = way(&[(1.0, [0.0; 3]), (2.0, [0.1; 3])]);
        open[1].time_s = None;
        assert!(resample(&open, 10.0).unwrap_err().to_string().contains("t_s"));
    }
}
