//! The folder of a pool in shards: what each round asks, and what each share answers. Files appear whole and are never changed.
//!
//! | below `rounds/` | by | what |
//! |---|---|---|
//! | `0/I-of-N` | map | what the results of a share are |
//! | `plan` | reduce | which recordings are pooled, in which order, what each share reads of them |
//! | `K/questions` | reduce | what round K asks, and what the rounds before have settled |
//! | `K/I-of-N` | map | the answers of a share |
//!
//! All are MessagePack, after the key of the pool: hash of pipeline, model, board, names of the results and version.

use crate::batch::{Keys, Shard, write_one};
use crate::error::Error;
use armcal_config::Pipeline;
use armcal_recording::{input, make_folder_in};
use armcal_report::VERSION;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::io::{BufReader, Seek as _, SeekFrom};
use std::path::{Path, PathBuf};

const FOLDER: &str = "rounds";
const SCHEMA: &str = "armcal.pool-round/1";

/// What all files of one pool begin with.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Head {
    schema: String,
    version: String,
    pool: String,
    /// Sizes of the parts that follow [bytes].
    parts: Vec<u64>,
}

/// The rounds of one pool.
pub(super) struct Rounds {
    folder: PathBuf,
    key: String,
}

impl Rounds {
    /// Of the pool of these results below `out`.
    ///
    /// # Errors
    /// A file of the pipeline that cannot be read.
    pub fn new(pipeline: &Pipeline, results: &[PathBuf], out: &Path) -> Result<Rounds, Error> {
        let names = results.iter().map(|path| path.to_string_lossy().into_owned());
        Ok(Rounds { folder: out.join(FOLDER), key: Keys::new(pipeline, false, out)?.of(SCHEMA, names) })
    }

    /// Whether `out` holds rounds of a pool.
    pub fn are_in(out: &Path) -> bool {
        out.join(FOLDER).is_dir()
    }

    pub fn plan(&self) -> PathBuf {
        self.folder.join("plan")
    }

    /// What a round asks; the first, 0, asks what there is.
    pub fn questions(&self, round: usize) -> PathBuf {
        self.folder.join(round.to_string()).join("questions")
    }

    pub fn answers(&self, round: usize, shard: Shard) -> PathBuf {
        self.folder.join(round.to_string()).join(shard.file_stem())
    }

    /// The round that is open.
    pub fn latest(&self) -> usize {
        (1..).take_while(|round| self.questions(*round).is_file()).last().unwrap_or(0)
    }

    /// The shares of the first round, from all files below `out`.
    ///
    /// # Errors
    /// None at all, shares of two partitions, and missing ones; each by name.
    pub fn shards(out: &Path) -> Result<Vec<Shard>, Error> {
        let folder = out.join(FOLDER).join("0");
        let bad = |why: String| Error::Pool { path: folder.clone(), why };
        let entries = std::fs::read_dir(&folder)
            .map_err(|e| bad(format!("{e}; `armcal map --pool` leaves what it read there")))?;
        let names = entries.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned());
        let mut found: Vec<Shard> = names.filter_map(|name| Shard::of_file_stem(&name)).collect();
        found.sort_unstable();
        let Some(first) = found.first() else {
            return Err(bad("holds no share; run `armcal map --pool` first".into()));
        };
        if let Some(other) = found.iter().find(|shard| shard.of() != first.of()) {
            return Err(bad(format!(
                "holds shares of two partitions, {first} and {other}: remove those of one"
            )));
        }
        let all = Shard::all(first.of());
        let missing: Vec<String> = all.iter().filter(|s| !found.contains(s)).map(Shard::to_string).collect();
        match missing.is_empty() {
            true => Ok(all),
            false => Err(bad(format!("share {} is missing: map it, then reduce again", missing.join(", ")))),
        }
    }

    /// Writes a file of several parts.
    ///
    /// # Errors
    /// What goes wrong in writing; another file in its place.
    pub fn write<T: Serialize>(&self, path: &Path, parts: &[T]) -> Result<(), Error> {
        let bytes = |e: rmp_serde::encode::Error| Error::Pool { path: path.to_owned(), why: e.to_string() };
        let parts =
            parts.iter().map(rmp_serde::to_vec_named).collect::<Result<Vec<_>, _>>().map_err(bytes)?;
        let (schema, version, pool) = (SCHEMA.to_owned(), VERSION.to_owned(), self.key.clone());
        let head =
            Head { schema, version, pool, parts: parts.iter().map(|part| part.len() as u64).collect() };
        let mut all = rmp_serde::to_vec_named(&head).map_err(bytes)?;
        all.extend(parts.into_iter().flatten());
        let out = self.folder.parent().unwrap_or(Path::new(""));
        let inner = path.parent().and_then(|folder| folder.strip_prefix(out).ok());
        make_folder_in(out, inner.unwrap_or(Path::new(FOLDER))).map_err(Error::Output)?;
        write_one(path, &all)
    }

    /// Whether a file is there and of this pool.
    ///
    /// # Errors
    /// It is of another pool, or cannot be read.
    pub fn has(&self, path: &Path) -> Result<bool, Error> {
        if !path.is_file() {
            return Ok(false);
        }
        open(path, Some(&self.key)).map(|_| true)
    }

    /// One part of a file.
    ///
    /// # Errors
    /// A file that is missing, half, or of another pool.
    pub fn read<T: DeserializeOwned>(&self, path: &Path, part: usize) -> Result<T, Error> {
        part_of(path, Some(&self.key), part)
    }

    /// The first part of a file, whatever pool it is of.
    ///
    /// # Errors
    /// A file that is missing, half, or of another version.
    pub fn read_any<T: DeserializeOwned>(out: &Path, shard: Shard) -> Result<T, Error> {
        part_of(&out.join(FOLDER).join("0").join(shard.file_stem()), None, 0)
    }
}

/// A file behind its head.
fn open(path: &Path, key: Option<&str>) -> Result<(Head, BufReader<std::fs::File>), Error> {
    let bad = |why: String| Error::Pool { path: path.to_owned(), why };
    let mut file = BufReader::new(input::open(path).map_err(|e| bad(e.to_string()))?);
    let head: Head = rmp_serde::from_read(&mut file).map_err(|e| unreadable(path, &e))?;
    if head.schema != SCHEMA || head.version != VERSION {
        return Err(bad(format!(
            "was made by armcal {}, and this is {VERSION}: go on with that, or remove `{FOLDER}`",
            head.version
        )));
    }
    if key.is_some_and(|key| key != head.pool) {
        return Err(bad(format!(
            "is of another pool: pipeline, model, board or the list of results changed; remove `{FOLDER}` to begin anew, or name \
             another --out"
        )));
    }
    Ok((head, file))
}

fn part_of<T: DeserializeOwned>(path: &Path, key: Option<&str>, part: usize) -> Result<T, Error> {
    let (head, mut file) = open(path, key)?;
    let before: u64 = head.parts.iter().take(part).sum();
    file.seek(SeekFrom::Current(i64::try_from(before).unwrap_or(i64::MAX)))
        .map_err(|e| unreadable(path, &e))?;
    rmp_serde::from_read(&mut file).map_err(|e| unreadable(path, &e))
}

fn unreadable(path: &Path, e: &dyn std::fmt::Display) -> Error {
    let why = format!("is not what armcal wrote ({e}): remove it, and map or reduce again");
    Error::Pool { path: path.to_owned(), why }
}
