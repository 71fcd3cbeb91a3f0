//! Databases of rosbag2 (SQLite): tables `topics` and `messages`, since Iron also `message_definitions`.
//!
//! Schema: `rosbag2_storage_sqlite3` of ros2/rosbag2. Nothing is ever written beside the user's file: it is opened as
//! immutable, so that SQLite makes neither a journal nor a lock. Where a recorder that died left a write-ahead log or
//! a journal, both are copied, and the copy is opened.

use super::copy::Copy;
use super::database::{
    Stored, compare_index, compare_log, compare_rows, is_of_disk, quick_check, read_error,
};
use super::definitions;
use super::wal::{Frames, count_frames, identity};
use crate::RecordingError;
use crate::bytes::budget::{Allowance, FREE_VARIABLE, most_definition_bytes};
use crate::bytes::input;
use crate::bytes::logs::{logs_of, path_beside};
use crate::error::no_room;
use rusqlite::config::DbConfig;
use rusqlite::limits::Limit;
use rusqlite::types::ValueRef;
use rusqlite::{Connection, Error, ErrorCode, OpenFlags};
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// The longest text or list of bytes that a database may make SQLite hold [bytes]; its own statements need some.
const MAX_VALUE_BYTES: u64 = 1 << 30;
const LEAST_VALUE_BYTES: u64 = 1 << 20;

/// Copies the messages of a database; returns the identity of the log that was read with it, and the types whose definitions
/// are not its own.
pub(super) fn read(
    file: &Path,
    copy: &mut Copy,
    allowance: &Allowance,
) -> Result<(String, BTreeSet<String>), RecordingError> {
    let refused = |path: &Path, why: String| RecordingError::Foreign { path: path.to_owned(), why };
    let with_pending = copy_with_logs(file)?;
    let opened = match &with_pending {
        Some(Pending { copied, .. }) => {
            Connection::open_with_flags(copied, OpenFlags::SQLITE_OPEN_READ_WRITE)
        }
        None => {
            let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_URI;
            Connection::open_with_flags(immutable_uri(file), flags)
        }
    };
    let path = copy.path().to_owned();
    let unreadable = |e: Error| match is_of_disk(&e) {
        true => read_error(&path, e),
        false => refused(&path, format!("it is an SQLite database that cannot be read ({e})")),
    };
    let database = opened.map_err(unreadable)?;
    let bytes = bytes_of_all(file);
    harden_connection(&database, bytes).map_err(unreadable)?;
    let is_corrupt = |e: &Error| e.sqlite_error_code() == Some(ErrorCode::DatabaseCorrupt);
    let (tables, corrupt) = match stored_tables(&database) {
        Err(e) if is_corrupt(&e) => {
            // SQLite then reads what there is of a database that is shorter than its header says.
            database.set_db_config(DbConfig::SQLITE_DBCONFIG_WRITABLE_SCHEMA, true).map_err(unreadable)?;
            (stored_tables(&database), Some(e))
        }
        tables => (tables, None),
    };
    let tables = tables.map_err(unreadable)?;
    if let Some(missing) = ["topics", "messages"].into_iter().find(|table| !tables.contains(*table)) {
        return Err(match corrupt {
            Some(e) => unreadable(e),
            None => refused(
                &path,
                format!("it is an SQLite database, but not of rosbag2: it has no table `{missing}`"),
            ),
        });
    }
    if let Some(e) = corrupt {
        copy.lost(format!("the database is damaged ({e})"));
    }
    let log = match with_pending {
        Some(pending) => {
            if pending.wal {
                compare_log(&database, pending.frames, copy)?;
            }
            pending.identity
        }
        None => String::new(),
    };
    quick_check(&database, copy)?;
    let (topics, known_here) = add_topics(&database, &tables, copy)?;
    let stored = copy_messages(&database, &topics, copy, (bytes, allowance))?;
    compare_rows(&stored, copy);
    compare_index(&database, &stored, copy)?;
    Ok((log, known_here))
}

