//! Recordings named by URL: `s3://bucket/key`, beside paths of local files.
//!
//! A URL travels through pipelines as a path like any other; only [`resolve_path`] and opening look at which it is. Object
//! storage itself is in `object`, compiled with the feature `s3`.

use crate::RecordingError;
#[cfg(not(feature = "s3"))]
use crate::no_object as object;
#[cfg(feature = "s3")]
use crate::object;
use crate::ranges::Ranged;
use std::path::{Path, PathBuf};

/// Whether a path is a URL, such as `s3://bucket/key`.
pub fn is_url(path: &Path) -> bool {
    path.to_string_lossy().split_once("://").is_some_and(|(scheme, _)| {
        let word = |c: char| c.is_ascii_alphanumeric() || matches!(c, '+' | '-' | '.');
        scheme.starts_with(|c: char| c.is_ascii_alphabetic()) && scheme.chars().all(word)
    })
}

/// A path written in a file of `folder`: relative ones start there, URLs and absolute ones stay.
pub fn resolve_path(folder: &Path, path: &Path) -> PathBuf {
    if is_url(path) { path.to_owned() } else { folder.join(path) }
}

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

/// A bucket and what is in it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Location {
    pub bucket: String,
    pub key: String,
}

impl Location {
    pub fn parse(url: &str) -> Result<Location, RecordingError> {
        let Some(rest) = url.strip_prefix("s3://") else {
            return Err(url_error(url, "only s3:// URLs can be read"));
        };
        match rest.split_once('/') {
            Some((bucket, key)) if !bucket.is_empty() && !key.is_empty() => {
                Ok(Location { bucket: bucket.to_owned(), key: key.to_owned() })
            }
            _ => Err(url_error(url, "it must be s3://BUCKET/KEY")),
        }
    }
}

fn url_error(url: &str, why: &str) -> RecordingError {
    RecordingError::Object { url: url.to_owned(), why: why.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn urls_stay_and_paths_start_in_their_folder() {
        let resolved = |path: &str| resolve_path(Path::new("/lab"), Path::new(path));
        assert_eq!(resolved("s3://bucket/a b/c.mcap").as_os_str(), "s3://bucket/a b/c.mcap");
        assert_eq!(resolved("day/c.mcap"), Path::new("/lab/day/c.mcap"));
        assert_eq!(resolved("/data/c.mcap"), Path::new("/data/c.mcap"));
        assert!(!is_url(Path::new("odd://name/but a file".trim_start_matches("odd"))));
        assert_eq!(Path::new("s3://bucket/day/arm.mcap").file_stem(), Some("arm".as_ref()));
    }

    #[test]
    fn what_is_no_object_is_said() {
        let why = |url: &str| Location::parse(url).expect_err("refused").to_string();
        assert!(why("gs://bucket/key").contains("only s3://"));
        for url in ["s3://", "s3://bucket", "s3://bucket/", "s3:///key"] {
            assert!(why(url).contains("s3://BUCKET/KEY"), "{url}");
        }
        let location = Location::parse("s3://bucket/a/b.mcap").expect("an object");
        assert_eq!(location, Location { bucket: "bucket".into(), key: "a/b.mcap".into() });
    }
}
