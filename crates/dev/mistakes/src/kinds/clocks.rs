//! Stamps: of another clock, in another unit, late, repeated, out of order.

use super::{ALL, Kind, SEEN, whole};
use crate::rigs::{Body, JOINTS};
use crate::{Draw, Session};

pub const KINDS: &[Kind] = &[
    whole("joint-clock-set-forward", "clock-set", ALL, |s, d| joint_clock_set(s, d, 1.0)),
    whole("joint-clock-set-back", "clock-set", ALL, |s, d| joint_clock_set(s, d, -1.0)),
    whole("sensor-clock-set", "clock-set", SEEN, sensor_clock_set),
    whole("sensor-clock-an-hour-off", "clock-offset", SEEN, |s, d| sensor_offset(s, d.sign() * 3600.0)),
    whole("sensor-clock-seconds-off", "clock-offset", SEEN, |s, d| {
        let offset_s = d.signed(2.5, 8.0);
        sensor_offset(s, offset_s)
    }),
    whole("sensor-clock-drifts", "clock-drift", SEEN, drift_clock),
    whole("sensor-late", "latency", SEEN, |s, d| {
        let offset_s = d.uniform(0.3, 1.2);
        sensor_offset(s, offset_s)
    }),
    whole("sensor-latency-wanders", "latency", SEEN, vary_latency),
    whole("joint-stamps-in-microseconds", "wrong-time-unit", ALL, stamp_microseconds),
    whole("joint-stamps-ten-times-as-fast", "wrong-time-unit", ALL, scale_stamps),
    whole("joint-stamps-zero", "stamps-missing", ALL, |s, _| change_stamps(s, |_| 0)),
    whole("joint-stamps-all-equal", "stamps-missing", ALL, |s, _| {
        change_stamps(s, |_| 1_760_000_000_000_000_000)
    }),
    whole("joint-stamps-in-whole-seconds", "stamps-missing", ALL, |s, _| {
        change_stamps(s, |ns| ns / 1_000_000_000 * 1_000_000_000)
    }),
];

fn change_stamps(session: &mut Session, stamp: fn(i64) -> i64) {
    session.messages(JOINTS, |_, m| m.stamp_ns = stamp(m.stamp_ns));
}

fn joint_clock_set(session: &mut Session, draw: &mut Draw, sense: f64) {
    let moment_ns = session.moment_ns(1, draw.uniform(0.35, 0.65));
    let step_ns = (sense * draw.uniform(1.0, 4.0) * 1e9) as i64;
    session.messages(JOINTS, |at, m| {
        if at.stamp_ns > moment_ns {
            m.stamp_ns += step_ns;
        }
    });
}

const SENSED: [Body; 4] = [Body::Tip, Body::Base, Body::Table, Body::Still];

/// Every topic of the sensor once, whatever bodies share it.
fn change_sensor_stamps(session: &mut Session, mut change: impl FnMut(&crate::session::At, &mut i64)) {
    let mut topics: Vec<&str> = SENSED.map(|body| session.topic(body)).to_vec();
    topics.sort_unstable();
    topics.dedup();
    for topic in topics {
        session.messages(topic, |at, m| change(at, &mut m.stamp_ns));
    }
}

fn sensor_clock_set(session: &mut Session, draw: &mut Draw) {
    let moment_ns = session.moment_ns(1, draw.uniform(0.35, 0.65));
    let step_ns = (draw.signed(0.5, 1.5) * 1e9) as i64;
    change_sensor_stamps(session, |at, stamp_ns| {
        *stamp_ns += if at.stamp_ns > moment_ns { step_ns } else { 0 }
    });
}

fn sensor_offset(session: &mut Session, offset_s: f64) {
    change_sensor_stamps(session, |_, stamp_ns| *stamp_ns += (offset_s * 1e9) as i64);
}

fn drift_clock(session: &mut Session, draw: &mut Draw) {
    let drift = draw.signed(3e-3, 2e-2);
    let starts: Vec<i64> = (0..session.recordings.len()).map(|r| session.moment_ns(r, 0.0)).collect();
    change_sensor_stamps(session, |at, stamp_ns| {
        *stamp_ns += ((*stamp_ns - starts[at.recording]) as f64 * drift) as i64
    });
}

/// A network that is now quick, now slow, and stamps on arrival.
fn vary_latency(session: &mut Session, draw: &mut Draw) {
    let (period_s, size_s) = (draw.uniform(15.0, 40.0), draw.uniform(0.2, 0.5));
    change_sensor_stamps(session, |_, stamp_ns| {
        let phase = *stamp_ns as f64 * 1e-9 % period_s / period_s * std::f64::consts::TAU;
        *stamp_ns += (size_s * (1.0 + phase.sin()) * 1e9) as i64;
    });
}

/// Microseconds in the field of the nanoseconds.
fn stamp_microseconds(session: &mut Session, _: &mut Draw) {
    change_stamps(session, |ns| ns / 1_000_000_000 * 1_000_000_000 + ns % 1_000_000_000 / 1000);
}

/// A driver that counts ticks of 10 ms and calls them milliseconds, or the other way round.
fn scale_stamps(session: &mut Session, draw: &mut Draw) {
    let factor = [0.1, 10.0][draw.pick(2)];
    let starts: Vec<i64> = (0..session.recordings.len()).map(|r| session.moment_ns(r, 0.0)).collect();
    session.messages(JOINTS, |at, m| {
        let start_ns = starts[at.recording];
        m.stamp_ns = start_ns + ((m.stamp_ns - start_ns) as f64 * factor) as i64;
    });
}
