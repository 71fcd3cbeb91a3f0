//! The recordings of the synthetic run.

use crate::synthetic::{HOSTILE, time_ns};
use std::path::{Path, PathBuf};

/// An input as labs have them: two encodings, metadata on a channel, a channel without schema, an attachment.
pub fn input(folder: &Path, index: usize) -> PathBuf {
    let path = folder.join(format!("input{index}.mcap"));
    let file = std::io::BufWriter::new(std::fs::File::create(&path).unwrap());
    let options = mcap::WriteOptions::new().profile("ros2").compression(None).chunk_size(Some(400));
    let mut w = options.create(file).unwrap();
    let qos = [("offered_qos_profiles".to_owned(), "- history: 3".to_owned())].into();
    let schema = w.add_schema("sensor_msgs/msg/JointState", "ros2msg", b"float64[] position").unwrap();
    let joints = w.add_channel(schema, "/joint_states", "cdr", &qos).unwrap();
    let schema = w.add_schema("thing", "jsonschema", br#"{"type":"object"}"#).unwrap();
    let things = w.add_channel(schema, HOSTILE, "json", &Default::default()).unwrap();
    let bare = w.add_channel(0, "/no_schema", "raw", &Default::default()).unwrap();
    let schema = w.add_schema("armcal.Dwell", "protobuf", b"old").unwrap();
    let old = w.add_channel(schema, "/armcal/dwells", "protobuf", &Default::default()).unwrap();
    for i in 0..40_u32 {
        let log_time = (time_ns(index, 0) + i64::from(i) * 700_000_000) as u64;
        let header = |channel_id| mcap::records::MessageHeader {
            channel_id,
            sequence: i + 1000,
            log_time,
            publish_time: log_time - 123,
        };
        w.write_to_known_channel(&header(joints), &[0, 1, 0, 0, i as u8, index as u8]).unwrap();
        w.write_to_known_channel(&header(things), format!("{{\"i\":{i}}}").as_bytes()).unwrap();
        w.write_to_known_channel(&header(bare), &[]).unwrap();
        if i == 0 && index == 1 {
            w.write_to_known_channel(&header(old), b"from an earlier run").unwrap();
        }
    }
    for name in ["notes/\"a\".txt", "armcal/summary.json"] {
        w.attach(&mcap::Attachment {
            log_time: 5,
            create_time: 6,
            name: name.into(),
            media_type: "text/plain".into(),
            data: format!("attached to {index}").into_bytes().into(),
        })
        .unwrap();
    }
    let entries = [("operator".to_owned(), format!("ü{index}"))].into();
    w.write_metadata(&mcap::records::Metadata { name: "lab".into(), metadata: entries }).unwrap();
    w.finish().unwrap();
    path
}
