//! Databases of rosbag2 by construction: orders add rows to a sound bag, take some away, leave the last ones in the log, and then
//! change the bytes of both files. What is read is compared with what was added.

use super::limits::{Size, held};
use super::recordings::{memory_folder, recording_at};
use armcal_core::{Severity, Warning};
use armcal_recording::Recording;
use rusqlite::Connection;
use rusqlite::config::DbConfig;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::Path;
use tempfile::TempDir;

const TOPICS: [&str; 2] = ["/joint_states", "/vicon/tip"];
const TABLES: &str = "PRAGMA synchronous = OFF; PRAGMA page_size = 1024; \
     CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, serialization_format TEXT NOT NULL); \
     CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL); \
     CREATE INDEX timestamp_idx ON messages (timestamp ASC); \
     INSERT INTO topics VALUES(1, '/joint_states', 'sensor_msgs/msg/JointState', 'cdr'); \
     INSERT INTO topics VALUES(2, '/vicon/tip', 'geometry_msgs/msg/PoseStamped', 'cdr'); BEGIN";

/// Topic and time of each message.
type Messages = Vec<(String, u64)>;

/// A bag made by the orders, read whole.
pub fn bag(orders: &[u8]) {
    thread_local!(static FOLDER: RefCell<Option<TempDir>> = const { RefCell::new(None) });
    FOLDER.with_borrow_mut(|folder| {
        let folder = folder.get_or_insert_with(|| tempfile::tempdir_in(memory_folder()).expect("a folder"));
        for name in ["bag.db3", "bag.db3-wal", "bag.db3-shm", "metadata.yaml"] {
            let _ = std::fs::remove_file(folder.path().join(name));
        }
        let path = folder.path().join("bag.db3");
        let Ok(made) = make(orders, &path) else { return };
        let bytes = [&path, &beside(&path)].map(|p| std::fs::metadata(p).map_or(0, |m| m.len() as usize));
        // What is in both of them is copied into an MCAP file, and that is read.
        held(Size { bytes: 2 * bytes.iter().sum::<usize>(), chunk: 0 }, || recording_at(&path));
        compare(&made, &path);
    });
}

fn beside(path: &Path) -> std::path::PathBuf {
    path.with_extension("db3-wal")
}

/// What a bag is made of.
struct Made {
    /// In the order in which they were added.
    written: Messages,
    /// Whether a description counts them.
    described: bool,
}

fn compare(made: &Made, path: &Path) {
    let mut read = Messages::new();
    let Ok(recording) = Recording::open(&[path.to_owned()]) else { return };
    let pass = recording.for_each_raw(&mut |m| {
        read.push((m.channel.topic.clone(), m.log_ns));
        Ok(())
    });
    let lost = |w: &Warning| w.severity == Severity::DataLost;
    if pass.is_err() || recording.report().warnings.iter().any(lost) {
        return;
    }
    let mut written = made.written.clone();
    if !made.described {
        // Nobody knows that the last ones are missing, nor how a topic was called.
        written.truncate(read.len());
        read.iter_mut().chain(&mut written).for_each(|(topic, _)| topic.clear());
    }
    read.sort();
    written.sort();
    assert!(read == written, "{} of {} messages, nothing said", read.len(), made.written.len());
}

struct Orders<'a>(&'a [u8]);

impl Orders<'_> {
    fn byte(&mut self) -> Option<u8> {
        let (first, rest) = self.0.split_first()?;
        self.0 = rest;
        Some(*first)
    }

    fn number(&mut self) -> Option<usize> {
        Some(usize::from(self.byte()?) << 8 | usize::from(self.byte()?))
    }
}

/// Rows first, bytes afterwards.
fn make(orders: &[u8], path: &Path) -> rusqlite::Result<Made> {
    let mut orders = Orders(orders);
    let mut made = Made { written: Vec::new(), described: orders.byte().is_some_and(|b| b % 2 == 1) };
    let database = Connection::open(path)?;
    database.set_db_config(DbConfig::SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, true)?;
    database.execute_batch(TABLES)?;
    let mut insert = database.prepare("INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)")?;
    let (mut deleted, mut changes) = (Vec::new(), Vec::new());
    while let Some(order) = orders.byte() {
        match order % 8 {
            // As many as the number says, of one size.
            0 | 1 => {
                let (times, size) = (orders.byte().unwrap_or(0) % 32, orders.byte().unwrap_or(0));
                for _ in 0..times {
                    let i = made.written.len();
                    let time = 1_000_000 * (i as u64 + 1);
                    let topic = usize::from(order >> 3) % 2;
                    insert.execute((
                        topic as i64 + 1,
                        time.cast_signed(),
                        vec![i as u8; usize::from(size)],
                    ))?;
                    made.written.push((TOPICS[topic].to_owned(), time));
                }
            }
            // At the end: the number of a row would be given again, which no recorder does.
            2 => deleted.push(orders.byte().map_or(0, i64::from)),
            3 => {
                database.execute_batch("COMMIT; PRAGMA journal_mode = WAL; BEGIN")?;
            }
            4 => database.execute_batch("COMMIT; BEGIN")?,
            _ => changes.push((order, orders.number().unwrap_or(0), orders.number().unwrap_or(0))),
        }
    }
    drop(insert);
    for id in deleted {
        database.execute("DELETE FROM messages WHERE id = ?", [id])?;
    }
    database.execute_batch("COMMIT")?;
    database.close().map_err(|(_, e)| e)?;
    if made.described {
        std::fs::write(path.with_file_name("metadata.yaml"), description(&made.written)).expect("written");
    }
    let log = beside(path);
    for (order, at, with) in changes {
        change(if order < 128 { path } else { &log }, order, at, with);
    }
    Ok(made)
}

/// A bit flipped, a page put in the place of another one, or the rest cut off.
fn change(file: &Path, order: u8, at: usize, with: usize) {
    const PAGE: usize = 1024;
    let Ok(mut bytes) = std::fs::read(file) else { return };
    if bytes.is_empty() {
        return;
    }
    let at = at % bytes.len();
    match order % 8 {
        5 => bytes[at] ^= 1 << (with % 8),
        6 => {
            let pages = bytes.len().div_ceil(PAGE);
            let (to, from) = (at % pages * PAGE, with % pages * PAGE);
            let end = (from + PAGE).min(bytes.len() - to.saturating_sub(from)).min(bytes.len());
            bytes.copy_within(from..end.max(from), to);
        }
        _ => bytes.truncate(at),
    }
    std::fs::write(file, bytes).expect("written");
}

/// What rosbag2 writes beside its databases.
fn description(written: &Messages) -> String {
    let mut counts = BTreeMap::from(TOPICS.map(|topic| (topic, 0)));
    written.iter().for_each(|(topic, _)| *counts.entry(topic).or_default() += 1);
    let topics: String = (counts.iter())
        .map(|(topic, count)| {
            format!("    - topic_metadata:\n        name: {topic}\n        type: x\n      message_count: {count}\n")
        })
        .collect();
    let all = written.len();
    format!(
        "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: sqlite3\n  relative_file_paths:\n    - bag.db3\n  \
         message_count: {all}\n  topics_with_message_count:\n{topics}  files:\n    - path: bag.db3\n      \
         message_count: {all}\n"
    )
}
