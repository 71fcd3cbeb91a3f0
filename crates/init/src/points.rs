//! What a laser tracker exported beside the recordings, as the `points` of a pipeline: what its header says, and what it does not.

use crate::error::InitError;
use armcal_config::read_text;
use armcal_recording::LengthUnit;
use armcal_recording::input::Kind;
use armcal_stages::points::rows::{is_axis, parse};
use std::path::{Path, PathBuf};

/// Words in the names of columns that may be times.
const TIMES: [&str; 3] = ["time", "date", "stamp"];

/// A file of points.
pub struct Points {
    /// The file.
    pub path: PathBuf,
    /// How many rows it has.
    pub rows: usize,
    /// Unit of its coordinates, if the header says it.
    pub unit: Option<LengthUnit>,
    /// The column of its times.
    pub time: Option<String>,
    /// Columns that are called times and cannot be read as such, and why.
    pub unread: Vec<(String, String)>,
}

/// Looks into a file.
pub fn inspect_file(path: &Path) -> Result<Points, InitError> {
    let text = read_text("CSV of points", Kind::Data, path)?;
    let bad = |problem: String| InitError::Init { problem: format!("{}: {problem}", path.display()) };
    let table = parse(&text, 1.0, None).map_err(bad)?;
    let unit = header_unit(&table.header).map_err(bad)?;
    let (mut time, mut unread) = (None, Vec::new());
    for name in &table.header {
        let called = name.to_lowercase();
        if time.is_some() || !TIMES.iter().any(|word| called.contains(word)) {
            continue;
        }
        let name = name.trim_matches('"').to_owned();
        match parse(&text, 1.0, Some(&name)) {
            Ok(_) => time = Some(name),
            Err(why) => unread.push((name, why)),
        }
    }
    Ok(Points { path: path.to_owned(), rows: table.rows.len(), unit, time, unread })
}

/// The unit that the names of the coordinates carry; none where they carry none, or there are no names.
fn header_unit(header: &[String]) -> Result<Option<LengthUnit>, String> {
    let mut units = Vec::new();
    for axis in ["x", "y", "z"] {
        let Some(name) = header.iter().find(|name| is_axis(name, axis)) else { continue };
        let called = name.trim_matches('"').to_lowercase();
        let words = called.split(|c: char| !c.is_alphanumeric()).skip(1).find(|word| !word.is_empty());
        units.push(match words {
            None => None,
            Some("mm" | "millimeter" | "millimeters" | "millimetre" | "millimetres") => Some(LengthUnit::Mm),
            Some("m" | "meter" | "meters" | "metre" | "metres") => Some(LengthUnit::M),
            Some(other) => {
                return Err(format!("`{name}` is in `{other}`: export it in mm or in m, which are read"));
            }
        });
    }
    match units.as_slice() {
        [] => Ok(None),
        [first, rest @ ..] if rest.iter().all(|unit| unit == first) => Ok(*first),
        _ => Err("x, y and z have different units in the header: export them in one".to_owned()),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may stop")]
mod tests {
    use super::*;

    #[test]
    fn a_unit_is_what_the_names_of_all_three_coordinates_say() {
        let unit = |text: &str| header_unit(&text.split(',').map(str::to_owned).collect::<Vec<_>>());
        for text in ["Name,X [mm],Y [mm],Z [mm]", "z_mm,y_mm,x_mm", "X(mm),Y(mm),Z(mm)", "\"X/mm\",Y/mm,Z/mm"]
        {
            assert_eq!(unit(text).unwrap(), Some(LengthUnit::Mm), "{text}");
        }
        assert_eq!(unit("x [m],y [m],z [m]").unwrap(), Some(LengthUnit::M));
        assert_eq!(unit("x,y,z").unwrap(), None);
        assert_eq!(unit("").unwrap(), None);
        assert!(unit("X [in],Y [in],Z [in]").unwrap_err().contains("`in`"));
        assert!(unit("X [mm],Y [mm],Z").unwrap_err().contains("different units"));
    }
}
