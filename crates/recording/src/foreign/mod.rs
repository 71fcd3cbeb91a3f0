//! Recordings in other formats than MCAP: their messages are copied into an MCAP file without a name in the folder for
//! temporary files, and read from there as from any other.
//!
//! So there is one way from bytes to rows. A copy takes as much room on disk as the messages, inflated; memory holds one
//! message and one chunk. A file keeps its own name, size and identity.

#![allow(
    clippy::disallowed_methods,
    reason = "what is written here are copies that lose their names at once"
)]

mod copy;
mod database;
mod definitions;
mod inflate;
pub(crate) mod names;
mod rosbag1;
mod rosbag2;
pub(crate) mod table;
mod wal;

#[cfg(test)]
pub(crate) use definitions::TYPES as KNOWN_TYPES;
pub(crate) use definitions::{full_text as definition_of, ros1_text as ros1_definition_of};
pub use inflate::inflate_message;
pub(crate) use wal::identity as log_identity;

use crate::RecordingError;
use crate::bytes::FileBytes;
use crate::bytes::budget::Allowance;
use crate::bytes::map::Map;
use crate::bytes::url;
use crate::error::no_room;
use crate::structure::damage::Damage;
use copy::Copy;
use std::collections::BTreeSet;
use std::fs::File;
use std::io::{Read as _, Write as _};
use std::path::Path;

/// The messages of a recording in another format.
pub(crate) struct Converted {
    /// An MCAP file.
    pub map: Map,
    /// What of the original could not be used.
    pub damage: Vec<Damage>,
    /// What is assumed of it.
    pub notes: Vec<String>,
    /// Identity of the log that was read with it.
    pub log: String,
    /// What it was made from.
    pub origin: Origin,
}

/// What messages in an MCAP file were made from.
#[derive(Debug)]
pub(crate) enum Origin {
    /// An MCAP file, which is here as it is.
    Mcap,
    /// A bag, and the types whose definitions are not its own.
    Bag(BTreeSet<String>),
    /// A table, which has no definitions.
    Table,
}

/// What a file is, by its first bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Mcap,
    Database,
    Bag,
    Zstd,
}

/// So many bytes tell what a file is.
const HEAD_BYTES: usize = 16;

fn kind_of_head(head: &[u8]) -> Option<Kind> {
    match head {
        b if b.starts_with(mcap::MAGIC) => Some(Kind::Mcap),
        b if b.starts_with(b"SQLite format 3\0") => Some(Kind::Database),
        b if b.starts_with(rosbag1::MAGIC) => Some(Kind::Bag),
        b if b.starts_with(&inflate::MAGIC) => Some(Kind::Zstd),
        _ => None,
    }
}

fn kind_of(bytes: &FileBytes) -> Result<Option<Kind>, RecordingError> {
    Ok(kind_of_head(&bytes.read(0..HEAD_BYTES.min(bytes.len() as usize))?))
}

/// Whether a file is a database, which a log may stand beside.
pub(crate) fn is_database(bytes: &FileBytes) -> Result<bool, RecordingError> {
    Ok(kind_of(bytes)? == Some(Kind::Database))
}

/// Copies the messages of a file that is not MCAP itself; `None` if it is no recording that is known here.
pub(crate) fn convert(
    bytes: &FileBytes,
    path: &Path,
    allowance: &Allowance,
) -> Result<Option<Converted>, RecordingError> {
    let whole = |read: &dyn Fn(&Map) -> Result<Converted, RecordingError>| match bytes {
        FileBytes::Mapped(map) => read(map).map(Some),
        FileBytes::Ranged(ranged) => read(&ranged.spool(path)?).map(Some),
    };
    match kind_of(bytes)? {
        Some(Kind::Zstd) => whole(&|map| in_frame(map, path, allowance)),
        Some(Kind::Bag) => whole(&|map| convert_bag(map, path, allowance)),
        Some(Kind::Database) => match bytes {
            FileBytes::Ranged(object) if url::is_url(path) => {
                let mut file = tempfile::NamedTempFile::new().map_err(no_room(path))?;
                object.each_round(&mut |piece| file.write_all(piece).map_err(no_room(path)))?;
                convert_database(file.path(), path, allowance).map(Some)
            }
            _ => convert_database(path, path, allowance).map(Some),
        },
        Some(Kind::Mcap) => Ok(None),
        None => match names::table_format(path) {
            Some(format) => whole(&|map| {
                let mut copy = Copy::create(path, ["", "table"])?;
                table::read(map, (path, format), &mut copy, allowance)?;
                copy.finish(String::new(), Origin::Table)
            }),
            None => Ok(None),
        },
    }
}

/// What a file compressed as a whole holds.
fn in_frame(map: &Map, path: &Path, allowance: &Allowance) -> Result<Converted, RecordingError> {
    let mut named = tempfile::NamedTempFile::new().map_err(no_room(path))?;
    let damage: Vec<Damage> =
        inflate::to_file(map, path, named.as_file_mut(), allowance)?.into_iter().collect();
    let mut head = Vec::new();
    let mut reread = File::open(named.path()).map_err(no_room(path))?;
    std::io::Read::by_ref(&mut reread)
        .take(HEAD_BYTES as u64)
        .read_to_end(&mut head)
        .map_err(no_room(path))?;
    match kind_of_head(&head) {
        Some(Kind::Mcap) => {
            let mut map = Map::of(named.as_file()).map_err(no_room(path))?;
            // The identity is that of the original.
            map.hashed = None;
            Ok(Converted { map, damage, notes: Vec::new(), log: String::new(), origin: Origin::Mcap })
        }
        Some(Kind::Bag) => {
            let map = Map::of(named.as_file()).map_err(no_room(path))?;
            let mut converted = convert_bag(&map, path, allowance)?;
            converted.damage.splice(0..0, damage);
            Ok(converted)
        }
        Some(Kind::Database) => {
            let mut converted = convert_database(named.path(), path, allowance)?;
            converted.damage.splice(0..0, damage);
            Ok(converted)
        }
        Some(Kind::Zstd) | None => {
            let cut = damage.first().map(|d| format!("; {}", d.why)).unwrap_or_default();
            let why = format!("it is a compressed file (zstd), but no MCAP file and no bag is in it{cut}");
            Err(RecordingError::NotMcap { path: path.to_owned(), why })
        }
    }
}

/// The messages of the rosbag2 database `file`, which is or was made of `path`.
fn convert_database(file: &Path, path: &Path, allowance: &Allowance) -> Result<Converted, RecordingError> {
    let mut copy = Copy::create(path, ["ros2", "rosbag2 sqlite3"])?;
    let (log, known_here) = rosbag2::read(file, &mut copy, allowance)?;
    copy.finish(log, Origin::Bag(known_here))
}

/// The messages of a ROS 1 bag.
fn convert_bag(map: &Map, path: &Path, allowance: &Allowance) -> Result<Converted, RecordingError> {
    let mut copy = Copy::create(path, ["ros1", "rosbag 2.0"])?;
    rosbag1::read(map, &mut copy, allowance)?;
    copy.finish(String::new(), Origin::Bag(BTreeSet::new()))
}
