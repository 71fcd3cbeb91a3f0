//! Writes a log the way a ROS 2 lab records it: `ros2` profile, CDR, zstd chunks.

use crate::LabError;
use crate::sensors::{Channel, Kind, Log, Message, Payload};
use armcal_recording::RecordingError;
use armcal_recording::output::McapOutput;
use armcal_recording::ros2::{self, Header, Schema};
use std::collections::BTreeMap;
use std::path::Path;

/// Writes one recording. The file appears complete or not at all.
pub fn write(path: &Path, rig: &str, recording: &str, log: &Log) -> Result<(), LabError> {
    write_mcap(path, rig, recording, log)
        .map_err(|source| LabError::Recording { path: path.to_owned(), source: Box::new(source) })
}

fn write_mcap(path: &Path, rig: &str, recording: &str, log: &Log) -> Result<(), RecordingError> {
    let mut output = McapOutput::create(path, "ros2")?;
    let nothing = BTreeMap::new();
    let ids = log
        .channels
        .iter()
        .map(|channel| {
            let schema = schema(channel.kind);
            let schema = (schema.name, ros2::SCHEMA_ENCODING, schema.text.as_bytes());
            output.add_channel(&channel.topic, Some(schema), ros2::MESSAGE_ENCODING, &nothing)
        })
        .collect::<Result<Vec<u16>, RecordingError>>()?;
    for message in &log.messages {
        let data = encode(&log.channels[message.channel], message);
        // A publisher's own clock gives the publish time, the recorder's the log time.
        let [log_ns, publish_ns] = [message.log_ns, message.stamp_ns].map(|ns| ns.max(0) as u64);
        output.put(ids[message.channel], message.sequence, log_ns, publish_ns, &data)?;
    }
    let made = [("generator", "armcal simulate"), ("rig", rig), ("recording", recording)];
    output.metadata("armcal.lab", &made.map(|(k, v)| (k.to_owned(), v.to_owned())).into_iter().collect())?;
    output.finish()
}

fn schema(kind: Kind) -> &'static Schema {
    match kind {
        Kind::JointState => &ros2::JOINT_STATE,
        Kind::PoseStamped => &ros2::POSE_STAMPED,
        Kind::TransformStamped => &ros2::TRANSFORM_STAMPED,
        Kind::Temperature => &ros2::TEMPERATURE,
        Kind::Float64 => &ros2::FLOAT64,
    }
}

fn encode(channel: &Channel, message: &Message) -> Vec<u8> {
    let header = Header { stamp_ns: message.stamp_ns, frame_id: &channel.frame_id };
    match &message.payload {
        Payload::Joints { position, velocity } => {
            ros2::joint_state(header, &channel.names, position, velocity, &[])
        }
        Payload::Pose { position_m, orientation } => {
            let (position, q) = ((*position_m).into(), orientation.coords);
            let quaternion_xyzw = [q.x, q.y, q.z, q.w];
            match channel.kind {
                Kind::TransformStamped => {
                    let body = channel.names.first().map_or("", String::as_str);
                    ros2::transform_stamped(header, body, position, quaternion_xyzw)
                }
                _ => ros2::pose_stamped(header, position, quaternion_xyzw),
            }
        }
        Payload::Temperature { celsius, variance } => ros2::temperature(header, *celsius, *variance),
        Payload::Number(value) => ros2::float64(*value),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensors::SensorClock;
    use nalgebra::{Quaternion, Vector3};

    fn channel(topic: &str, kind: Kind, name: &str) -> Channel {
        Channel { topic: topic.into(), kind, frame_id: "world".into(), names: vec![name.into()] }
    }

    #[test]
    fn a_log_comes_back_message_by_message() {
        let pose = Payload::Pose {
            position_m: Vector3::new(1.0, 2.0, 3.0),
            orientation: Quaternion::new(0.5, -0.5, 0.5, -0.5),
        };
        let payloads = [
            Payload::Joints { position: vec![0.25], velocity: vec![-1.0] },
            pose.clone(),
            pose,
            Payload::Temperature { celsius: 21.5, variance: 0.01 },
        ];
        let clock = SensorClock { offset_s: 0.0, latency_s: 0.0, drift: 0.0, reference_ns: 0 };
        let message = |(channel, payload)| {
            let stamp_ns = 1_760_000_000_000_000_000 + channel as i64;
            Message { channel, sequence: 7, stamp_ns, log_ns: stamp_ns + 5_000_000, payload }
        };
        let log = Log {
            channels: vec![
                channel("/joint_states", Kind::JointState, "joint1"),
                channel("/vicon/tip/tip", Kind::PoseStamped, "tip/tip"),
                channel("/vicon/base/base", Kind::TransformStamped, "base/base"),
                channel("/temperature", Kind::Temperature, ""),
            ],
            messages: payloads.into_iter().enumerate().map(message).collect(),
            clock,
            occlusions: Vec::new(),
        };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("one.mcap");
        write(&path, "rig", "one", &log).unwrap();

        let bytes = std::fs::read(&path).unwrap();
        let read: Vec<_> = mcap::MessageStream::new(&bytes).unwrap().map(|m| m.unwrap()).collect();
        assert_eq!(read.len(), 4);
        for (i, (read, wrote)) in read.iter().zip(&log.messages).enumerate() {
            assert_eq!(read.channel.topic, log.channels[i].topic);
            assert_eq!(read.channel.message_encoding, "cdr");
            assert_eq!((read.log_time as i64, read.publish_time as i64), (wrote.log_ns, wrote.stamp_ns));
            let schema = read.channel.schema.as_ref().unwrap();
            assert_eq!(
                (schema.name.as_str(), schema.encoding.as_str()),
                (self::schema(log.channels[i].kind).name, "ros2msg")
            );
        }
        // Quaternions go out as x, y, z, w: the last eight bytes are w.
        for pose in &read[1..3] {
            assert_eq!(pose.data[pose.data.len() - 8..], 0.5f64.to_le_bytes());
        }
        let contained = |text: &str| read[2].data.windows(text.len()).any(|w| w == text.as_bytes());
        assert!(contained("world") && contained("base/base"));
    }
}
