//! Kinds that a program adds to those of armcal: effects, measurements. One process has one list of each.

use crate::ModelError;
use std::sync::OnceLock;

/// Makes `all` of `ours` and what is added.
///
/// # Errors
/// The list is in use already; a name that no file could have, or that there is already.
pub(crate) fn register<K>(
    all: &OnceLock<Vec<&'static K>>,
    ours: &[&'static K],
    added: &[&'static K],
    name: fn(&K) -> &'static str,
) -> Result<(), ModelError> {
    let refused =
        |name: &str, problem: &'static str| Err(ModelError::NotRegistered { name: name.to_owned(), problem });
    let mut known = ours.to_vec();
    for &kind in added {
        let own = name(kind);
        let is_plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
        if own.is_empty() || !own.chars().all(is_plain) {
            return refused(own, "a name has small letters, digits and underscores");
        }
        if known.iter().any(|other| name(other) == own) {
            return refused(own, "there is one of that name already");
        }
        known.push(kind);
    }
    let Err(_) = all.set(known) else { return Ok(()) };
    refused(
        added.first().map_or("", |kind| name(kind)),
        "the list is in use already; register before a model is read",
    )
}
