//! What is said where no joint readings are found.

use super::channels::Channels;
use crate::error::InitError;

/// So many paths are named.
const SHOWN: usize = 12;

/// Why there are none, for a robot with these joints, which move these links.
pub fn no_joints(channels: &Channels, joints: &[String], links: &[String]) -> InitError {
    let left = channels.left.iter().map(|(topic, why)| format!("{topic} ({why})"));
    let bodies = channels.bodies.iter().map(|b| format!("{} (a tracked body)", b.shown()));
    let warm = channels.temperatures.iter().map(|t| format!("{t} (a thermometer)"));
    let seen: Vec<String> = bodies.chain(warm).chain(left).collect();
    if seen.is_empty() {
        let problem =
            "nothing is recorded: there is no channel at all. `armcal inspect` shows what a file holds";
        return InitError::Init { problem: problem.to_owned() };
    }
    let moving = channels.unknown.iter().flat_map(|of| {
        of.fields.moving().into_iter().map(|path| format!("{}:{path}", of.topic)).collect::<Vec<_>>()
    });
    let moving: Vec<String> = moving.take(SHOWN).collect();
    let advice = match linked(channels, links) {
        Some(only) => only,
        None if moving.len() > 1 => {
            let called = match joints {
                [] => String::new(),
                joints => format!("no fields are called as the robot's joints ({})", joints.join(", ")),
            };
            let apart = if called.is_empty() { "" } else { ", and " };
            format!(
                "; {called}{apart}numbers that change are at {}: where they are the joints, `position` of [streams.joints] names \
                 them (docs/pipeline-reference.md)",
                moving.join(", ")
            )
        }
        // Whoever recorded them need not record them.
        None if channels.unread => String::new(),
        None => "; record the topic of the joints too (ros2 bag record /joint_states ..)".to_owned(),
    };
    let problem = format!("no topic has joint readings in every recording: {}{advice}", seen.join("; "));
    InitError::Init { problem }
}

/// Joints that are recorded as the transforms of their links alone.
fn linked(channels: &Channels, links: &[String]) -> Option<String> {
    let of_robot = |body: &Option<String>| body.as_ref().is_some_and(|body| links.contains(body));
    let bodies: Vec<_> = channels.bodies.iter().filter(|b| of_robot(&b.body)).collect();
    let topic = &bodies.first()?.topic;
    let names: Vec<&str> = bodies.iter().filter_map(|b| b.body.as_deref()).collect();
    (names.len() > 1).then(|| {
        format!(
            "; joint angles are only in {topic}: the transforms of the robot's own links ({}) were computed from them, and armcal reads \
             no angles from transforms; record the topic that they were computed from, which robot_state_publisher reads (/joint_states)",
            names.join(", ")
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::topics::BodyTopic;

    fn said(channels: &Channels) -> String {
        no_joints(channels, &["j1".to_owned()], &["l1".to_owned(), "l2".to_owned()]).to_string()
    }

    #[test]
    fn only_where_no_joints_are_recorded_is_recording_them_the_advice() {
        let body =
            |name: &str| BodyTopic { topic: "/tf".into(), body: Some(name.into()), ..BodyTopic::default() };
        let mut channels = Channels { bodies: vec![body("l1")], ..Channels::default() };
        assert!(said(&channels).contains("record the topic of the joints too"));
        channels.bodies.push(body("l2"));
        assert!(
            said(&channels).contains("joint angles are only in /tf") && !said(&channels).contains("too (")
        );
        let left = vec![("/j".to_owned(), "cannot be read".to_owned())];
        let unread = Channels { left, unread: true, ..Channels::default() };
        assert!(said(&unread).ends_with("/j (cannot be read)"), "{}", said(&unread));
        assert!(said(&Channels::default()).contains("nothing is recorded"));
    }
}
