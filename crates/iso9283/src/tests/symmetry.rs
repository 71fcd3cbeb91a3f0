//! Laws that hold for any evidence: a rigid motion of the world, the order of the list and the origin of time
//! change nothing; lengths scale; rubbish is refused and never panics.

use super::{mm, sampled, turned};
use crate::{Assessment, Evidence, PathTest, Settings, TimedPose, TipPose, Visit, assess};
use armcal_core::Pose;
use nalgebra::{Translation3, UnitQuaternion, Vector3};
use proptest::prelude::*;

fn vector(span: f64) -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-span..span).prop_map(Vector3::from)
}

/// One to four poses, visited in any order from a few directions, up to 25 times in all, errors of some millimetres.
fn visits() -> impl Strategy<Value = Vec<Visit>> {
    let stop = (0..4_usize, 0..4_usize, vector(3e-3), vector(2e-3));
    prop::collection::vec(stop, 1..25).prop_map(|stops| {
        let stops = stops.into_iter().enumerate();
        stops
            .map(|(i, (pose, from, error_m, turn_rad))| visit(i as i64, pose, from, error_m, turn_rad))
            .collect()
    })
}

fn visit(index: i64, pose: usize, from: usize, error_m: Vector3<f64>, turn_rad: Vector3<f64>) -> Visit {
    let commanded =
        turned(mm(70.0 * pose as f64, 40.0, -90.0 * (pose % 2) as f64), [0.1 * pose as f64, 0.4, 0.0]);
    let attained = TipPose {
        position_m: commanded.position_m + error_m,
        orientation: commanded.orientation.map(|q| UnitQuaternion::from_scaled_axis(turn_rad) * q),
    };
    let approaches = [None, Some(Vector3::x()), Some(Vector3::y() * 0.3), Some(-Vector3::z())];
    let from_m = attained.position_m + Vector3::new(0.05, 0.01, 0.0);
    let start_ns = index * 3_000_000_000;
    let arrival = sampled(0.05, 1.0, |t| TipPose {
        position_m: attained.position_m.lerp(&from_m, (-6.0 * t).exp() * (14.0 * t).cos()),
        ..attained
    });
    let rest = TimedPose { time_ns: 1_500_000_000, pose: attained };
    let later = |s: TimedPose| TimedPose { time_ns: s.time_ns + start_ns, ..s };
    Visit {
        pose: format!("P{pose}"),
        recording: 0,
        commanded,
        attained,
        time_ns: start_ns + 1_500_000_000,
        approach: approaches[from],
        departed_ns: Some(start_ns - 500_000_000),
        arrival: arrival.into_iter().chain([rest]).map(later).collect(),
    }
}

/// An L with a corner, run a few times with a sideways error each.
fn path() -> impl Strategy<Value = PathTest> {
    prop::collection::vec(vector(2e-3), 1..4).prop_map(|errors_m| PathTest {
        name: "L".into(),
        commanded: [mm(0.0, 0.0, 0.0), mm(200.0, 0.0, 0.0), mm(200.0, 150.0, 50.0)]
            .map(|p| turned(p, [0.0; 3]))
            .to_vec(),
        runs: errors_m
            .iter()
            .map(|e| {
                sampled(0.02, 1.8, |t| {
                    let s = (200.0 * t).min(200.0);
                    let late = (200.0 * t - s).max(0.0);
                    let on = mm(s - 3.0 * (-late * 0.1).exp(), 0.95 * late, 0.3 * late);
                    turned(TipPose::at(on.position_m + e), [0.3 * e.x, e.y, 0.0])
                })
            })
            .collect(),
        speed_m_s: Some(0.2),
    })
}

fn evidence() -> impl Strategy<Value = Evidence> {
    (visits(), path()).prop_map(|(visits, path)| Evidence { visits, paths: vec![path] })
}

fn moved(evidence: &Evidence, by: &Pose) -> Evidence {
    let timed = |s: &TimedPose| TimedPose { pose: s.pose.moved(by), ..*s };
    let visit = |v: &Visit| Visit {
        commanded: v.commanded.moved(by),
        attained: v.attained.moved(by),
        approach: v.approach.map(|d| by.rotation * d),
        arrival: v.arrival.iter().map(timed).collect(),
        ..v.clone()
    };
    let path = |p: &PathTest| PathTest {
        commanded: p.commanded.iter().map(|c| c.moved(by)).collect(),
        runs: p.runs.iter().map(|run| run.iter().map(timed).collect()).collect(),
        ..p.clone()
    };
    Evidence {
        visits: evidence.visits.iter().map(visit).collect(),
        paths: evidence.paths.iter().map(path).collect(),
    }
}

