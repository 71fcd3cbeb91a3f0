//! Recordings named by URL: `s3://bucket/key`, beside paths of local files.
//!
//! A URL travels through pipelines as a path like any other; only [`resolve_path`] and opening look at which it is. Object
//! storage itself is in `object`, compiled with the feature `s3`.

use crate::RecordingError;
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

pub(crate) fn url_error(url: &str, why: &str) -> RecordingError {
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
