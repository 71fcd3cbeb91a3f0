//! Recordings that are incomplete, damaged, doubled, or of something else.

use super::{ALL, Kind, SEEN, whole};
use crate::Draw;
use crate::rigs::{Body, JOINTS};
use crate::session::{Damage, Session};
use armcal_lab::sensors::Message;
use nalgebra::{Quaternion, Vector3};
use toml::Value;

pub const KINDS: &[Kind] = &[
    whole("same-file-twice", "recording-twice", ALL, same_file),
    whole("same-recording-under-another-name", "recording-twice", ALL, other_name),
    whole("same-recording-encoded-again", "recording-twice", ALL, encoded_again),
    whole("recording-and-its-part", "recording-twice", ALL, part_of_it),
    whole("file-cut", "truncated-file", ALL, |s, d| {
        let share = d.uniform(0.3, 0.8);
        damage_file(s, Damage::Cut(share))
    }),
    whole("file-zeroed-in-the-middle", "damaged-file", ALL, |s, d| {
        let from = d.uniform(0.3, 0.5);
        damage_file(s, Damage::Zeros(from, from + 0.1))
    }),
    whole("file-empty", "truncated-file", ALL, |s, _| damage_file(s, Damage::Emptied)),
    whole("file-missing", "missing-file", ALL, missing_file),
    whole("topic-misspelt", "missing-topic", ALL, |s, _| set_topic(s, "joints", "/joint_state")),
    whole("tip-topic-misspelt", "missing-topic", SEEN, |s, _| set_topic(s, "tip", "/vicon/Tip/Tip")),
    whole("joint-name-misspelt", "missing-joint", ALL, joint_name),
    whole("half-of-the-messages-lost", "dropped-messages", ALL, |s, d| lose_messages(s, d, 0.5)),
    whole("most-messages-lost", "dropped-messages", ALL, |s, d| lose_messages(s, d, 0.96)),
    whole("joint-stream-with-gaps", "dropped-messages", ALL, cut_gaps),
    whole("messages-doubled", "duplicated-messages", ALL, double_messages),
    whole("messages-shuffled", "shuffled-order", ALL, shuffle_messages),
    whole("joints-at-two-hertz", "low-rate", ALL, |s, _| thin_messages(s, JOINTS, 500_000_000)),
    whole("sensor-at-one-hertz", "low-rate", SEEN, |s, _| {
        let topic = s.topic(Body::Tip);
        thin_messages(s, topic, 1_000_000_000)
    }),
    whole("recording-stopped-early", "too-few-dwells", ALL, stopped_early),
    whole("arm-never-at-rest", "no-dwells", ALL, never_at_rest),
    whole("sensor-frozen-from-the-middle", "stuck-sensor", SEEN, sensor_frozen),
    whole("sensor-repeats-the-last-when-blind", "stuck-sensor", SEEN, repeat_when_blind),
    whole("sensor-zeros-when-blind", "stuck-sensor", SEEN, zero_when_blind),
    whole("sensor-outliers", "outliers", SEEN, sensor_outliers),
    whole("markers-swapped-for-a-while", "marker-swapped", SEEN, markers_swapped),
    whole("sensor-filtered", "latency", SEEN, sensor_filtered),
];

fn damage_file(session: &mut Session, damage: Damage) {
    session.damage.push((1, damage));
}

fn add_entry(session: &mut Session, file: &str, name: &str) {
    if let Some(Value::Table(mut entry)) = session.entries().first().cloned() {
        entry.insert("paths".into(), vec![Value::String(format!("{file}.mcap"))].into());
        entry.insert("name".into(), name.into());
        session.entries().push(entry.into());
    }
}

fn same_file(session: &mut Session, _: &mut Draw) {
    let file = session.recordings[0].name.clone();
    add_entry(session, &file, "again");
}

fn copy_recording(session: &mut Session, change: impl FnOnce(&mut Vec<Message>)) {
    let mut twin = session.recordings[0].clone();
    "copy".clone_into(&mut twin.name);
    change(&mut twin.log.messages);
    session.recordings.push(twin);
    add_entry(session, "copy", "copy");
}

fn other_name(session: &mut Session, _: &mut Draw) {
    copy_recording(session, |_| ());
}

/// Played back and recorded again: log times a day later, stamps as they were.
fn encoded_again(session: &mut Session, _: &mut Draw) {
    copy_recording(session, |messages| messages.iter_mut().for_each(|m| m.log_ns += 86_400_000_000_000));
}

fn part_of_it(session: &mut Session, _: &mut Draw) {
    copy_recording(session, |messages| messages.truncate(messages.len() * 2 / 3));
}

fn missing_file(session: &mut Session, _: &mut Draw) {
    session.recordings.remove(1);
}

fn set_topic(session: &mut Session, stream: &str, topic: &str) {
    session.set(&["streams", stream, "topic"], topic);
}

fn joint_name(session: &mut Session, _: &mut Draw) {
    let mut names = session.joint_names();
    names[1].insert(1, 'x');
    session.set(&["streams", "joints", "names"], names.into_iter().map(Value::String).collect::<Vec<_>>());
}

