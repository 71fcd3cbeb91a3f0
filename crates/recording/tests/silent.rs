//! No loss is silent: recordings are mutated, and what is read of them is compared with what was written. Where a message is
//! missing, changed or invented and nothing says so, the test fails.
//!
//! A file has only so many witnesses: bytes that no CRC covers can change unseen. The recordings here are as their writers
//! make them by default (MCAP with CRCs), or without CRCs, where only the number and times of messages are compared.

#![allow(clippy::print_stdout, reason = "a test says what it counted")]

use armcal_core::Severity;
use armcal_recording::{Access, Recording};
use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions};
use rusqlite::Connection;
use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::{Path, PathBuf};

/// Mutations of each recording in a normal run; all together the ignored test makes 10 000. Each is read from a map and by ranges.
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
fn read(path: &Path, access: Access, data: bool) -> (Messages, bool) {
    let mut all = Messages::new();
    let Ok(recording) = Recording::open_with(&[path.to_owned()], access) else { return (all, true) };
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

/// A recording that is mutated.
struct Case<'a> {
    what: String,
    path: &'a Path,
    sound: &'a [u8],
    /// Where its records or pages start.
    parts: Vec<usize>,
    /// Whether CRCs vouch for the data of messages.
    data: bool,
}

fn hold(count: &mut Count, case: &Case<'_>, times: u64) {
    let Case { what, path, sound, parts, data } = case;
    std::fs::write(path, sound).expect("written");
    let ways = ways(path);
    let (expected, _) = read(path, Access::Mapped, *data);
    for (path, access) in &ways {
        let found = read(path, *access, *data);
        assert_eq!(
            (found.0.len() as u64, found.1),
            (MESSAGES, false),
            "{what}, {access:?}, as it was written"
        );
    }
    for seed in 1..=times {
        let mut random = Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let bytes = mutate(sound, &mut random, parts);
        std::fs::write(path, &bytes).expect("written");
        for (path, access) in &ways {
            let (found, told) = read(path, *access, *data);
            count.mutations += 1;
            count.losses += u64::from(found != expected);
            count.told += u64::from(told);
            if found != expected && !told {
                count.silent.push(format!("{what}, {access:?}, seed {seed}: {} messages", found.len()));
            }
        }
    }
}

/// The folder that a store serves as its bucket, in the process that reads from one.
const SERVED: &str = "ARMCAL_TEST_SERVED";

/// How a recording is read: from a map and by ranges; or from the store alone.
fn ways(path: &Path) -> Vec<(PathBuf, Access)> {
    match std::env::var_os(SERVED) {
        Some(folder) => {
            let key = path.strip_prefix(folder).expect("it is served").display();
            vec![(format!("s3://lab/{key}").into(), Access::Ranges)]
        }
        None => [Access::Mapped, Access::Ranges].map(|access| (path.to_owned(), access)).to_vec(),
    }
}

fn folder() -> tempfile::TempDir {
    let within = std::env::var_os(SERVED).map_or_else(std::env::temp_dir, PathBuf::from);
    tempfile::tempdir_in(within).expect("a folder")
}

fn sweep(times: u64) -> Count {
    let mut count = Count::default();
    let folder = folder();
    for style in STYLES {
        let bytes = mcap_file(style);
        let path = &folder.path().join("recording.mcap");
        let (what, parts) = (format!("{style:?}"), records(&bytes));
        hold(&mut count, &Case { what, path, sound: &bytes, parts, data: style.crcs }, times);
    }
    for described in [true, false] {
        let folder = self::folder();
        let bytes = bag(folder.path(), described);
        let path = &folder.path().join("bag.db3");
        let (what, parts) =
            (format!("a bag, described: {described}"), (0..bytes.len()).step_by(4096).collect());
        hold(&mut count, &Case { what, path, sound: &bytes, parts, data: false }, times);
    }
    count
}

#[test]
fn no_loss_is_silent() {
    let count = sweep(FEW);
    println!("{} readings of mutations, {} with losses, {} told", count.mutations, count.losses, count.told);
    assert!(count.losses > count.mutations / 2, "the mutations do harm: {count:?}");
    assert!(count.silent.is_empty(), "{:#?}", count.silent);
}

#[test]
#[ignore = "10 000 mutations take a minute; `cargo test -p armcal-recording --test silent -- --ignored --nocapture`"]
fn no_loss_of_ten_thousand_mutations_is_silent() {
    let count = sweep(MANY / (STYLES.len() as u64 + 2));
    println!("{} readings of mutations, {} with losses, {} told", count.mutations, count.losses, count.told);
    assert!(count.silent.is_empty(), "{:#?}", count.silent);
}

/// Answers requests for ranges of files as S3 does.
#[cfg(feature = "s3")]
fn serve(store: &std::net::TcpListener, folder: &Path) {
    use std::io::{BufRead as _, BufReader, Write as _};
    while let Ok((mut client, _)) = store.accept() {
        let folder = folder.to_owned();
        std::thread::spawn(move || {
            client.set_nodelay(true).expect("set");
            let mut lines = BufReader::new(client.try_clone().expect("cloned")).lines().map_while(Result::ok);
            while let Some(asked) = lines.next() {
                let headers: Vec<String> = lines.by_ref().take_while(|line| !line.is_empty()).collect();
                let range =
                    headers.iter().find_map(|line| line.strip_prefix("range: bytes=")).expect("a range");
                let path = asked.split(' ').nth(1).expect("a path").trim_start_matches("/lab/");
                let bytes = std::fs::read(folder.join(path)).expect("served");
                let (from, to) = range.split_once('-').expect("two ends");
                let number = |text: &str| text.parse::<usize>().expect("a number");
                let (from, to) = match from {
                    "" => (bytes.len().saturating_sub(number(to)), bytes.len()),
                    from => (number(from), bytes.len().min(number(to) + 1)),
                };
                let head = format!(
                    "HTTP/1.1 206 Partial Content\r\nContent-Length: {}\r\nContent-Range: bytes {from}-{}/{}\r\n\
                     ETag: \"1\"\r\nLast-Modified: Thu, 01 Jan 2026 00:00:00 GMT\r\n\r\n",
                    to - from,
                    to.saturating_sub(1),
                    bytes.len()
                );
                if client.write_all(&[head.as_bytes(), &bytes[from..to]].concat()).is_err() {
                    break;
                }
            }
        });
    }
}

#[cfg(feature = "s3")]
#[test]
fn no_loss_is_silent_in_a_bucket() {
    let folder = tempfile::tempdir().expect("a folder");
    let store = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = store.local_addr().expect("bound").port();
    let served = folder.path().to_owned();
    std::thread::spawn(move || serve(&store, &served));
    // Where the store is, a process is told by its environment.
    let output = std::process::Command::new(std::env::current_exe().expect("this test"))
        .args(["--exact", "no_loss_is_silent", "--nocapture"])
        .env(SERVED, folder.path())
        .env("AWS_ENDPOINT_URL", format!("http://127.0.0.1:{port}"))
        .envs([("AWS_ALLOW_HTTP", "true"), ("AWS_REGION", "x"), ("AWS_SKIP_SIGNATURE", "true")])
        .env("NO_PROXY", "127.0.0.1")
        .output()
        .expect("started");
    let said = [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text)).concat();
    println!("{said}");
    assert!(output.status.success() && said.contains("1 passed"), "{said}");
}
