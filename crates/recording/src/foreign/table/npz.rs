//! Tables in NumPy's `.npz`: arrays whose first dimension are the rows.
//!
//! Format: NEP 1 (`.npy` 1.0 to 3.0) in a ZIP archive.

use super::{Column, LONGEST_LIST, Table, Values};
use crate::bytes::budget::Allowance;
use crate::structure::chunk::stream_into;
use std::collections::BTreeMap;
use std::io::Cursor;

const MAGIC: &[u8] = b"\x93NUMPY";
/// Of the head of an array [bytes].
const MOST_HEAD_BYTES: usize = 1 << 16;

pub(super) fn read(bytes: &[u8], allowance: &Allowance) -> Result<Table, String> {
    let no_archive = |e: zip::result::ZipError| format!("it is no archive of NumPy arrays: {e}");
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).map_err(no_archive)?;
    let (mut arrays, mut table) = (Vec::new(), Table::default());
    for at in 0..archive.len() {
        let mut file = archive.by_index(at).map_err(no_archive)?;
        let name = file.name().map_err(no_archive)?.trim_end_matches(".npy").to_owned();
        if !allowance.admits(file.compressed_size(), file.size()) {
            return Err(allowance.refusal());
        }
        let mut inflated = Vec::new();
        let size = file.size() as usize;
        stream_into(&mut inflated, &mut file, size).map_err(|why| format!("array {name}: {why}"))?;
        match array(&inflated) {
            Ok(array) => arrays.push((name, array)),
            Err(why) => table.notes.push(format!("array {name} is not used: {why}")),
        }
    }
    // As many rows as most arrays have.
    let mut lengths: BTreeMap<usize, usize> = BTreeMap::new();
    arrays.iter().for_each(|(_, array)| *lengths.entry(array.shape[0]).or_default() += 1);
    let rows =
        lengths.into_iter().max_by_key(|(length, arrays)| (*arrays, *length)).map_or(0, |(length, _)| length);
    for (name, Array { shape, flat }) in arrays {
        let length: usize = shape[1..].iter().product();
        if shape[0] != rows || length == 0 || length > LONGEST_LIST {
            table.notes.push(format!("array {name} of shape {shape:?} has not a few numbers for each of {rows} rows, and is not used"));
        } else if shape.len() == 1 {
            table.columns.push(Column { name, values: Values::Numbers(flat) });
        } else {
            table.columns.push(Column { name, values: Values::Lists { length, names: Vec::new(), flat } });
        }
    }
    Ok(table)
}

/// An array of numbers, row by row.
#[derive(Debug, PartialEq)]
struct Array {
    shape: Vec<usize>,
    flat: Vec<f64>,
}

fn array(bytes: &[u8]) -> Result<Array, String> {
    let cut = || "it is cut off".to_owned();
    let rest = bytes.strip_prefix(MAGIC).ok_or("it is no NumPy array")?;
    let (version, rest) = rest.split_first_chunk::<2>().ok_or_else(cut)?;
    let (length, rest) = match version[0] {
        1 => rest.split_first_chunk::<2>().map(|(l, rest)| (usize::from(u16::from_le_bytes(*l)), rest)),
        _ => rest.split_first_chunk::<4>().map(|(l, rest)| (u32::from_le_bytes(*l) as usize, rest)),
    }
    .ok_or_else(cut)?;
    let (head, data) = rest.split_at_checked(length).filter(|_| length <= MOST_HEAD_BYTES).ok_or_else(cut)?;
    let head = std::str::from_utf8(head).map_err(|_| "its head is no text")?;
    let kind = value_of(head, "descr").map(|v| v.trim_matches(['\'', '"'])).ok_or("its head has no type")?;
    let by_columns = value_of(head, "fortran_order") == Some("True");
    let shape = value_of(head, "shape").ok_or("its head has no shape")?;
    let shape: Vec<usize> = shape
        .trim_matches(['(', ')'])
        .split(',')
        .map(str::trim)
        .filter(|n| !n.is_empty())
        .map(|n| n.parse().map_err(|_| format!("its shape holds {n}")))
        .collect::<Result<_, _>>()?;
    if shape.is_empty() {
        return Err("it is a single value".to_owned());
    }
    let size = shape.iter().try_fold(1_usize, |all, n| all.checked_mul(*n)).ok_or_else(cut)?;
    let numbers = numbers(kind, data)?;
    if numbers.len() != size {
        return Err(format!("its shape {shape:?} takes {size} numbers, {} are there", numbers.len()));
    }
    let flat = if by_columns { by_rows(&numbers, &shape) } else { numbers };
    Ok(Array { shape, flat })
}