/// Which messages of a topic, or of all topics, are kept; `kept` is told the recording.
fn keep_messages(session: &mut Session, topic: Option<&str>, mut kept: impl FnMut(usize, &Message) -> bool) {
    for (i, recorded) in session.recordings.iter_mut().enumerate() {
        let channels = &recorded.log.channels;
        let other = |m: &Message| topic.is_some_and(|topic| channels[m.channel].topic != topic);
        recorded.log.messages.retain(|m| other(m) || kept(i, m));
    }
}

fn lose_messages(session: &mut Session, draw: &mut Draw, share: f64) {
    keep_messages(session, None, |_, _| !draw.chance(share));
}

fn cut_gaps(session: &mut Session, draw: &mut Draw) {
    let (period_s, gap_s) = (draw.uniform(25.0, 40.0), draw.uniform(6.0, 12.0));
    keep_messages(session, Some(JOINTS), |_, m| (m.stamp_ns as f64 * 1e-9) % period_s > gap_s);
}

fn double_messages(session: &mut Session, _: &mut Draw) {
    for recorded in &mut session.recordings {
        recorded.log.messages = recorded.log.messages.iter().flat_map(|m| [m.clone(), m.clone()]).collect();
    }
}

/// Written in any order by a recorder with many threads, log times in the order of writing.
fn shuffle_messages(session: &mut Session, draw: &mut Draw) {
    for recorded in &mut session.recordings {
        let messages = &mut recorded.log.messages;
        let log: Vec<i64> = messages.iter().map(|m| m.log_ns).collect();
        messages.chunks_mut(200).for_each(|chunk| draw.shuffle(chunk));
        messages.iter_mut().zip(log).for_each(|(m, log_ns)| m.log_ns = log_ns);
    }
}

fn thin_messages(session: &mut Session, topic: &str, period_ns: i64) {
    let mut last = vec![None; session.recordings.len()];
    keep_messages(session, Some(topic), |i, m| {
        let slice = Some(m.stamp_ns / period_ns);
        std::mem::replace(&mut last[i], slice) != slice
    });
}

fn stopped_early(session: &mut Session, _: &mut Draw) {
    let until_ns = session.recordings[0].rests.get(4).map_or(0, |r| r.end_ns);
    keep_messages(session, None, |i, m| i > 0 || m.stamp_ns <= until_ns);
    session.recordings.truncate(1);
    session.entries().truncate(1);
}

/// A program that sways the arm all the time.
fn never_at_rest(session: &mut Session, _: &mut Draw) {
    session.joints(|at, q| {
        let phase = at.stamp_ns as f64 * 1e-9 % 0.8 / 0.8 * std::f64::consts::TAU;
        q.iter_mut().for_each(|q| *q += 0.03 * phase.sin());
    });
}

fn sensor_frozen(session: &mut Session, draw: &mut Draw) {
    let from = draw.uniform(0.35, 0.6);
    let mut held: Vec<Option<(Vector3<f64>, Quaternion<f64>)>> = vec![None; session.recordings.len()];
    session.poses(Body::Tip, |at, p, q| {
        if at.share > from {
            (*p, *q) = *held[at.recording].get_or_insert((*p, *q));
        }
    });
}

/// Blind in every fifth stretch of some seconds, as marked by `blind`.
fn is_blind(stamp_ns: i64) -> bool {
    (stamp_ns / 3_000_000_000) % 4 == 0
}

fn repeat_when_blind(session: &mut Session, _: &mut Draw) {
    let mut held: Vec<Option<(Vector3<f64>, Quaternion<f64>)>> = vec![None; session.recordings.len()];
    session.poses(Body::Tip, |at, p, q| match is_blind(at.stamp_ns) {
        true => (*p, *q) = *held[at.recording].get_or_insert((*p, *q)),
        false => held[at.recording] = Some((*p, *q)),
    });
}

/// The position is zero, the orientation the identity: not marked as unseen.
fn zero_when_blind(session: &mut Session, _: &mut Draw) {
    session.poses(Body::Tip, |at, p, q| {
        if is_blind(at.stamp_ns) {
            (*p, *q) = (Vector3::zeros(), Quaternion::identity());
        }
    });
}

fn sensor_outliers(session: &mut Session, draw: &mut Draw) {
    let share = draw.uniform(0.05, 0.12);
    session.poses(Body::Tip, |_, p, _| {
        if draw.chance(share) {
            *p += draw.direction() * draw.uniform(0.02, 0.3);
        }
    });
}

fn markers_swapped(session: &mut Session, draw: &mut Draw) {
    let offset = draw.direction() * draw.uniform(0.008, 0.03);
    let (from, to) = (draw.uniform(0.2, 0.4), draw.uniform(0.55, 0.75));
    session.poses(Body::Tip, |at, p, _| {
        if at.recording == 1 && at.share > from && at.share < to {
            *p += offset;
        }
    });
}

/// A tracker that smooths over a second.
fn sensor_filtered(session: &mut Session, draw: &mut Draw) {
    let time_s = draw.uniform(0.4, 0.9);
    let mut state: Vec<Option<(i64, Vector3<f64>)>> = vec![None; session.recordings.len()];
    session.poses(Body::Tip, |at, p, _| {
        let slot = &mut state[at.recording];
        if let Some((then_ns, value)) = slot {
            let gain = 1.0 - (-((at.stamp_ns - *then_ns) as f64 * 1e-9) / time_s).exp();
            *p = *value + gain * (*p - *value);
        }
        *slot = Some((at.stamp_ns, *p));
    });
}