/// Nothing in a database is trusted: no functions in its schema, no values longer than the file.
fn harden_connection(database: &Connection, bytes: u64) -> rusqlite::Result<()> {
    let longest = i32::try_from(bytes.clamp(LEAST_VALUE_BYTES, MAX_VALUE_BYTES)).unwrap_or(i32::MAX);
    database.set_db_config(DbConfig::SQLITE_DBCONFIG_TRUSTED_SCHEMA, false)?;
    database.set_db_config(DbConfig::SQLITE_DBCONFIG_ENABLE_VIEW, false)?;
    database.set_db_config(DbConfig::SQLITE_DBCONFIG_ENABLE_TRIGGER, false)?;
    database.set_limit(Limit::SQLITE_LIMIT_LENGTH, longest)?;
    database.pragma_update(None, "cell_size_check", true)
}

/// The tables whose columns are all stored.
fn stored_tables(database: &Connection) -> rusqlite::Result<BTreeSet<String>> {
    let mut statement = database.prepare(
        "SELECT name FROM sqlite_schema WHERE type = 'table' AND sql LIKE 'CREATE TABLE%' \
         AND NOT EXISTS (SELECT 1 FROM pragma_table_xinfo(sqlite_schema.name) WHERE hidden <> 0)",
    )?;
    statement.query_map([], |row| row.get(0))?.collect()
}

/// Adds a channel for each topic; returns them by the numbers that the database gives them, and the types that it does not
/// define.
fn add_topics(
    database: &Connection,
    tables: &BTreeSet<String>,
    copy: &mut Copy,
) -> Result<(BTreeMap<i64, u16>, BTreeSet<String>), RecordingError> {
    let path = copy.path().to_owned();
    let (mut channels, mut known_here, mut bytes) = (BTreeMap::new(), BTreeSet::new(), 0);
    let mut topics = || -> Result<(), Stop> {
        let of_bag = match tables.contains("message_definitions") {
            true => stored_definitions(database)?,
            false => BTreeMap::new(),
        };
        let mut statement =
            database.prepare("SELECT id, name, type, serialization_format FROM topics ORDER BY id")?;
        let mut rows = statement.query([])?;
        while let Some(row) = rows.next()? {
            let (id, name, kind, format): (i64, String, String, String) =
                (row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?);
            bytes += name.len() + kind.len() + format.len();
            if bytes > most_definition_bytes() {
                return Err(Stop::Endless);
            }
            let stored = of_bag.get(&kind).map(|(encoding, text)| (encoding.as_str(), text.as_str().into()));
            let readable = stored.as_ref().is_some_and(|(encoding, _)| *encoding == "ros2msg");
            let known = if readable { None } else { definitions::full_text(&kind) };
            if known.is_some() {
                known_here.insert(kind.clone());
            }
            let definition = known.map(|text| ("ros2msg", Cow::from(text))).or(stored);
            let (encoding, text) = definition.unwrap_or_default();
            let added = copy.add_channel(&name, Some((&kind, encoding, text.as_bytes())), &format);
            channels.insert(id, added.map_err(Stop::Failed)?);
        }
        Ok(())
    };
    let refused = |why: String| Err(RecordingError::Foreign { path: path.clone(), why });
    match topics() {
        Ok(()) => Ok((channels, known_here)),
        Err(Stop::Failed(e)) => Err(e),
        Err(Stop::Damaged(e)) if is_of_disk(&e) => Err(read_error(&path, e)),
        Err(Stop::Damaged(e)) => refused(format!(
            "its topics cannot be read ({e}); `sqlite3 IN .recover | sqlite3 OUT` may save it"
        )),
        Err(Stop::Endless) => refused(format!(
            "its topics and message definitions take more than the {} MiB that they may ({FREE_VARIABLE} says more)",
            most_definition_bytes() >> 20
        )),
    }
}

/// Encoding and text of each message type.
fn stored_definitions(database: &Connection) -> Result<BTreeMap<String, (String, String)>, Stop> {
    let mut statement = database
        .prepare("SELECT topic_type, encoding, encoded_message_definition FROM message_definitions")?;
    let (mut all, mut bytes) = (BTreeMap::new(), 0);
    let mut rows = statement.query([])?;
    while let Some(row) = rows.next()? {
        let (kind, encoding, text): (String, String, String) = (row.get(0)?, row.get(1)?, row.get(2)?);
        bytes += kind.len() + encoding.len() + text.len();
        if bytes > most_definition_bytes() {
            return Err(Stop::Endless);
        }
        all.insert(kind, (encoding, text));
    }
    Ok(all)
}

