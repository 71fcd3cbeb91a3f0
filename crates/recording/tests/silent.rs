//! No loss is silent: recordings are mutated, and what is read of them is compared with what was written. Where a message is
//! missing, changed or invented and nothing says so, the test fails.
//!
//! A file has only so many witnesses: bytes that no CRC covers can change unseen. The recordings here are as their writers
//! make them by default (MCAP with CRCs), or without CRCs, where only the number and times of messages are compared.

#![allow(clippy::print_stdout, reason = "a test says what it counted")]

use armcal_core::Severity;
use armcal_recording::Recording;
use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions};
use rusqlite::Connection;
use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;

/// Mutations of each recording in a normal run; all together the ignored test makes 10 000.
const FEW: u64 = 150;
const MANY: u64 = 10_000;

/// How a recording is written.
#[derive(Clone, Copy, Debug)]
struct Style {
    chunk_bytes: Option<u64>,
    compression: Option<Compression>,
    crcs: bool,
}

const STYLES: [Style; 6] = [
    Style { chunk_bytes: Some(2000), compression: Some(Compression::Zstd), crcs: true },
    Style { chunk_bytes: Some(2000), compression: Some(Compression::Lz4), crcs: true },
    Style { chunk_bytes: Some(200_000), compression: None, crcs: true },
    Style { chunk_bytes: None, compression: None, crcs: true },
    // As rosbag2 writes with `zstd_fast`: no CRC at all.
    Style { chunk_bytes: Some(2000), compression: Some(Compression::Zstd), crcs: false },
    Style { chunk_bytes: Some(2000), compression: None, crcs: false },
];
const CHANNELS: [&str; 2] = ["/joint_states", "/vicon/tip"];
const MESSAGES: u64 = 240;
const START_NS: u64 = 1_700_000_000_000_000_000;

/// The generator of xorshift64* (Vigna 2016): the same mutations every time.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }
}

fn payload(i: u64) -> Vec<u8> {
    (0..6).flat_map(|k| (i * 6 + k).wrapping_mul(0x9e37_79b9_7f4a_7c15).to_le_bytes()).collect()
}

fn mcap_file(style: Style) -> Vec<u8> {
    let options = WriteOptions::new()
        .compression(style.compression)
        .compression_threads(0)
        .use_chunks(style.chunk_bytes.is_some())
        .chunk_size(style.chunk_bytes)
        .calculate_chunk_crcs(style.crcs)
        .calculate_data_section_crc(style.crcs)
        .calculate_summary_section_crc(style.crcs)
        .calculate_attachment_crcs(style.crcs);
    let mut writer = options.create(Cursor::new(Vec::new())).expect("a writer");
    let schema = writer.add_schema("test/Opaque", "ros2msg", b"byte[48] x").expect("a schema");
    let ids = CHANNELS.map(|c| writer.add_channel(schema, c, "cdr", &BTreeMap::new()).expect("a channel"));
    for i in 0..MESSAGES {
        let time = START_NS + i * 10_000_000;
        let channel_id = ids[usize::from(i % 3 == 0)];
        let header = MessageHeader { channel_id, sequence: i as u32, log_time: time, publish_time: time };
        writer.write_to_known_channel(&header, &payload(i)).expect("written");
    }
    writer.finish().expect("finished");
    writer.into_inner().into_inner()
}

/// A bag as rosbag2 leaves it, and its description where it is to have one.
fn bag(folder: &Path, described: bool) -> Vec<u8> {
    let path = folder.join("bag.db3");
    let mut database = Connection::open(&path).expect("a database");
    database
        .execute_batch(
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, \
             serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL); \
             CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, \
             data BLOB NOT NULL); \
             CREATE INDEX timestamp_idx ON messages (timestamp ASC); \
             INSERT INTO topics VALUES(1, '/joint_states', 'sensor_msgs/msg/JointState', 'cdr', ''); \
             INSERT INTO topics VALUES(2, '/vicon/tip', 'geometry_msgs/msg/PoseStamped', 'cdr', '');",
        )
        .expect("tables");
    let all = database.transaction().expect("a transaction");
    let (mut counts, row) = ([0_u64; 2], "INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)");
    for i in 0..MESSAGES {
        let topic = usize::from(i % 3 == 0);
        counts[topic] += 1;
        let time = (START_NS + i * 10_000_000).cast_signed();
        all.execute(row, (topic as i64 + 1, time, payload(i))).expect("inserted");
    }
    all.commit().expect("written");
    drop(database);
    if described {
        let topic = |i: usize| {
            let (name, count) = (CHANNELS[i], counts[i]);
            format!(
                "    - topic_metadata:\n        name: {name}\n        type: x\n      message_count: {count}\n"
            )
        };
        let text = format!(
            "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: sqlite3\n  relative_file_paths:\n    - bag.db3\n  \
             message_count: {MESSAGES}\n  topics_with_message_count:\n{}{}  files:\n    - path: bag.db3\n      \
             message_count: {MESSAGES}\n",
            topic(0),
            topic(1)
        );
        std::fs::write(folder.join("metadata.yaml"), text).expect("written");
    }
    std::fs::read(path).expect("readable")
}