/// The value behind a key of a Python dictionary of texts, truths and tuples.
fn value_of<'h>(head: &'h str, key: &str) -> Option<&'h str> {
    let at = head.find(&format!("'{key}'"))? + key.len() + 2;
    let value = head[at..].trim_start().strip_prefix(':')?.trim_start();
    let end = match value.chars().next()? {
        '(' => value.find(')')? + 1,
        quote @ ('\'' | '"') => value[1..].find(quote)? + 2,
        _ => value.find([',', '}'])?,
    };
    Some(value[..end].trim())
}

fn numbers(kind: &str, data: &[u8]) -> Result<Vec<f64>, String> {
    macro_rules! of {
        ($t:ty, $convert:expr) => {{
            let each = data.chunks_exact(size_of::<$t>());
            let big = kind.starts_with('>');
            let number = |bytes: &[u8]| {
                let bytes = bytes.try_into().unwrap_or_default();
                let convert: fn($t) -> f64 = $convert;
                convert(if big { <$t>::from_be_bytes(bytes) } else { <$t>::from_le_bytes(bytes) })
            };
            each.map(number).collect()
        }};
    }
    Ok(match kind.trim_start_matches(['<', '>', '|', '=']) {
        "f8" => of!(f64, |x| x),
        "f4" => of!(f32, f64::from),
        "i8" => of!(i64, |x| x as f64),
        "i4" => of!(i32, f64::from),
        "i2" => of!(i16, f64::from),
        "i1" => of!(i8, f64::from),
        "u8" => of!(u64, |x| x as f64),
        "u4" => of!(u32, f64::from),
        "u2" => of!(u16, f64::from),
        "u1" | "b1" => of!(u8, f64::from),
        _ => return Err(format!("its type {kind} is no number")),
    })
}

/// Numbers that are stored column by column, row by row.
fn by_rows(stored: &[f64], shape: &[usize]) -> Vec<f64> {
    let place = |mut at: usize| {
        let (mut index, mut stride) = (0, stored.len());
        // The last dimension changes first where rows are stored, last where columns are.
        for n in shape.iter().rev() {
            stride /= n;
            index += at % n * stride;
            at /= n;
        }
        index
    };
    (0..stored.len()).map(|at| stored[place(at)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn npy(head: &str, data: &[u8]) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        bytes.extend([1, 0]);
        bytes.extend((head.len() as u16).to_le_bytes());
        bytes.extend(head.as_bytes());
        bytes.extend(data);
        bytes
    }

    #[test]
    fn arrays_are_read_in_any_order_and_type() {
        let data: Vec<u8> = [1_f32, 2.0, 3.0, 4.0, 5.0, 6.0].iter().flat_map(|x| x.to_be_bytes()).collect();
        let rows = array(&npy("{'descr': '>f4', 'fortran_order': False, 'shape': (2, 3), }   \n", &data));
        assert_eq!(rows, Ok(Array { shape: vec![2, 3], flat: vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0] }));
        let columns = array(&npy("{'descr': '>f4', 'fortran_order': True, 'shape': (2, 3), }", &data));
        assert_eq!(columns.expect("an array").flat, [1.0, 3.0, 5.0, 2.0, 4.0, 6.0]);
        let bytes = array(&npy("{'descr': '|i1', 'fortran_order': False, 'shape': (2,), }", &[255, 3]));
        assert_eq!(bytes.expect("an array").flat, [-1.0, 3.0]);
    }

    #[test]
    fn what_is_no_array_of_numbers_is_told() {
        for (head, words) in [
            ("{'descr': '<U4', 'fortran_order': False, 'shape': (1,), }", "no number"),
            ("{'descr': '<f8', 'fortran_order': False, 'shape': (), }", "single value"),
            ("{'descr': '<f8', 'fortran_order': False, 'shape': (2,), }", "takes 2 numbers, 1"),
            ("{'descr': '<f8', 'fortran_order': False, 'shape': (4294967296, 4294967296, 2), }", "cut off"),
            ("{}", "no type"),
        ] {
            let why = array(&npy(head, &[0; 8])).expect_err(head);
            assert!(why.contains(words), "{head}: {why}");
        }
        let whole = npy("{'descr': '<f8', 'fortran_order': False, 'shape': (1,), }", &[0; 8]);
        assert!((0..whole.len()).all(|cut| array(&whole[..cut]).is_err()));
    }
}
