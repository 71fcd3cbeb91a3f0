//! Recordings of very many channels: each is reported once, with its own messages, however the file is read.

use super::OnDisk;
use crate::Access;
use mcap::WriteOptions;
use mcap::records::MessageHeader;
use std::collections::{BTreeMap, BTreeSet};
use std::io::Cursor;

const CHANNELS: u16 = 3000;

/// Every channel has `id % 3` messages, each in a chunk of its own.
fn file() -> Vec<u8> {
    let options = WriteOptions::new().compression(None).chunk_size(Some(16));
    let mut writer = options.create(Cursor::new(Vec::new())).expect("a writer into memory");
    let schema = writer.add_schema("x/X", "ros2msg", b"bool x").expect("a schema");
    let mut log_time = 0;
    for number in 0..CHANNELS {
        let topic = format!("/t{number}");
        let id = writer.add_channel(schema, &topic, "cdr", &BTreeMap::new()).expect("a channel");
        for _ in 0..number % 3 {
            log_time += 1;
            let header = MessageHeader { channel_id: id, sequence: 0, log_time, publish_time: log_time };
            writer.write_to_known_channel(&header, &[0; 32]).expect("written to memory");
        }
    }
    writer.finish().expect("finished in memory");
    writer.into_inner().into_inner()
}

#[test]
fn each_of_many_channels_has_its_own_messages_mapped_and_by_ranges() {
    let disk = OnDisk::new(&[file(), file()]);
    for access in [Access::Mapped, Access::Ranges] {
        let recording = disk.open_with(access).expect("a recording");
        let channels = recording.channels();
        assert_eq!(channels.len(), usize::from(CHANNELS), "the same definitions in two files");
        let topics: BTreeSet<&str> = channels.iter().map(|c| c.topic.as_str()).collect();
        assert_eq!(topics.len(), channels.len());
        // Of one channel everything is read, so that of the others only some chunks are.
        recording.for_each_raw_of(&|c| c.topic == "/t2", &mut |_| Ok(())).expect("a pass");
        let report = recording.report();
        assert_eq!(report.channels.len(), usize::from(CHANNELS));
        for c in report.channels.iter() {
            let number: u64 = c.topic[2..].parse().expect("a number");
            assert_eq!(c.messages, 2 * (number % 3), "{} by {access:?}", c.topic);
        }
        assert_eq!(report.warnings, []);
    }
}