/// Where records of an MCAP file start.
fn records(bytes: &[u8]) -> Vec<usize> {
    let (mut starts, mut at) = (Vec::new(), 8);
    while let Some(length) = bytes.get(at + 1..at + 9) {
        starts.push(at);
        at += 9 + u64::from_le_bytes(length.try_into().expect("8 bytes")) as usize;
    }
    starts.retain(|start| start + 17 <= bytes.len());
    starts
}

/// Changes bytes in one of the ways in which files break, or are broken on purpose.
fn mutate(bytes: &[u8], random: &mut Random, parts: &[usize]) -> Vec<u8> {
    let mut changed = bytes.to_vec();
    let part = random.below(parts.len());
    let (start, end) = (parts[part], parts.get(part + 1).copied().unwrap_or(bytes.len()));
    match random.below(8) {
        0 => changed[random.below(bytes.len())] ^= 1 << random.below(8),
        // The head of a record or page.
        1 => changed[start] = random.next() as u8,
        2 => changed[start] ^= 1 << random.below(8),
        3 => changed[start + 1 + random.below(8)] ^= 1 << random.below(8),
        4 => _ = changed.drain(start..end),
        5 => {
            let other = random.below(parts.len());
            let (a, b) = (part.min(other), part.max(other));
            let end = |i: usize| parts.get(i + 1).copied().unwrap_or(bytes.len());
            if a != b {
                let swapped = [
                    &bytes[..parts[a]],
                    &bytes[parts[b]..end(b)],
                    &bytes[end(a)..parts[b]],
                    &bytes[parts[a]..end(a)],
                    &bytes[end(b)..],
                ];
                changed = swapped.concat();
            }
        }
        6 => {
            let length = 1 + random.below(300);
            let at = random.below(bytes.len());
            let end = (at + length).min(bytes.len());
            changed[at..end].fill(random.next() as u8 & if random.below(2) == 0 { 0 } else { 0xff });
        }
        _ => changed.truncate(random.below(bytes.len())),
    }
    changed
}

/// Topic, time and, where a CRC vouches for it, data of every message, sorted.
type Messages = Vec<(String, u64, Vec<u8>)>;

/// What is read, and whether anything is said to be lost; an error says so too.
fn read(path: &Path, data: bool) -> (Messages, bool) {
    let mut all = Messages::new();
    let Ok(recording) = Recording::open(&[path.to_owned()]) else { return (all, true) };
    let pass = recording.for_each_raw(&mut |m| {
        all.push((m.channel.topic.clone(), m.log_ns, if data { m.data.to_vec() } else { Vec::new() }));
        Ok(())
    });
    let lost = recording.report().warnings.iter().any(|w| w.severity == Severity::DataLost);
    all.sort();
    (all, lost || pass.is_err())
}

/// Mutations, those with a loss, and what was lost in silence.
#[derive(Default, Debug)]
struct Count {
    mutations: u64,
    losses: u64,
    told: u64,
    silent: Vec<String>,
}

fn hold(count: &mut Count, what: &str, path: &Path, sound: &[u8], parts: &[usize], data: bool, times: u64) {
    std::fs::write(path, sound).expect("written");
    let (expected, lost) = read(path, data);
    assert_eq!((expected.len() as u64, lost), (MESSAGES, false), "{what} as it was written");
    for seed in 1..=times {
        let mut random = Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let bytes = mutate(sound, &mut random, parts);
        std::fs::write(path, &bytes).expect("written");
        let (found, told) = read(path, data);
        count.mutations += 1;
        count.losses += u64::from(found != expected);
        count.told += u64::from(told);
        if found != expected && !told {
            count.silent.push(format!("{what}, seed {seed}: {} messages", found.len()));
        }
    }
}

fn sweep(times: u64) -> Count {
    let mut count = Count::default();
    let folder = tempfile::tempdir().expect("a folder");
    for style in STYLES {
        let bytes = mcap_file(style);
        let path = folder.path().join("recording.mcap");
        hold(&mut count, &format!("{style:?}"), &path, &bytes, &records(&bytes), style.crcs, times);
    }
    for described in [true, false] {
        let folder = tempfile::tempdir().expect("a folder");
        let bytes = bag(folder.path(), described);
        let pages: Vec<usize> = (0..bytes.len()).step_by(4096).collect();
        let what = format!("a bag, described: {described}");
        hold(&mut count, &what, &folder.path().join("bag.db3"), &bytes, &pages, false, times);
    }
    count
}

#[test]
fn no_loss_is_silent() {
    let count = sweep(FEW);
    println!("{} mutations, {} with losses, {} told", count.mutations, count.losses, count.told);
    assert!(count.losses > count.mutations / 2, "the mutations do harm: {count:?}");
    assert!(count.silent.is_empty(), "{:#?}", count.silent);
}

#[test]
#[ignore = "10 000 mutations take a minute; `cargo test -p armcal-recording --test silent -- --ignored --nocapture`"]
fn no_loss_of_ten_thousand_mutations_is_silent() {
    let count = sweep(MANY / (STYLES.len() as u64 + 2));
    println!("{} mutations, {} with losses, {} told", count.mutations, count.losses, count.told);
    assert!(count.silent.is_empty(), "{:#?}", count.silent);
}
