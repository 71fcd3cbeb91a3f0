//! Tables of text: parted by commas, semicolons, tabs or blanks, with a header or without.

use super::{Column, Table, Values};
use std::collections::BTreeSet;

/// Rows that are told by their numbers.
const TOLD: usize = 5;
/// A column of which fewer cells are no numbers is one of numbers, and those are lost.
const FEW_ODD: f64 = 0.1;

pub(super) fn read(bytes: &[u8]) -> Result<Table, String> {
    let text = std::str::from_utf8(bytes)
        .map_err(|e| format!("it is no text in UTF-8 from byte {} on: save it as UTF-8", e.valid_up_to()))?;
    let text = text.trim_start_matches('\u{feff}');
    let head =
        text.lines().find(|line| !line.trim().is_empty() && !line.starts_with('#')).unwrap_or_default();
    let delimiter = [b'\t', b';', b','].into_iter().find(|d| head.contains(char::from(*d))).unwrap_or(b' ');
    let mut reader = csv::ReaderBuilder::new();
    reader.trim(csv::Trim::All).comment(Some(b'#')).has_headers(false).flexible(true).delimiter(delimiter);
    // Blanks line numbers up: several of them part two numbers.
    let single: String;
    let text = match delimiter {
        b' ' => {
            single =
                text.lines().map(|l| l.split_whitespace().collect::<Vec<_>>().join(" ") + "\n").collect();
            &single
        }
        _ => text,
    };
    let (mut rows, mut lines): (Vec<Vec<String>>, Vec<u64>) = (Vec::new(), Vec::new());
    let (mut header, mut odd): (Option<Vec<String>>, Vec<u64>) = (None, Vec::new());
    for record in reader.from_reader(text.as_bytes()).into_records() {
        let record = record.map_err(|e| e.to_string())?;
        let line = record.position().map_or(0, csv::Position::line);
        let row: Vec<String> = record.iter().map(str::to_owned).collect();
        let width = header.as_ref().map_or(row.len(), Vec::len);
        let is_row = match &header {
            None if row.iter().all(|cell| number(cell, delimiter).is_some()) => {
                header = Some((1..=row.len()).map(|k| format!("column_{k}")).collect());
                true
            }
            None => {
                header = Some(row.clone());
                false
            }
            Some(_) if row.iter().all(String::is_empty) => false,
            Some(_) if row.len() != width => {
                odd.push(line);
                false
            }
            Some(_) => true,
        };
        if is_row {
            rows.push(row);
            lines.push(line);
        }
    }
    let header = unique(header.unwrap_or_default());
    let mut table = Table::default();
    if !odd.is_empty() {
        let (n, columns) = (odd.len(), header.len());
        let why = format!(
            "{n} rows have more or fewer cells than the {columns} columns and are not used: {}",
            told(&odd)
        );
        table.losses.push(why);
    }
    for (k, name) in header.into_iter().enumerate() {
        let cells = || rows.iter().map(|row| row[k].as_str());
        let is_number = |cell: &str| is_empty(cell) || number(cell, delimiter).is_some();
        let odd: Vec<u64> =
            cells().zip(&lines).filter(|(c, _)| !is_number(c)).map(|(_, line)| *line).collect();
        let name = name.trim_matches('"').to_owned();
        let values = match (odd.len() as f64) < FEW_ODD * rows.len() as f64 {
            true => Values::Numbers(cells().map(|c| number(c, delimiter).unwrap_or(f64::NAN)).collect()),
            false => Values::Texts(cells().map(str::to_owned).collect()),
        };
        if let (Values::Numbers(_), n @ 1..) = (&values, odd.len()) {
            table.losses.push(format!("{n} cells of column {name} are no numbers: {}", told(&odd)));
        }
        table.columns.push(Column { name, values });
    }
    Ok(table)
}

/// The first of some lines, in words.
fn told(lines: &[u64]) -> String {
    let first: Vec<String> = lines.iter().take(TOLD).map(u64::to_string).collect();
    let more = if lines.len() > TOLD { ", .." } else { "" };
    format!("line {}{more}", first.join(", "))
}

fn is_empty(cell: &str) -> bool {
    ["", "-", "na", "n/a", "null", "none"].contains(&cell.to_lowercase().as_str())
}

/// A number, with a decimal comma where commas part nothing.
fn number(cell: &str, delimiter: u8) -> Option<f64> {
    match delimiter {
        b',' => cell.parse().ok(),
        _ => cell.parse().ok().or_else(|| cell.replace(',', ".").parse().ok()),
    }
}

/// Names, each once.
fn unique(names: Vec<String>) -> Vec<String> {
    let mut taken = BTreeSet::new();
    let once = |(k, name): (usize, String)| {
        let name = if name.is_empty() { format!("column_{}", k + 1) } else { name };
        let name = if taken.contains(&name) { format!("{name}_{}", k + 1) } else { name };
        taken.insert(name.clone());
        name
    };
    names.into_iter().enumerate().map(once).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(table: &Table, column: usize) -> Vec<f64> {
        match &table.columns[column].values {
            Values::Numbers(values) => values.clone(),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn what_people_save_as_csv_is_read() {
        for text in [
            "q1,x [mm]\n0.5,-200\n1.5,30.5\n",
            "# made by hand\nq1;x [mm]\n0,5;-200\n1,5;30,5\n",
            "\u{feff}\"q1\"\t\"x [mm]\"\r\n0.5\t-200\r\n1.5\t30.5\r\n\r\n",
        ] {
            let table = read(text.as_bytes()).expect("a table");
            assert_eq!(
                (numbers(&table, 0), numbers(&table, 1)),
                (vec![0.5, 1.5], vec![-200.0, 30.5]),
                "{text}"
            );
            assert_eq!(table.columns[1].name, "x [mm]");
            assert!(table.losses.is_empty(), "{text}: {:?}", table.losses);
        }
        let plain = read(b"  0.5   -2e1\n 1.5  3\n").expect("a table");
        assert_eq!((numbers(&plain, 1), plain.columns[1].name.as_str()), (vec![-20.0, 3.0], "column_2"));
    }

    #[test]
    fn rows_that_are_too_short_are_lost_by_their_lines_and_empty_cells_are_no_numbers() {
        let table = read(b"a,b,name\n1,2,p\n1\n,4,q\n").expect("a table");
        assert_eq!(table.rows(), 2);
        assert!(numbers(&table, 0)[1].is_nan());
        assert_eq!(table.columns[2].values, Values::Texts(vec!["p".into(), "q".into()]));
        assert!(table.losses[0].contains("line 3"), "{:?}", table.losses);
        assert!(read(b"\xff\xfe").is_err_and(|why| why.contains("UTF-8")));
        // A cell that is no number among many that are costs itself, aloud.
        let text: String =
            (0..30).map(|i| if i == 7 { "0.5x,1\n".to_owned() } else { format!("0.5,{i}\n") }).collect();
        let table = read(format!("q1,q2\n{text}").as_bytes()).expect("a table");
        assert!(numbers(&table, 0)[7].is_nan() && numbers(&table, 1)[7] == 1.0);
        assert_eq!(table.losses, ["1 cells of column q1 are no numbers: line 9"]);
    }
}
