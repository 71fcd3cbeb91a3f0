//! Databases of rosbag2 (SQLite): tables `topics` and `messages`, since Iron also `message_definitions`.
//!
//! Schema: `rosbag2_storage_sqlite3` of ros2/rosbag2. Nothing is ever written beside the user's file: it is opened as
//! immutable, so that SQLite makes neither a journal nor a lock. Where a recorder that died left a write-ahead log or
//! a journal, both are copied, and the copy is opened.

use super::copy::{Copy, DEFINITION_FROM, no_room};
use super::definitions;
use crate::RecordingError;
use rusqlite::config::DbConfig;
use rusqlite::limits::Limit;
use rusqlite::types::ValueRef;
use rusqlite::{Connection, Error, ErrorCode, OpenFlags};
use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsString;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// SQLite keeps what is not yet in a database in files of its name with these endings.
const PENDING: [&str; 2] = ["-wal", "-journal"];
/// The longest text or list of bytes that a database may make SQLite hold [bytes]; its own statements need some.
const MAX_VALUE_BYTES: u64 = 1 << 30;
const LEAST_VALUE_BYTES: u64 = 1 << 20;

/// Copies the messages of a database.
pub(super) fn read(file: &Path, copy: &mut Copy) -> Result<(), RecordingError> {
    let refused = |why: String| RecordingError::Foreign { path: copy.path().to_owned(), why };
    let with_pending = pending(file).map_err(no_room(copy.path()))?;
    let opened = match &with_pending {
        Some((_, copied)) => Connection::open_with_flags(copied, OpenFlags::SQLITE_OPEN_READ_WRITE),
        None => {
            let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_URI;
            Connection::open_with_flags(immutable(file), flags)
        }
    };
    let unreadable = |e: Error| refused(format!("it is an SQLite database that cannot be read ({e})"));
    let database = opened.map_err(unreadable)?;
    harden(&database, longest(file)).map_err(unreadable)?;
    let is_corrupt = |e: &Error| e.sqlite_error_code() == Some(ErrorCode::DatabaseCorrupt);
    let (tables, corrupt) = match tables(&database) {
        Err(e) if is_corrupt(&e) => {
            // SQLite then reads what there is of a database that is shorter than its header says.
            database.set_db_config(DbConfig::SQLITE_DBCONFIG_WRITABLE_SCHEMA, true).map_err(unreadable)?;
            (tables(&database), Some(e))
        }
        tables => (tables, None),
    };
    let tables = tables.map_err(unreadable)?;
    if let Some(missing) = ["topics", "messages"].into_iter().find(|table| !tables.contains(*table)) {
        return Err(match corrupt {
            Some(e) => unreadable(e),
            None => {
                refused(format!("it is an SQLite database, but not of rosbag2: it has no table `{missing}`"))
            }
        });
    }
    let topics = add_topics(&database, &tables, copy)?;
    copy_messages(&database, &topics, copy)
}

/// Nothing in a database is trusted: no functions in its schema, no values longer than the file.
fn harden(database: &Connection, longest: i32) -> rusqlite::Result<()> {
    database.set_db_config(DbConfig::SQLITE_DBCONFIG_TRUSTED_SCHEMA, false)?;
    database.set_db_config(DbConfig::SQLITE_DBCONFIG_ENABLE_VIEW, false)?;
    database.set_db_config(DbConfig::SQLITE_DBCONFIG_ENABLE_TRIGGER, false)?;
    database.set_limit(Limit::SQLITE_LIMIT_LENGTH, longest)?;
    database.pragma_update(None, "cell_size_check", true)
}

/// No value is longer than a database and what is not in it yet [bytes].
fn longest(file: &Path) -> i32 {
    let parts = PENDING.map(|ending| beside(file, ending));
    let bytes = parts.iter().map(PathBuf::as_path).chain([file]).map(bytes_of).sum::<u64>();
    i32::try_from(bytes.clamp(LEAST_VALUE_BYTES, MAX_VALUE_BYTES)).unwrap_or(i32::MAX)
}

/// The tables whose columns are all stored.
fn tables(database: &Connection) -> rusqlite::Result<BTreeSet<String>> {
    let mut statement = database.prepare(
        "SELECT name FROM sqlite_schema WHERE type = 'table' AND sql LIKE 'CREATE TABLE%' \
         AND NOT EXISTS (SELECT 1 FROM pragma_table_xinfo(sqlite_schema.name) WHERE hidden <> 0)",
    )?;
    statement.query_map([], |row| row.get(0))?.collect()
}

