//! Objects by their URL, where the program can read them.

use crate::RecordingError;
#[cfg(not(feature = "s3"))]
use crate::bytes::no_object as object;
#[cfg(feature = "s3")]
use crate::bytes::object;
use crate::bytes::ranges::Ranged;
use crate::bytes::url::{Location, url_error};
use std::path::Path;

/// The objects that match a URL with wildcards, such as `s3://bucket/2026/*/arm-?.mcap`, sorted. `*` and `?` stay within
/// one part of the key, `**` goes across parts; `[abc]` is one of these letters.
///
/// # Errors
/// A URL that is none, a bucket that does not exist or cannot be listed, a store that does not answer.
pub fn list_objects(url: &str) -> Result<Vec<String>, RecordingError> {
    let Location { bucket, key } = Location::parse(url)?;
    let pattern =
        glob::Pattern::new(&key).map_err(|e| url_error(url, &format!("its wildcards are wrong: {e}")))?;
    let options = glob::MatchOptions { require_literal_separator: true, ..glob::MatchOptions::new() };
    // Everything before the first part with a wildcard is a folder that the store can look in by itself.
    let fixed: Vec<&str> = key.split('/').take_while(|part| !part.contains(['*', '?', '['])).collect();
    let folder = if fixed.len() == key.split('/').count() { &fixed[..fixed.len() - 1] } else { &fixed };
    let mut keys = object::keys(url, &bucket, &folder.join("/"))?;
    keys.retain(|key| pattern.matches_with(key, options));
    keys.sort();
    Ok(keys.into_iter().map(|key| format!("s3://{bucket}/{key}")).collect())
}

/// Opens an object.
pub(crate) fn open(path: &Path) -> Result<Ranged, RecordingError> {
    let url = path.to_string_lossy();
    let location = Location::parse(&url)?;
    object::open(&url, &location)
}
