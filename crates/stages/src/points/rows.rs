//! The rows of a tracker's CSV file.

use super::clock;
use nalgebra::Vector3;

/// A row.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Its line in the file, from 1.
    pub line: u64,
    /// The point [m]; none for a dwell that was not measured.
    pub point_m: Option<Vector3<f64>>,
    /// When it was measured, since the first row with a point [ns]; zero in files without times.
    pub time_ns: i64,
}

/// The file.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Names of its columns; none without a header.
    pub header: Vec<String>,
    /// Its rows.
    pub rows: Vec<Row>,
    /// The time of the first row with a point as it is written, where a column of times was asked for.
    pub began: Option<String>,
}

/// Reads x, y, z by the header, or the last three of three or four columns, and the column of times.
pub fn parse(text: &str, to_m: f64, time: Option<&str>) -> Result<Table, String> {
    let head = text.lines().find(|l| !l.trim().is_empty() && !l.starts_with('#')).unwrap_or_default();
    let delimiter = [b'\t', b';', b','].into_iter().find(|d| head.contains(*d as char)).unwrap_or(b',');
    let mut reader = csv::ReaderBuilder::new();
    reader.trim(csv::Trim::All).comment(Some(b'#')).has_headers(false).flexible(true).delimiter(delimiter);
    let mut table = Table { header: Vec::new(), rows: Vec::new(), began: None };
    let mut columns: Option<([usize; 3], Option<usize>)> = None;
    let mut times = Vec::new();
    for record in reader.from_reader(text.as_bytes()).into_records() {
        let record = record.map_err(|e| e.to_string())?;
        let line = record.position().map_or(0, csv::Position::line);
        let number = |column: usize| {
            let text = record.get(column).unwrap_or_default();
            // A decimal comma where commas part nothing.
            let text = if delimiter == b',' { text.to_owned() } else { text.replace(',', ".") };
            text.parse::<f64>().ok().filter(|x| x.is_finite())
        };
        let (at, time_at) = match columns {
            Some(columns) => columns,
            None => {
                let named = |axis: &str| record.iter().position(|name| is_axis(name, axis));
                let last = record.len().checked_sub(3).filter(|_| record.len() < 5);
                let (at, is_header) = match (named("x"), named("y"), named("z"), last) {
                    (Some(x), Some(y), Some(z), _) => ([x, y, z], true),
                    (.., Some(last)) if number(last + 1).is_some() => ([last, last + 1, last + 2], false),
                    _ => {
                        return Err(format!(
                            "line {line}: a header with the columns x, y, z is missing (name, x, y, z do without)"
                        ));
                    }
                };
                if is_header {
                    table.header = record.iter().map(str::to_owned).collect();
                }
                let time_at = time.map(|time| column_index(&table.header, time)).transpose()?;
                columns = Some((at, time_at));
                if is_header {
                    continue;
                }
                (at, time_at)
            }
        };
        let is_empty = at.iter().all(|c| ["", "-"].contains(&record.get(*c).unwrap_or_default()));
        let point_m = match (is_empty, at.map(number)) {
            (true, _) => None,
            (false, [Some(x), Some(y), Some(z)]) => Some(Vector3::new(x, y, z) * to_m),
            _ => {
                let read: Vec<&str> = at.iter().map(|c| record.get(*c).unwrap_or_default()).collect();
                return Err(format!("line {line}: `{}` are no three numbers", read.join(" ")));
            }
        };
        if let (Some(column), false) = (time_at, is_empty) {
            times.push((line, record.get(column).unwrap_or_default().to_owned()));
        }
        table.rows.push(Row { line, point_m, time_ns: 0 });
    }
    if table.rows.iter().all(|row| row.point_m.is_none()) {
        return Err("there is no point in it".to_owned());
    }
    if time.is_some() {
        let times: Vec<(u64, &str)> = times.iter().map(|(line, text)| (*line, text.as_str())).collect();
        let since_ns = clock::parse_times(&times)?;
        table.began = times.first().map(|(_, text)| (*text).to_owned());
        let with_point = table.rows.iter_mut().filter(|row| row.point_m.is_some());
        with_point.zip(since_ns).for_each(|(row, time_ns)| row.time_ns = time_ns);
    }
    Ok(table)
}

/// Which column has a name.
fn column_index(header: &[String], name: &str) -> Result<usize, String> {
    let found = header.iter().position(|column| column.trim_matches('"').eq_ignore_ascii_case(name.trim()));
    found.ok_or_else(|| match header.is_empty() {
        true => format!("it has no header, so no column is called `{name}`"),
        false => format!("no column is called `{name}`; there are {}", header.join(", ")),
    })
}

/// `X`, `x_mm`, `X [mm]`, `X(mm)`.
pub fn is_axis(name: &str, axis: &str) -> bool {
    let plain = name.trim_matches('"').to_lowercase();
    plain.split(['_', ' ', '[', '(', '/']).next() == Some(axis)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may stop")]
mod tests {
    use super::*;

    #[test]
    fn what_trackers_export_is_read_and_what_is_wrong_is_told_by_its_line() {
        let expected = [Some(Vector3::new(1.0, -0.2, 0.0305)), None];
        for text in [
            "Name,X [mm],Y [mm],Z [mm]\nP1,1000,-200,30.5\nP2,,,\n",
            "# exported\nP1, 1000.0, -200.0, 30.5\nP2, -, -, -\n",
            "1000;-200;30,5\n;;\n",
            "time\tz_mm\ty_mm\tx_mm\n9:01\t30.5\t-200\t1e3\n9:02\t\t\t\n",
        ] {
            let read: Vec<_> = parse(text, 1e-3, None).unwrap().rows.iter().map(|row| row.point_m).collect();
            assert_eq!(read, expected, "{text}");
        }
        for (text, words) in [
            ("a,b,c,d,e\n1,2,3,4,5\n", "line 1: a header"),
            ("x,y,z\n1,2,3\n1,2\n", "line 3: `1 2 ` are no three"),
            ("x,y,z\n1,2,nan\n", "line 2"),
            ("x,y,z\n", "no point"),
            ("", "no point"),
        ] {
            let said = parse(text, 1e-3, None).unwrap_err();
            assert!(said.contains(words), "{text}: {said}");
        }
        let timed = "At;X;Y;Z\n12,25;1;2;3\nlost;;;\n9,5;1;2;3\n";
        let read = parse(timed, 1.0, Some("at")).unwrap();
        assert_eq!(read.began.as_deref(), Some("12,25"));
        assert_eq!(read.rows.iter().map(|row| row.time_ns).collect::<Vec<_>>(), [0, 0, -2_750_000_000]);
        for (text, words) in [
            (timed, "no column is called `when`; there are At, X, Y, Z"),
            ("1,2,3\n", "it has no header"),
            ("when,x,y,z\n,1,2,3\n", "line 2: `` is no time"),
        ] {
            let said = parse(text, 1.0, Some("when")).unwrap_err();
            assert!(said.contains(words), "{text}: {said}");
        }
    }
}