/// Copies message after message in the order in which they are stored, as long as they are no more than the database holds:
/// pages that refer to each other could give rows without end.
fn copy_messages(
    database: &Connection,
    topics: &BTreeMap<i64, u16>,
    copy: &mut Copy,
    (most_bytes, allowance): (u64, &Allowance),
) -> Result<Stored, RecordingError> {
    let mut stored = Stored::default();
    let mut pass = || -> Result<(), Stop> {
        let mut statement =
            database.prepare("SELECT rowid, topic_id, timestamp, data FROM messages NOT INDEXED")?;
        let mut rows = statement.query([])?;
        while let Some(row) = rows.next()? {
            let (number, data) = (row.get::<_, i64>(0)?, row.get_ref(3)?);
            let time_ns = row.get_ref(2)?.as_i64().ok();
            let sequence = stored.rows as u32;
            stored.add(number, time_ns, data.as_bytes().map_or(0, <[u8]>::len));
            if stored.bytes > most_bytes {
                return Err(Stop::Endless);
            }
            match (row.get_ref(1)?, time_ns, data) {
                (ValueRef::Integer(topic), Some(time_ns @ 0..), ValueRef::Blob(data)) => {
                    let Some(channel) = topics.get(&topic) else {
                        stored.strangers += 1;
                        continue;
                    };
                    let put = copy.put(*channel, sequence, time_ns.cast_unsigned(), data, allowance);
                    put.map_err(Stop::Failed)?;
                }
                _ => stored.odd += 1,
            }
        }
        Ok(())
    };
    match pass() {
        Ok(()) => {}
        Err(Stop::Damaged(e)) if is_of_disk(&e) => return Err(read_error(copy.path(), e)),
        Err(Stop::Damaged(e)) => copy.lost(format!(
            "the database is damaged ({e}) and read up to its message {}; `sqlite3 IN .recover | sqlite3 OUT` \
             may save more",
            stored.rows
        )),
        Err(Stop::Endless) => copy.lost(format!(
            "its first {} messages are more than its {most_bytes} bytes can hold; it is read no further",
            stored.rows
        )),
        Err(Stop::Failed(e)) => return Err(e),
    }
    Ok(stored)
}

/// Why a pass over rows ended early.
enum Stop {
    Damaged(Error),
    /// More than there are bytes for, or than may be.
    Endless,
    Failed(RecordingError),
}

impl From<Error> for Stop {
    fn from(error: Error) -> Stop {
        Stop::Damaged(error)
    }
}

/// A copy of a database and of what SQLite has not put into it yet.
struct Pending {
    copied: PathBuf,
    /// Identity of what is not in it yet.
    identity: String,
    /// Whether that is a write-ahead log, and what it holds.
    wal: bool,
    frames: Option<Frames>,
    _folder: tempfile::TempDir,
}

/// Copies both, if there is anything that is not in the database yet.
fn copy_with_logs(file: &Path) -> Result<Option<Pending>, RecordingError> {
    let logs = logs_of(file);
    if logs.is_empty() {
        return Ok(None);
    }
    let failed = no_room(file);
    let folder = tempfile::tempdir().map_err(&failed)?;
    let copied = folder.path().join("bag.db3");
    std::fs::copy(file, &copied).map_err(&failed)?;
    for (ending, log) in &logs {
        input::register_path(log);
        std::fs::copy(log, path_beside(&copied, ending)).map_err(&failed)?;
    }
    // Of the copies, which nobody writes on.
    let identity = identity(&copied)?;
    let wal = logs.iter().any(|(ending, _)| *ending == "-wal");
    let frames = if wal { count_frames(&path_beside(&copied, "-wal")).map_err(&failed)? } else { None };
    Ok(Some(Pending { copied, identity, wal, frames, _folder: folder }))
}

/// Size of a database and of what is not in it yet [bytes].
fn bytes_of_all(file: &Path) -> u64 {
    let bytes_of = |path: &Path| std::fs::metadata(path).map_or(0, |about| about.len());
    logs_of(file).iter().map(|(_, path)| path.as_path()).chain([file]).map(bytes_of).sum()
}

/// A path as a URI by which SQLite opens a file that nobody changes.
fn immutable_uri(file: &Path) -> String {
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
