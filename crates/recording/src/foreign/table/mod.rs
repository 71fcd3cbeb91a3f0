//! Tables as recordings: rows of joints and poses in CSV, Parquet or NumPy's `.npz`, as data sets are published.
//!
//! `csv | parquet | npz -> columns -> poses, times -> messages`. Columns that make a point or a pose become a topic each;
//! all others keep their names, as fields of one topic. A table says less than a recording: what is assumed of it is said.

mod csv;
mod lerobot;
mod messages;
mod names;
mod npz;
mod parquet;
mod poses;
mod rotations;
mod times;

use super::copy::Copy;
use crate::RecordingError;
use crate::bytes::budget::Allowance;
use crate::bytes::map::Map;
use std::path::Path;

/// The topic of all columns that are no part of a pose, and of the poses below it.
pub(super) const TOPIC: &str = "/columns";
/// The field that they are in: by themselves they might look like any other message.
const ROW: &str = "row";
/// More columns than this are no table of an arm.
const MOST_COLUMNS: usize = 2000;
/// Longer lists in a cell are images or sounds.
const LONGEST_LIST: usize = 128;

/// What a table is written in, by the name of its file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Format {
    Csv,
    Parquet,
    Npz,
}

/// How the names of tables end.
pub(crate) const ENDINGS: [(&str, Format); 4] =
    [(".csv", Format::Csv), (".tsv", Format::Csv), (".parquet", Format::Parquet), (".npz", Format::Npz)];

/// What was read, all columns equally long.
#[derive(Debug, Default)]
struct Table {
    columns: Vec<Column>,
    /// What is worth knowing of the reading.
    notes: Vec<String>,
    /// What could not be read.
    losses: Vec<String>,
}

#[derive(Debug, Clone, PartialEq)]
struct Column {
    name: String,
    values: Values,
}

#[derive(Debug, Clone, PartialEq)]
enum Values {
    /// NaN where a cell is empty.
    Numbers(Vec<f64>),
    /// A list in each row, all of one length, perhaps with names.
    Lists {
        length: usize,
        names: Vec<String>,
        flat: Vec<f64>,
    },
    Texts(Vec<String>),
}

impl Table {
    fn rows(&self) -> usize {
        self.columns.first().map_or(0, |column| match &column.values {
            Values::Numbers(values) => values.len(),
            Values::Lists { length, flat, .. } => flat.len() / length.max(&1),
            Values::Texts(texts) => texts.len(),
        })
    }
}

/// Copies the rows of a table as messages.
pub(super) fn read(
    map: &Map,
    (path, format): (&Path, Format),
    copy: &mut Copy,
    allowance: &Allowance,
) -> Result<(), RecordingError> {
    let refused = |why: String| RecordingError::Foreign { path: path.to_owned(), why };
    let table = match format {
        Format::Csv => csv::read(map),
        Format::Parquet => parquet::read(map, path, allowance),
        Format::Npz => npz::read(map, allowance),
    };
    let mut table = table.map_err(&refused)?;
    if table.rows() == 0 {
        return Err(refused("it is a table without any row of numbers".to_owned()));
    }
    if table.columns.len() > MOST_COLUMNS {
        let why = format!("it is a table of {} columns, more than {MOST_COLUMNS}", table.columns.len());
        return Err(refused(why));
    }
    let tracks = poses::take_poses(&mut table);
    let times = times::take_times(&mut table).map_err(&refused)?;
    messages::write(&table, &tracks, &times, copy)?;
    copy.notes(table.notes);
    table.losses.into_iter().for_each(|why| copy.lost(why));
    Ok(())
}
