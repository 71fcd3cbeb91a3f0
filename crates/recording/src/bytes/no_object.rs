//! What stands in for object storage where it was not built in: errors that say how to get it. Tests see it in every
//! build.

use crate::RecordingError;
use crate::bytes::ranges::Ranged;
use crate::bytes::url::Location;

/// In the place of opening an object.
pub(crate) fn open(url: &str, location: &Location) -> Result<Ranged, RecordingError> {
    Err(without_storage(url, &location.bucket))
}

/// In the place of listing a bucket.
pub(crate) fn keys(url: &str, bucket: &str, _: &str) -> Result<Vec<String>, RecordingError> {
    Err(without_storage(url, bucket))
}

fn without_storage(url: &str, bucket: &str) -> RecordingError {
    let why = format!(
        "this armcal was built without object storage and cannot reach bucket {bucket:?}; build it with \
         `cargo install --path crates/armcal --features s3`"
    );
    RecordingError::Object { url: url.to_owned(), why }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_the_feature_the_way_to_it_is_named() {
        let url = "s3://bucket/key.mcap";
        let location = Location::parse(url).expect("an object");
        let errors = [open(url, &location).err(), keys(url, "bucket", "").err()];
        for said in errors.map(|e| e.expect("refused").to_string()) {
            assert!(said.contains("--features s3") && said.contains("\"bucket\""), "{said}");
        }
    }
}
