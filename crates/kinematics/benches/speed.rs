//! How many evaluations a second: `cargo bench -p armcal-kinematics`. Numbers of one core; docs/compensation.md quotes them.

#![allow(clippy::print_stdout, reason = "a bench prints its numbers")]

use armcal_kinematics::{CalibratedArm, Conditions, Driven, KinematicsError, Motion};
use std::hint::black_box;
use std::time::{Duration, Instant};

const MODELS: [(&str, &str); 3] = [
    ("paper's arm, 3 joints, play", include_str!("../../../fixtures/models/paper-play.json")),
    ("Panda, 7 joints, springs", include_str!("../../../fixtures/models/panda.json")),
    ("UR10, 6 joints, springs", include_str!("../../../fixtures/models/ur10.json")),
];
const AT_LEAST: Duration = Duration::from_millis(500);

type Work<'w> = &'w mut dyn FnMut(usize) -> Result<(), KinematicsError>;

/// Microseconds a call.
fn microseconds(work: Work<'_>) -> Result<f64, KinematicsError> {
    let start = Instant::now();
    let mut calls = 0;
    while start.elapsed() < AT_LEAST {
        work(calls)?;
        calls += 1;
    }
    Ok(start.elapsed().as_secs_f64() * 1e6 / calls as f64)
}

/// A path through what was recorded that is sampled like a controller's: joints turn back now and then.
fn readings(arm: &CalibratedArm, k: usize) -> Vec<f64> {
    let at = |(j, [low, high]): (usize, &[f64; 2])| {
        (low + high) / 2.0 + 0.3 * (high - low) * (0.002 * (1.0 + 0.3 * j as f64) * k as f64).sin()
    };
    arm.file.range_rad.iter().enumerate().map(at).collect()
}

fn main() -> Result<(), KinematicsError> {
    println!("{:28} {:>12} {:>12} {:>12} {:>12}", "[us]", "load", "tip", "correct", "and go");
    for (name, text) in MODELS {
        let arm = CalibratedArm::from_json(text)?;
        let fresh = || -> Result<Motion<'_>, KinematicsError> {
            let mut motion = arm.motion(&Conditions { in_base: true, ..Conditions::default() })?;
            motion.start(Some(&readings(&arm, 0)))?;
            Ok(motion)
        };
        let load = microseconds(&mut |_| CalibratedArm::from_json(black_box(text)).map(drop))?;
        let mut motion = fresh()?;
        let tip = microseconds(&mut |k| {
            black_box(motion.tip(&readings(&arm, k), &Driven::default())?);
            Ok(())
        })?;
        let correct = microseconds(&mut |k| {
            black_box(motion.correct(&readings(&arm, k), Some(k as f64 * 1e-3))?);
            Ok(())
        })?;
        let mut motion = fresh()?;
        let go = microseconds(&mut |k| {
            let q = readings(&arm, k);
            black_box(motion.tip(&q, &Driven::default())?);
            motion.go(&q)
        })?;
        println!("{name:28} {load:12.1} {tip:12.2} {correct:12.1} {go:12.2}");
    }
    Ok(())
}
