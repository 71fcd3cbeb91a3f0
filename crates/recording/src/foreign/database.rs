//! What else in a database of rosbag2 says which messages were written: SQLite's own check of its pages, the numbers of the
//! rows, the index of times, the pages of a write-ahead log.

use super::copy::Copy;
use super::wal::Frames;
use crate::RecordingError;
use crate::shortened;
use crate::structure::layout::hash_pair;
use rusqlite::ffi::{self, SQLITE_IOERR, SQLITE_IOERR_SHORT_READ};
use rusqlite::{Connection, Error, ErrorCode};
use std::path::Path;

/// A row takes so many bytes at least beside its data: numbers, a time, lengths.
const LEAST_ROW_BYTES: u64 = 8;

/// Whether SQLite failed because the disk did: not a damaged database, but one that cannot be read.
pub(super) fn is_of_disk(error: &Error) -> bool {
    // What is opened for writing is a copy: where that is refused, SQLite goes on without writing until it must.
    let failures = [
        ErrorCode::SystemIoFailure,
        ErrorCode::CannotOpen,
        ErrorCode::PermissionDenied,
        ErrorCode::ReadOnly,
        ErrorCode::DiskFull,
    ];
    error.sqlite_error_code().is_some_and(|code| failures.contains(&code))
}

pub(super) fn read_error(path: &Path, error: Error) -> RecordingError {
    RecordingError::Read { path: path.to_owned(), source: std::io::Error::other(error) }
}

/// Damage of the database is noted, a failure of the disk is an error.
fn tolerate_damage<T>(
    result: rusqlite::Result<T>,
    copy: &mut Copy,
    what: &str,
) -> Result<Option<T>, RecordingError> {
    match result {
        Ok(value) => Ok(Some(value)),
        Err(e) if is_of_disk(&e) => Err(read_error(copy.path(), e)),
        Err(e) => {
            copy.lost(format!("{what} ({e})"));
            Ok(None)
        }
    }
}

/// SQLite's own look at its pages.
pub(super) fn quick_check(database: &Connection, copy: &mut Copy) -> Result<(), RecordingError> {
    let said = database.query_row("PRAGMA quick_check(1)", [], |row| row.get::<_, String>(0));
    let said = tolerate_damage(said, copy, "the database is damaged")?;
    if let Some(said) = said.filter(|said| said != "ok") {
        // A page that the disk refuses is told like one that is damaged, by the number of its error; the end of a file that is
        // too short has one too.
        let code = said.rsplit_once("error code=").and_then(|(_, code)| code.trim().parse().ok());
        if let Some(code) =
            code.filter(|code| code & 0xff == SQLITE_IOERR && *code != SQLITE_IOERR_SHORT_READ)
        {
            return Err(read_error(copy.path(), Error::SqliteFailure(ffi::Error::new(code), None)));
        }
        let words: Vec<&str> = said.split_whitespace().collect();
        copy.lost(format!(
            "the database is damaged: SQLite's quick_check says {:?}",
            shortened(&words.join(" "))
        ));
    }
    Ok(())
}

/// Pages that the log holds, against those that SQLite took from it: it leaves out, without a word, what is damaged and
/// all that follows, and what was never committed.
pub(super) fn compare_log(
    database: &Connection,
    frames: Option<Frames>,
    copy: &mut Copy,
) -> Result<(), RecordingError> {
    let taken = database.query_row("PRAGMA wal_checkpoint(PASSIVE)", [], |row| row.get::<_, i64>(1));
    let taken = tolerate_damage(taken, copy, "its write-ahead log cannot be read")?
        .unwrap_or(0)
        .max(0)
        .cast_unsigned();
    match frames {
        None => copy.lost("its write-ahead log does not begin as one, and nothing of it is used".to_owned()),
        Some(frames) if frames.written != taken => copy.lost(format!(
            "its write-ahead log holds {} pages, {taken} of which are sound and committed: what the others held is lost",
            frames.written
        )),
        Some(frames) if frames.broken => {
            copy.lost("its write-ahead log is damaged or cut off".to_owned());
        }
        Some(_) => {}
    }
    Ok(())
}

/// The rows of the table of messages, for comparison with what else the database says of them.
#[derive(Debug, Default)]
pub(super) struct Stored {
    pub rows: u64,
    /// Rows and their values [bytes].
    pub bytes: u64,
    /// Rows of no topic, and such as are no messages.
    pub strangers: u64,
    pub odd: u64,
    /// The lowest and the highest number of a row.
    numbers: Option<[i64; 2]>,
    /// Times and numbers, mixed.
    mixed: u64,
}

impl Stored {
    pub fn add(&mut self, number: i64, time_ns: Option<i64>, bytes: usize) {
        self.rows += 1;
        let [low, high] = self.numbers.unwrap_or([number; 2]);
        self.numbers = Some([low.min(number), high.max(number)]);
        self.mixed = self.mixed.wrapping_add(row_hash(number, time_ns));
        self.bytes += bytes as u64 + LEAST_ROW_BYTES;
    }
}

fn row_hash(number: i64, time_ns: Option<i64>) -> u64 {
    hash_pair(time_ns.map_or(u64::MAX, i64::cast_unsigned), number.cast_unsigned())
}

/// Rows that are no messages, and numbers that are left out: a recorder counts from 1 on and takes none back.
pub(super) fn compare_rows(stored: &Stored, copy: &mut Copy) {
    for (messages, why) in
        [(stored.strangers, "of topics that it does not list"), (stored.odd, "without a time or bytes")]
    {
        if messages > 0 {
            copy.lost(format!("{messages} messages {why} cannot be used"));
        }
    }
    if let Some([low, high]) = stored.numbers
        && (low != 1 || high.cast_unsigned() != stored.rows)
    {
        copy.lost(format!(
            "its messages are numbered from {low} to {high}, and {} are there: rows were deleted or lost",
            stored.rows
        ));
    }
}

/// The index of times, which holds every time once more.
pub(super) fn compare_index(
    database: &Connection,
    stored: &Stored,
    copy: &mut Copy,
) -> Result<(), RecordingError> {
    let of_times = "SELECT list.name FROM pragma_index_list('messages') list \
                    WHERE list.partial = 0 AND (SELECT info.name FROM pragma_index_info(list.name) info \
                    WHERE info.seqno = 0) = 'timestamp'";
    let damaged = "the index of its messages cannot be read";
    let name = match database.query_row(of_times, [], |row| row.get::<_, String>(0)) {
        Err(Error::QueryReturnedNoRows) => return Ok(()),
        name => tolerate_damage(name, copy, damaged)?,
    };
    let Some(name) = name else { return Ok(()) };
    let sum = || -> rusqlite::Result<(u64, u64)> {
        let name = name.replace('"', "\"\"");
        let mut statement =
            database.prepare(&format!("SELECT timestamp, rowid FROM messages INDEXED BY \"{name}\""))?;
        let (mut rows, mut found) = (statement.query([])?, (0, 0_u64));
        while let Some(row) = rows.next()? {
            found.0 += 1;
            found.1 = found.1.wrapping_add(row_hash(row.get(1)?, row.get_ref(0)?.as_i64().ok()));
            // Pages that refer to each other could give entries without end.
            if found.0 > stored.rows {
                break;
            }
        }
        Ok(found)
    };
    let found = tolerate_damage(sum(), copy, damaged)?;
    if found.is_some_and(|found| found != (stored.rows, stored.mixed)) {
        copy.lost(format!(
            "the index of its messages lists others than the {} messages that are there, or at other times",
            stored.rows
        ));
    }
    Ok(())
}