/// Adds a channel for each topic; returns them by the numbers that the database gives them.
fn add_topics(
    database: &Connection,
    tables: &BTreeSet<String>,
    copy: &mut Copy,
) -> Result<BTreeMap<i64, u16>, RecordingError> {
    let damaged = |e: Error, path: &Path| RecordingError::Foreign {
        path: path.to_owned(),
        why: format!("its topics cannot be read ({e}); `sqlite3 IN .recover | sqlite3 OUT` may save it"),
    };
    let of_bag = match tables.contains("message_definitions") {
        true => stored_definitions(database),
        false => Ok(BTreeMap::new()),
    };
    let of_bag = of_bag.map_err(|e| damaged(e, copy.path()))?;
    let topics = || {
        let mut statement =
            database.prepare("SELECT id, name, type, serialization_format FROM topics ORDER BY id")?;
        let topic = |row: &rusqlite::Row<'_>| Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?));
        statement.query_map([], topic)?.collect::<rusqlite::Result<Vec<(i64, String, String, String)>>>()
    };
    let topics = topics().map_err(|e| damaged(e, copy.path()))?;
    let mut channels = BTreeMap::new();
    for (id, name, kind, format) in topics {
        let stored = of_bag.get(&kind).map(|(encoding, text)| ("bag", encoding.clone(), text.clone()));
        let known = || definitions::of(&kind).map(|text| ("armcal", "ros2msg".to_owned(), text));
        let readable = stored.as_ref().is_some_and(|(_, encoding, _)| encoding == "ros2msg");
        let definition = if readable { stored } else { known().or(stored) };
        let from = definition.as_ref().map(|(from, ..)| (DEFINITION_FROM.to_owned(), (*from).to_owned()));
        let (encoding, text) = definition.map_or_else(Default::default, |(_, e, t)| (e, t));
        let schema = (kind.as_str(), encoding.as_str(), text.as_bytes());
        let metadata = from.into_iter().collect();
        channels.insert(id, copy.add_channel(&name, Some(schema), &format, &metadata)?);
    }
    Ok(channels)
}

/// Encoding and text of each message type.
fn stored_definitions(database: &Connection) -> rusqlite::Result<BTreeMap<String, (String, String)>> {
    let mut statement = database
        .prepare("SELECT topic_type, encoding, encoded_message_definition FROM message_definitions")?;
    statement.query_map([], |row| Ok((row.get(0)?, (row.get(1)?, row.get(2)?))))?.collect()
}

/// Copies message after message in the order in which they are stored.
fn copy_messages(
    database: &Connection,
    topics: &BTreeMap<i64, u16>,
    copy: &mut Copy,
) -> Result<(), RecordingError> {
    let (mut read, mut strangers, mut odd) = (0_u32, 0_u64, 0_u64);
    let mut pass = || -> Result<(), Stop> {
        let mut statement = database.prepare("SELECT topic_id, timestamp, data FROM messages NOT INDEXED")?;
        let mut rows = statement.query([])?;
        while let Some(row) = rows.next()? {
            match (row.get_ref(0)?, row.get_ref(1)?, row.get_ref(2)?) {
                (ValueRef::Integer(topic), ValueRef::Integer(time_ns), ValueRef::Blob(data))
                    if time_ns >= 0 =>
                {
                    match topics.get(&topic) {
                        Some(channel) => {
                            copy.put(*channel, read, time_ns as u64, data).map_err(Stop::Failed)?
                        }
                        None => strangers += 1,
                    }
                }
                _ => odd += 1,
            }
            read = read.wrapping_add(1);
        }
        Ok(())
    };
    match pass() {
        Ok(()) => {}
        Err(Stop::Damaged(e)) => {
            copy.lost(format!(
                "the database is damaged ({e}) and read up to its message {read}; `sqlite3 IN .recover | sqlite3 OUT` \
                 may save more"
            ));
        }
        Err(Stop::Failed(e)) => return Err(e),
    }
    for (messages, why) in [(strangers, "of topics that it does not list"), (odd, "without a time or bytes")]
    {
        if messages > 0 {
            copy.lost(format!("{messages} messages {why} cannot be used"));
        }
    }
    Ok(())
}

/// Why a pass over the messages ended early.
enum Stop {
    Damaged(Error),
    Failed(RecordingError),
}

impl From<Error> for Stop {
    fn from(error: Error) -> Stop {
        Stop::Damaged(error)
    }
}

/// A copy of a database and of what SQLite has not put into it yet, if there is any.
fn pending(file: &Path) -> std::io::Result<Option<(tempfile::TempDir, PathBuf)>> {
    let endings: Vec<&str> =
        PENDING.into_iter().filter(|ending| bytes_of(&beside(file, ending)) > 0).collect();
    if endings.is_empty() {
        return Ok(None);
    }
    let folder = tempfile::tempdir()?;
    let copied = folder.path().join("bag.db3");
    std::fs::copy(file, &copied)?;
    for ending in endings {
        std::fs::copy(beside(file, ending), beside(&copied, ending))?;
    }
    Ok(Some((folder, copied)))
}

fn beside(file: &Path, ending: &str) -> PathBuf {
    let mut name = OsString::from(file);
    name.push(ending);
    PathBuf::from(name)
}

/// Size of a file; 0 where there is none.
fn bytes_of(path: &Path) -> u64 {
    std::fs::metadata(path).map_or(0, |about| about.len())
}

/// A path as a URI by which SQLite opens a file that nobody changes.
fn immutable(file: &Path) -> String {
    let mut uri = "file:".to_owned();
    for &byte in file.as_os_str().as_encoded_bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'/' | b'.' | b'-' | b'_' => uri.push(char::from(byte)),
            // Writing to memory cannot fail.
            _ => _ = write!(uri, "%{byte:02X}"),
        }
    }
    uri + "?immutable=1&mode=ro"
}
