//! Databases of rosbag2 and compressed files, as no recorder leaves them but a crash or an attacker does.

use super::raw_count;
use crate::ros2::{Header, JOINT_STATE, joint_state};
use crate::{Recording, RecordingError};
use rusqlite::Connection;
use std::path::{Path, PathBuf};

const TABLES: &str = "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, \
     serialization_format TEXT NOT NULL); \
     CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL); \
     INSERT INTO topics VALUES(1, '/joint_states', 'sensor_msgs/msg/JointState', 'cdr');";

fn message(i: i64) -> Vec<u8> {
    let header = Header { stamp_ns: 1_000_000_000 + i * 1_000_000, frame_id: "" };
    joint_state(header, &["a", "b"], &[0.1, 0.2 + 1e-3 * i as f64], &[], &[])
}

fn insert(database: &Connection, topic: i64, i: i64, data: &[u8]) {
    let values = (topic, 1_000_000_000 + i * 1_000_000, data);
    database
        .execute("INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)", values)
        .expect("inserted");
}

fn bag(folder: &Path, tables: &str) -> (PathBuf, Connection) {
    let path = folder.join("bag #1 100%.db3");
    let database = Connection::open(&path).expect("a database");
    database.execute_batch(tables).expect("tables");
    (path, database)
}

fn open(path: &Path) -> Result<Recording, RecordingError> {
    Recording::open(&[path.to_owned()])
}

fn listing(folder: &Path) -> Vec<(PathBuf, u64)> {
    let entries = std::fs::read_dir(folder).expect("a folder").flatten();
    let mut all: Vec<_> = entries.map(|e| (e.path(), e.metadata().map_or(0, |about| about.len()))).collect();
    all.sort();
    all
}

/// What a recorder that was killed had not moved into the database yet is read, and stays where it is.
#[test]
fn what_is_in_a_write_ahead_log_is_read_and_nothing_changes_beside_it() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (path, database) = bag(folder.path(), &format!("PRAGMA journal_mode = WAL; {TABLES}"));
    (0..500).for_each(|i| insert(&database, 1, i, &message(i)));
    let before = listing(folder.path());
    assert!(before.iter().any(|(path, bytes)| path.to_string_lossy().ends_with("-wal") && *bytes > 0));
    let recording = open(&path).expect("a recording");
    assert_eq!(raw_count(&recording), 500);
    assert_eq!(listing(folder.path()), before);
    // What was read is the file and its log: the identity is that of both, and another one when the log has grown.
    let report = recording.report();
    let hash = |path: &Path| blake3::hash(&std::fs::read(path).expect("readable")).to_hex();
    let log = path.with_file_name("bag #1 100%.db3-wal");
    assert_eq!(report.files[0].identity, format!("blake3:{}+wal:blake3:{}", hash(&path), hash(&log)));
    assert_eq!(crate::identity_of(&path).expect("readable"), report.files[0].identity);
    assert_eq!(report.warnings, []);
    insert(&database, 1, 500, &message(500));
    assert_ne!(crate::identity_of(&path).expect("readable"), report.files[0].identity);
    assert_eq!(recording.report().channels[0].decodable.as_deref(), Ok("joints"));
    drop(database);
}

#[test]
fn rows_that_are_no_messages_are_counted_and_the_others_read() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (path, database) = bag(folder.path(), TABLES);
    (0..100).for_each(|i| insert(&database, 1, i, &message(i)));
    (0..7).for_each(|i| insert(&database, 9, i, &message(i)));
    insert(&database, 1, -2_000_000, &message(0));
    database
        .execute("INSERT INTO messages(topic_id, timestamp, data) VALUES(1, 5, 'text')", [])
        .expect("inserted");
    // Compressed by itself, sound and not.
    let packed = zstd::encode_all(&message(100)[..], 3).expect("compressed");
    insert(&database, 1, 100, &packed);
    insert(&database, 1, 101, &packed[..packed.len() - 5]);
    drop(database);
    let recording = open(&path).expect("a recording");
    assert_eq!(raw_count(&recording), 101);
    let said: Vec<String> = recording.report().warnings.iter().map(ToString::to_string).collect();
    for words in
        ["7 messages of topics that it does not list", "2 messages without a time or bytes", "1 compressed"]
    {
        assert!(said.iter().any(|warning| warning.contains(words)), "{words}: {said:?}");
    }
}

/// A database is a program as far as its author can make it one: views, computed columns, other tables of the name.
#[test]
fn what_computes_is_no_table_of_messages() {
    let computed = [
        TABLES.replace("data BLOB NOT NULL", "data BLOB AS (zeroblob(100000000))"),
        "CREATE TABLE topics(id); CREATE VIEW messages AS SELECT 1 AS topic_id, 1 AS timestamp, zeroblob(9) AS data".into(),
        "CREATE TABLE notes(text)".into(),
    ];
    for tables in computed {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let (path, database) = bag(folder.path(), &tables);
        drop(database);
        let why = open(&path).err().expect("refused").to_string();
        assert!(why.contains("not of rosbag2"), "{why}");
    }
}

#[test]
fn a_part_in_two_forms_is_one_too_many() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for name in ["a_0.db3", "a_0.mcap", "a_1.db3"] {
        std::fs::write(folder.path().join(name), b"x").expect("written");
    }
    let why = Recording::open(&[folder.path().to_owned()]).err().expect("refused").to_string();
    assert!(why.contains("a_0.db3") && why.contains("a_0.mcap") && why.contains("two forms"), "{why}");
}

#[test]
fn known_definitions_are_those_that_the_encoders_write() {
    let text = crate::foreign::definition_of(JOINT_STATE.name).expect("known");
    let fields = |text: &str| {
        let lines = text.lines().map(|line| line.trim().to_owned());
        lines.filter(|line| !line.is_empty()).collect::<Vec<_>>()
    };
    assert_eq!(fields(&text), fields(JOINT_STATE.text));
    assert_eq!(crate::foreign::definition_of("lab_msgs/msg/Unknown"), None);
    for (name, _) in crate::foreign::KNOWN_TYPES {
        let text = crate::foreign::definition_of(name).expect("known");
        let read = crate::decode::readable_as(name, "ros2msg", text.as_bytes(), "cdr");
        let sound = !matches!(read, Err(crate::decode::DecodeError::Schema { .. }));
        assert!(sound, "{name}: {read:?}");
    }
}
