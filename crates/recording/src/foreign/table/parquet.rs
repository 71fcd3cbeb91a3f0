//! Tables in Parquet.

use super::{Column, LONGEST_LIST, Table, Values, lerobot};
use crate::bytes::budget::Allowance;
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader as _, SerializedFileReader};
use parquet::record::{Field, Row};
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

/// What a cell takes in memory at least [bytes].
const CELL_BYTES: u64 = 8;

pub(super) fn read(bytes: &[u8], path: &Path, allowance: &Allowance) -> Result<Table, String> {
    // The library takes for granted what a damaged file does not have.
    let read = catch_unwind(AssertUnwindSafe(|| read_rows(bytes, allowance)));
    let damaged = |e: &dyn std::fmt::Display| format!("it is a Parquet file that cannot be read: {e}");
    let mut table = read.map_err(|_| damaged(&"its pages are damaged"))?.map_err(|e| damaged(&e))?;
    lerobot::name_lists(&mut table, path);
    Ok(table)
}

fn read_rows(bytes: &[u8], allowance: &Allowance) -> Result<Table, ParquetError> {
    let refused = |why: String| ParquetError::General(why);
    let reader = SerializedFileReader::new(bytes::Bytes::copy_from_slice(bytes))?;
    let about = reader.metadata().file_metadata();
    let rows = u64::try_from(about.num_rows()).unwrap_or(u64::MAX);
    let cells = rows.saturating_mul(about.schema_descr().num_columns() as u64);
    if !allowance.admits(bytes.len() as u64, cells.saturating_mul(CELL_BYTES)) {
        return Err(refused(allowance.refusal()));
    }
    let mut cells: BTreeMap<usize, (String, Cells)> = BTreeMap::new();
    let mut read = 0;
    for row in reader.get_row_iter(None)? {
        let mut at = 0;
        add(&row?, "", &mut at, read, &mut cells);
        read += 1;
        if read as u64 > rows {
            return Err(refused(format!("it has more rows than the {rows} that it says")));
        }
    }
    let mut table = Table::default();
    if (read as u64) < rows {
        table.losses.push(format!("it says that it has {rows} rows, {read} are there"));
    }
    for (_, (name, cells)) in cells {
        match cells.finish(read) {
            Some(values) => table.columns.push(Column { name, values }),
            None => table.notes.push(format!(
                "column {name} is neither a number nor a list of numbers of one length, and not used"
            )),
        }
    }
    Ok(table)
}

/// The cells of a column so far.
struct Cells {
    rows: usize,
    kind: Kind,
}

enum Kind {
    Numbers(Vec<f64>),
    Lists(usize, Vec<f64>),
    Texts(Vec<String>),
    Other,
}

/// Adds the cells of a row; of a group those inside.
fn add(row: &Row, inside: &str, at: &mut usize, number: usize, cells: &mut BTreeMap<usize, (String, Cells)>) {
    for (name, field) in row.get_column_iter() {
        let name = if inside.is_empty() { name.clone() } else { format!("{inside}.{name}") };
        if let Field::Group(group) = field {
            add(group, &name, at, number, cells);
            continue;
        }
        let new = || (name, Cells { rows: 0, kind: Kind::of(field) });
        cells.entry(*at).or_insert_with(new).1.add(field, number);
        *at += 1;
    }
}

impl Kind {
    fn of(field: &Field) -> Kind {
        match (number(field), field) {
            (Some(_), _) => Kind::Numbers(Vec::new()),
            (None, Field::Str(_)) => Kind::Texts(Vec::new()),
            (None, Field::ListInternal(list)) if (1..=LONGEST_LIST).contains(&list.len()) => {
                Kind::Lists(list.len(), Vec::new())
            }
            _ => Kind::Other,
        }
    }
}

impl Cells {
    fn add(&mut self, field: &Field, row: usize) {
        let is_known = match (&mut self.kind, field) {
            (Kind::Numbers(all), field) => number(field).map(|x| all.push(x)).is_some(),
            (Kind::Texts(all), Field::Str(text)) => {
                all.push(text.clone());
                true
            }
            (Kind::Lists(length, all), Field::ListInternal(list)) if list.len() == *length => {
                all.extend(list.elements().iter().filter_map(number));
                all.len() == (row + 1) * *length
            }
            (Kind::Lists(length, all), Field::Null) => {
                all.extend(std::iter::repeat_n(f64::NAN, *length));
                true
            }
            _ => false,
        };
        self.rows += 1;
        if !is_known || self.rows != row + 1 {
            self.kind = Kind::Other;
        }
    }

    fn finish(self, rows: usize) -> Option<Values> {
        match self.kind {
            _ if self.rows != rows => None,
            Kind::Numbers(all) => Some(Values::Numbers(all)),
            Kind::Lists(length, flat) => Some(Values::Lists { length, names: Vec::new(), flat }),
            Kind::Texts(all) => Some(Values::Texts(all)),
            Kind::Other => None,
        }
    }
}

/// A cell as a number; an empty one is none, and a time is its seconds.
fn number(field: &Field) -> Option<f64> {
    Some(match field {
        Field::Null => f64::NAN,
        Field::Bool(x) => f64::from(u8::from(*x)),
        Field::Byte(x) => f64::from(*x),
        Field::Short(x) => f64::from(*x),
        Field::Int(x) => f64::from(*x),
        Field::Long(x) => *x as f64,
        Field::UByte(x) => f64::from(*x),
        Field::UShort(x) => f64::from(*x),
        Field::UInt(x) => f64::from(*x),
        Field::ULong(x) => *x as f64,
        Field::Float16(x) => x.to_f64(),
        Field::Float(x) => f64::from(*x),
        Field::Double(x) => *x,
        Field::TimestampMillis(x) => *x as f64 * 1e-3,
        Field::TimestampMicros(x) => *x as f64 * 1e-6,
        _ => return None,
    })
}
