//! Unknown keys with the nearest known one, before serde gets to see the file.

use crate::TableError;
use std::path::Path;

/// Checks that `table` has only `known` keys. `place` names the table in messages, such as `mechanism`.
pub(crate) fn check_keys(
    table: &toml::Table,
    known: &[&str],
    place: &str,
    path: &Path,
) -> Result<(), TableError> {
    match table.keys().find(|key| !known.contains(&key.as_str())) {
        None => Ok(()),
        Some(key) => Err(TableError::UnknownKey {
            path: path.to_path_buf(),
            key: if place.is_empty() { key.clone() } else { format!("{place}.{key}") },
            suggestion: nearest_key(key, known).map(str::to_owned),
            known: known.join(", "),
        }),
    }
}

/// The candidate most like `word`, if it is similar enough to be a typing error.
pub(crate) fn nearest_key<'a>(word: &str, candidates: &[&'a str]) -> Option<&'a str> {
    candidates
        .iter()
        .map(|&c| (strsim::jaro_winkler(word, c), c))
        .filter(|(similarity, _)| *similarity > 0.7)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, c)| c)
}
