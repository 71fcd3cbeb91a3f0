//! The quick path against the full streams.

use super::*;
use crate::config::{Order, PassConfig};
use crate::mechanisms::MechanismConfig;
use crate::{nothing_hidden, simulate_in_memory};
use armcal_core::Arrival;

const LABS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../pipelines/lab");

fn lab(extra: &str) -> LabConfig {
    let path = Path::new(LABS).join("paper-small.toml");
    let text = std::fs::read_to_string(&path).unwrap() + extra;
    let mut config = LabConfig::from_toml(&text, &path).unwrap();
    config.recordings.truncate(1);
    config.task.passes =
        [Order::Forward, Order::Random].map(|order| PassConfig { order, share: 0.5 }).to_vec();
    config.task.free.poses = 8;
    config
}

fn kinds(truth: &Truth) -> Vec<(RestKind, Option<String>)> {
    truth.recordings[0].dwells.iter().map(|d| (d.kind, d.cavity.clone())).collect()
}

#[test]
fn it_agrees_with_the_streams_dwell_by_dwell() {
    let hidden = "\n[[mechanisms]]\nkind = 'gap'\njoint = 1\nwidth_deg = 0.6\n\
        \n[[mechanisms]]\nkind = 'compliance'\njoint = 2\nstiffness_nm_rad = 600.0\n";
    for by_hand in [true, false] {
        let mut config = lab(hidden);
        config.task.free.by_hand = by_hand;
        let quick = observe_from(&config, Path::new(LABS)).unwrap();
        let (full, _) = simulate_in_memory(&config, Path::new(LABS), &nothing_hidden).unwrap();
        assert_eq!(kinds(&quick.truth), kinds(&full));
        assert_eq!(quick.observations.len(), full.recordings[0].dwells.len());
        let width = 0.6f64.to_radians();
        let (mut off_flank, mut turned) = (0, 0);
        let pairs = quick.truth.recordings[0].dwells.iter().zip(&full.recordings[0].dwells);
        for ((q, f), o) in pairs.zip(&quick.observations) {
            assert!((q.start_ns - f.start_ns).abs() < 1_500_000_000, "{} {}", q.start_ns, f.start_ns);
            assert!((o.joint_rad[2] - q.motor_rad[2]).abs() < 1e-4, "{q:?} {o:?}");
            if q.kind == RestKind::Seated {
                let apart = (0..3).map(|k| (q.tip_world_m[k] - f.tip_world_m[k]).powi(2)).sum::<f64>().sqrt();
                assert!(apart < 60e-6, "{:?}: {apart} m", q.cavity);
            }
            for joint in [1, 2] {
                let [quick, full] = [q, f].map(|d| d.link_rad[joint] - d.motor_rad[joint]);
                assert!((quick - full).abs() < 6e-5, "joint {joint}: {quick} {full}");
            }
            let [quick, full] = [q, f].map(|d| d.link_rad[0] - d.motor_rad[0]);
            off_flank += usize::from((quick - full).abs() > 0.15 * width);
            turned += usize::from(f.arrival != q.arrival);
        }
        let n = quick.observations.len();
        println!("by hand {by_hand}: {off_flank} gaps and {turned} arrivals of {n} differ");
        assert!(
            10 * off_flank <= n && 10 * turned <= n,
            "{off_flank} gaps and {turned} arrivals of {n} differ"
        );
    }
}

#[test]
fn the_same_seed_gives_the_same_observations() {
    let config = lab("");
    let [a, b] = [0, 0].map(|_| observe_from(&config, Path::new(LABS)).unwrap());
    assert_eq!(a, b);
    let other = LabConfig { seed: 5, ..config };
    assert_ne!(a.observations, observe_from(&other, Path::new(LABS)).unwrap().observations);
}

#[test]
fn declaring_other_noise_changes_no_reading() {
    let seen = observe_from(&lab(""), Path::new(LABS)).unwrap();
    assert_eq!(seen.clone().declaring(1.0), seen);
    let declared = seen.clone().declaring(10.0);
    assert_eq!((&declared.nominal, &declared.truth), (&seen.nominal, &seen.truth));
    for (a, b) in declared.observations.iter().zip(&seen.observations) {
        assert_eq!((&a.joint_rad, a.cavity(), a.seen_m()), (&b.joint_rad, b.cavity(), b.seen_m()));
        assert!((a.covariance_m2 - 100.0 * b.covariance_m2).norm() < 1e-12 * a.covariance_m2.norm());
        assert!(a.joint_sigma_rad.iter().zip(&b.joint_sigma_rad).all(|(a, b)| (a / b - 10.0).abs() < 1e-12));
        if let (
            Reference::Tracked { orientation: turned, orientation_sigma_rad: wide, .. },
            Reference::Tracked { orientation, orientation_sigma_rad: sigma, .. },
        ) = (&a.reference, &b.reference)
        {
            assert!(turned == orientation && (wide / sigma - 10.0).abs() < 1e-12);
        }
    }
}

#[test]
fn tracked_means_scatter_as_they_say() {
    let mut config = lab("");
    config.task.passes.clear();
    config.task.free.poses = 150;
    config.task.free.hold_s = [1.4, 1.4];
    for (correlation_s, least, most) in [(0.05, 0.9, 1.1), (15.0, 3.0, 20.0)] {
        config.vicon.correlation_s = correlation_s;
        let seen = observe_from(&config, Path::new(LABS)).unwrap();
        let mut ratio = Vec::new();
        for (o, dwell) in seen.observations.iter().zip(&seen.truth.recordings[0].dwells) {
            let Reference::Tracked { position_m, .. } = &o.reference else { panic!("not tracked") };
            let error = position_m - nalgebra::Vector3::from(dwell.tip_world_m);
            ratio.push(error.norm_squared() / o.covariance_m2.trace());
        }
        let rms = (ratio.iter().sum::<f64>() / ratio.len() as f64).sqrt();
        println!(
            "correlated over {correlation_s} s: scatter {rms:.2} of what is said, {} dwells",
            ratio.len()
        );
        assert!((least..most).contains(&rms), "{rms}");
    }
}

#[test]
fn a_session_takes_milliseconds() {
    let mut config = lab("");
    config.board.file = crate::board::BUILTIN.into();
    config.task.passes =
        [Order::Forward, Order::Backward].map(|order| PassConfig { order, share: 1.0 }).to_vec();
    config.mechanisms =
        vec![toml::from_str::<MechanismConfig>("kind = 'gap'\njoint = 1\nwidth_deg = 0.6").unwrap()];
    let start = std::time::Instant::now();
    let seen = observe(&config).unwrap();
    let took = start.elapsed();
    println!("{} dwells in {took:?}", seen.observations.len());
    assert!(seen.observations.iter().any(|o| o.arrival[0] == Arrival::Negative));
    assert!(took.as_secs_f64() < 1.0);
}