/// Everything but the parts along and about the axes, which turn with the world; places without their directions.
fn without_axes(assessment: &Assessment) -> Vec<(String, String, f64)> {
    let of_axis = |name: &str| name.contains("along ") || name.contains("about ");
    let kept = assessment.criteria.iter().filter(|c| !of_axis(&c.name));
    let place = |at: &str| at.split(" arriving").next().unwrap_or_default().to_owned();
    kept.map(|c| (format!("{} {}", c.clause, c.name), place(&c.at), c.value)).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn a_rigid_motion_of_the_world_changes_no_criterion(
        evidence in evidence(), shift in vector(3.0), turn in vector(3.0),
    ) {
        let by = Pose::from_parts(Translation3::from(shift), UnitQuaternion::from_scaled_axis(turn));
        let settings = Settings { limit_band_m: Some(4e-3), ..Settings::default() };
        let here = without_axes(&assess(&evidence, &settings).unwrap());
        let there = without_axes(&assess(&moved(&evidence, &by), &settings).unwrap());
        prop_assert_eq!(here.len(), there.len());
        for (a, b) in here.iter().zip(&there) {
            prop_assert!(a.0 == b.0 && a.1 == b.1 && (a.2 - b.2).abs() <= 1e-8, "{:?} became {:?}", a, b);
        }
    }

    #[test]
    fn the_vector_of_accuracy_turns_with_the_world(
        errors in prop::collection::vec(vector(3e-3), 1..9), turn in vector(3.0),
    ) {
        let commanded = mm(300.0, -20.0, 80.0);
        let attained: Vec<TipPose> = errors.iter().map(|e| TipPose::at(commanded.position_m + e)).collect();
        let by = Pose::from_parts(Translation3::identity(), UnitQuaternion::from_scaled_axis(turn));
        let there: Vec<TipPose> = attained.iter().map(|p| p.moved(&by)).collect();
        let a = crate::pose::pose_accuracy(&commanded, &attained).unwrap().axes_m;
        let b = crate::pose::pose_accuracy(&commanded.moved(&by), &there).unwrap().axes_m;
        prop_assert!((by.rotation * a - b).norm() < 1e-14);
    }

    #[test]
    fn the_order_of_the_list_and_the_origin_of_time_do_not_matter(evidence in evidence(), seed in any::<u64>()) {
        let mut other = evidence.clone();
        let count = other.visits.len();
        (0..count).for_each(|i| other.visits.swap(i, (seed as usize).wrapping_mul(i + 7) % count));
        let later_ns = 1_700_000_000_000_000_000;
        for visit in &mut other.visits {
            visit.time_ns += later_ns;
            visit.departed_ns = visit.departed_ns.map(|t| t + later_ns);
            visit.arrival.iter_mut().for_each(|s| s.time_ns += later_ns);
        }
        let settings = Settings { limit_band_m: Some(4e-3), ..Settings::default() };
        prop_assert_eq!(assess(&evidence, &settings).unwrap(), assess(&other, &settings).unwrap());
    }

    #[test]
    fn repeatability_of_a_cluster_n_times_as_large_is_n_times_as_large(
        cluster in prop::collection::vec(vector(1.0), 2..20), scale in 0.1..10.0,
    ) {
        let at = |s: f64| cluster.iter().map(|p| TipPose::at(p * s)).collect::<Vec<_>>();
        let one = crate::pose::pose_repeatability(&at(1.0)).unwrap().radius_m;
        let many = crate::pose::pose_repeatability(&at(scale)).unwrap().radius_m;
        prop_assert!((many - scale * one).abs() <= 1e-12 * (1.0 + many));
    }

    #[test]
    fn rubbish_never_panics(
        numbers in prop::collection::vec(prop::num::f64::ANY, 12..40), times in prop::collection::vec(any::<i64>(), 40),
        planes in 0..9_usize,
    ) {
        let at = |i: usize| TipPose::at(Vector3::from_fn(|k, _| numbers[(i + k) % numbers.len()]));
        let run: Vec<TimedPose> =
            (0..numbers.len()).map(|i| TimedPose { time_ns: times[i % times.len()], pose: at(i) }).collect();
        let visit = |i: usize| Visit {
            pose: "P".into(), recording: 0, commanded: at(0), attained: at(i), time_ns: times[i],
            approach: Some(at(i + 1).position_m), departed_ns: Some(times[i]), arrival: run.clone(),
        };
        let mut sorted = run.clone();
        sorted.sort_by_key(|s| s.time_ns);
        sorted.dedup_by_key(|s| s.time_ns);
        let test = PathTest {
            name: "path".into(), commanded: (0..8).map(at).collect(),
            runs: vec![sorted.clone(), run.clone(), Vec::new()], speed_m_s: Some(numbers[0]),
        };
        let evidence = Evidence { visits: (0..9).map(visit).collect(), paths: vec![test.clone()] };
        let settings = Settings { planes, limit_band_m: Some(numbers[3]), ..Settings::default() };
        let _ = assess(&evidence, &settings);
        let path = PathTest { runs: vec![sorted], ..test };
        let only_paths = Evidence { paths: vec![path], ..Evidence::default() };
        let _ = assess(&only_paths, &settings);
    }
}
