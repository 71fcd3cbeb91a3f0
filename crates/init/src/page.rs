//! A TOML file for people: every line with its reason.

use armcal_core::printable_name;
use std::fmt::Write as _;
use std::path::Path;

/// Reasons begin in this column, where the line leaves room.
const COLUMN: usize = 41;

/// A file that is being written.
#[derive(Default)]
pub struct Page(String);

impl Page {
    /// A comment of its own.
    pub fn note(&mut self, text: &str) {
        let _ = writeln!(self.0, "# {}", printable_name(text));
    }

    /// A table's heading, after an empty line.
    pub fn section(&mut self, heading: &str) {
        let _ = writeln!(self.0, "\n{heading}");
    }

    /// A line and its reason.
    pub fn line(&mut self, toml: &str, why: &str) {
        let why = printable_name(why);
        let _ = match why.is_empty() {
            true => writeln!(self.0, "{toml}"),
            false => writeln!(self.0, "{toml:<width$}# {why}", width = COLUMN.max(toml.chars().count() + 1)),
        };
    }

    /// The whole text.
    pub fn text(self) -> String {
        self.0
    }
}

/// A TOML string.
pub fn toml_string(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

/// A TOML list of strings.
pub fn toml_list<S: AsRef<str>>(texts: &[S]) -> String {
    let all: Vec<String> = texts.iter().map(|t| toml_string(t.as_ref())).collect();
    format!("[{}]", all.join(", "))
}

/// A path as a pipeline in `folder` names it.
pub fn toml_path(path: &Path, folder: &Path) -> String {
    let given = path.to_string_lossy();
    if armcal_recording::is_url(path) {
        return toml_string(&given);
    }
    let absolute = |p: &Path| std::path::absolute(p).ok();
    let found =
        absolute(path).zip(absolute(folder)).and_then(|(path, folder)| pathdiff::diff_paths(path, folder));
    toml_string(&found.unwrap_or_else(|| path.to_owned()).to_string_lossy())
}

/// A number with so many decimals, none of them idle zeros.
pub fn toml_float(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let text = text.trim_end_matches('0');
    let text = if text.ends_with('.') { format!("{text}0") } else { text.to_owned() };
    if text == "-0.0" { "0.0".to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whatever_a_recording_calls_things_the_file_stays_toml() {
        let mut page = Page::default();
        let evil = "a\"b\\c\nnames = [1]\u{1b}";
        page.note(evil);
        page.section("[t]");
        page.line(&format!("topic = {}", toml_string(evil)), evil);
        page.line(&format!("names = {}", toml_list(&[evil, "x"])), "");
        let text = page.text();
        let table: toml::Table = text.parse().unwrap_or_else(|e| panic!("{e}\n{text}"));
        assert_eq!(table["t"]["topic"].as_str(), Some(evil));
        assert_eq!(table["t"]["names"].as_array().map(Vec::len), Some(2));
        assert!(!text.contains('\u{1b}'), "{text:?}");
    }

    #[test]
    fn numbers_are_toml_floats() {
        let shown =
            [(11.7, 1), (0.0, 3), (-0.0001, 2), (49.948_4, 2), (1.0, 1)].map(|(v, d)| toml_float(v, d));
        assert_eq!(shown, ["11.7", "0.0", "0.0", "49.95", "1.0"]);
    }
}
