//! What was wired, stamped or published wrongly: undone where it is read, said, and as good as if nothing had been wrong.

use crate::init::{changed, held_out_mm};
use armcal_lab::config::LabConfig;
use armcal_lab::sensors::{Log, Payload};
use std::f64::consts::TAU;

const SECOND: i64 = 1_000_000_000;

fn joints(log: &mut Log, change: impl Fn(&mut Vec<f64>)) {
    for message in &mut log.messages {
        if let Payload::Joints { position, .. } = &mut message.payload {
            change(position);
        }
    }
}

/// The stamps of what the sensor sends, given how long after the first message of the log each is [ns].
fn stamps(log: &mut Log, change: impl Fn(i64) -> i64) {
    let first = log.messages.iter().map(|m| m.log_ns).min().unwrap_or_default();
    for message in &mut log.messages {
        if let Payload::Pose { .. } = message.payload {
            message.stamp_ns = first + change(message.stamp_ns - first);
        }
    }
}

fn zeros_between(log: &mut Log) {
    let mut more = Vec::new();
    for (k, message) in log.messages.iter().enumerate().filter(|(k, _)| k % 7 == 0) {
        if let Payload::Joints { position, .. } = &message.payload {
            let mut zeros = message.clone();
            zeros.payload = Payload::Joints { position: vec![0.0; position.len()], velocity: Vec::new() };
            zeros.stamp_ns += 1_000_000 + k as i64 % 5;
            zeros.log_ns += 1_000_000 + k as i64 % 5;
            more.push(zeros);
        }
    }
    log.messages.extend(more);
    log.messages.sort_by_key(|m| m.log_ns);
}

/// Each is a session whose messages are wrong in one way, whatever the arm, the joint and the size.
#[test]
fn what_can_be_undone_is_undone_and_said() {
    let sign = |log: &mut Log| joints(log, |q| q[1] = -q[1]);
    let zero = |log: &mut Log| joints(log, |q| q[2] += 0.75 * TAU);
    let turns = |log: &mut Log| joints(log, |q| q.iter_mut().for_each(|q| *q /= TAU));
    let set = |log: &mut Log| stamps(log, |t| if t < 40 * SECOND { t } else { t - 1_300_000_000 });
    let epoch = |log: &mut Log| stamps(log, |t| t - 1_650_000_000 * SECOND);
    let rate = |log: &mut Log| stamps(log, |t| t * 6 / 5);
    type Change<'a> = (&'a dyn Fn(&mut Log), &'a str);
    let cases: [Change<'_>; 8] = [
        (&|_| (), "[streams.tip]"),
        (&sign, "factors = [1.0, -1.0, 1.0]"),
        (&zero, "zeros_deg = [0.0, 0.0, 90.0]"),
        (&turns, "factors = [6.283185, 6.283185, 6.283185]"),
        (&set, "header stamps step by -1.300 s"),
        (&epoch, "initial_offset_s = -165"),
        (&rate, "their clock runs 1.2000 times as fast"),
        (&zeros_between, "[streams.tip]"),
    ];
    let mut plain_mm = f64::NAN;
    for (change, says) in cases {
        let folder = tempfile::tempdir().expect("temporary folder");
        let text = changed(folder.path(), |_: &mut LabConfig| (), change);
        assert!(text.contains(says), "{says}: {text}");
        let mm = held_out_mm(folder.path(), "own", text);
        println!("{says}: {mm:.3} mm");
        plain_mm = if plain_mm.is_nan() { mm } else { plain_mm };
        // Log time is what a recorder had time for.
        assert!(mm < 1.2 * plain_mm, "{says}: {mm} of {plain_mm} mm");
    }
}
