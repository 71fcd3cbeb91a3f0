//! What the controller asked of the joints, taken for what the encoders read.

use crate::rigs::{JOINTS, Rest};
use crate::{Draw, Session};
use armcal_lab::sensors::{Kind, Message, Payload};

/// Set-points under the topic of the readings.
pub(super) fn replace_readings(session: &mut Session, draw: &mut Draw) {
    let commanded = asked_for(session, draw);
    let mut next = commanded.into_iter();
    session.joints(|_, q| *q = next.next().unwrap_or_else(|| q.clone()));
}

/// The controller's topic beside that of the readings, and named in the pipeline.
pub(super) fn add_command_topic(session: &mut Session, draw: &mut Draw) {
    let commanded = asked_for(session, draw);
    let mut next = commanded.into_iter();
    for recorded in &mut session.recordings {
        let log = &mut recorded.log;
        let joints = log.channels.iter().position(|c| c.topic == JOINTS);
        let names = joints.map(|j| log.channels[j].names.clone()).unwrap_or_default();
        let asked = log.channel("/controller/command", Kind::JointState, "", &names);
        let messages: Vec<Message> = std::mem::take(&mut log.messages);
        for message in messages {
            let twin =
                (Some(message.channel) == joints).then(|| next.next()).flatten().map(|position| Message {
                    channel: asked,
                    payload: Payload::Joints { position, velocity: Vec::new() },
                    ..message.clone()
                });
            log.messages.push(message);
            log.messages.extend(twin);
        }
    }
    session.set(&["streams", "joints", "topic"], "/controller/command");
}

/// What a controller without integral action would have asked for, message by message: it stays short of it by gravity's
/// droop and by friction, another amount in each rest; asked for without noise.
fn asked_for(session: &mut Session, draw: &mut Draw) -> Vec<Vec<f64>> {
    let joints = session.joint_names().len();
    let droop: Vec<f64> = (0..joints).map(|_| draw.signed(0.4, 1.2).to_radians()).collect();
    let rests: Vec<Vec<Rest>> = session.recordings.iter().map(|r| r.rests.clone()).collect();
    let mut means: Vec<Vec<(Vec<f64>, f64)>> =
        rests.iter().map(|r| vec![(vec![0.0; joints], 0.0); r.len() + 1]).collect();
    session.joints(|at, q| {
        let k = rests[at.recording].partition_point(|r| r.start_ns <= at.stamp_ns);
        if k > 0 && at.stamp_ns <= rests[at.recording][k - 1].end_ns {
            let (sum, n) = &mut means[at.recording][k];
            sum.iter_mut().zip(q.iter()).for_each(|(sum, q)| *sum += q);
            *n += 1.0;
        }
    });
    let error: Vec<Vec<Vec<f64>>> = means
        .iter()
        .map(|means| {
            let one = |(sum, n): &(Vec<f64>, f64)| {
                let friction: Vec<f64> = (0..joints).map(|_| 0.3_f64.to_radians() * draw.normal()).collect();
                (0..joints).map(|j| droop[j] * (sum[j] / n.max(1.0)).cos() + friction[j]).collect()
            };
            means.iter().map(one).collect()
        })
        .collect();
    let mut asked = Vec::new();
    session.joints(|at, q| {
        let rests = &rests[at.recording];
        let k = rests.partition_point(|r| r.start_ns <= at.stamp_ns);
        let error = &error[at.recording];
        let resting = k > 0 && at.stamp_ns <= rests[k - 1].end_ns;
        let next = error.get(k + 1).unwrap_or(&error[k]);
        let end_ns = if k > 0 { rests[k - 1].end_ns } else { at.stamp_ns };
        let until_ns = rests.get(k).map_or(at.stamp_ns + 1, |r| r.start_ns);
        let u = ((at.stamp_ns - end_ns) as f64 / (until_ns - end_ns).max(1) as f64).clamp(0.0, 1.0);
        asked.push(
            (0..joints)
                .map(|j| {
                    let (sum, n) = &means[at.recording][k];
                    match resting && *n > 0.0 {
                        true => sum[j] / n + error[k][j],
                        false => q[j] + (1.0 - u) * error[k][j] + u * next[j],
                    }
                })
                .collect(),
        );
    });
    asked
}
