//! Objects of an S3-compatible store, read by range.
//!
//! The only module that knows `object_store` and an asynchronous runtime. Credentials, endpoint and region come from the
//! usual environment variables (`AWS_ACCESS_KEY_ID`, `AWS_SECRET_ACCESS_KEY`, `AWS_REGION`, `AWS_ENDPOINT_URL`,
//! `AWS_ALLOW_HTTP`, ...). Failed requests are repeated by `object_store`.

use crate::bytes::ranges::{Ranged, ReadRanges, TAIL_BYTES};
use crate::bytes::url::Location;
use crate::{ObjectIdentity, RecordingError};
use bytes::Bytes;
use futures_util::{StreamExt as _, TryStreamExt as _};
use object_store::aws::{AmazonS3, AmazonS3Builder};
use object_store::path::Path as Key;
use object_store::{
    Error, GetOptions, GetRange, GetResult, ObjectMeta, ObjectStore as _, ObjectStoreExt as _, RetryConfig,
};
use std::error::Error as _;
use std::future::Future;
use std::ops::Range;
use std::sync::OnceLock;
use std::time::Duration;
use tokio::runtime::{Builder, Handle, Runtime};

/// Requests under way at a time, for one file.
const IN_FLIGHT: usize = 8;
/// A store that does not answer is given up after so many repetitions, or this time.
const RETRIES: usize = 5;
const RETRY_FOR: Duration = Duration::from_secs(60);

/// Opens an object; one request brings its size, its identity and its end.
pub(crate) fn open(url: &str, location: &Location) -> Result<Ranged, RecordingError> {
    let failed = |why: String| RecordingError::Object { url: url.to_owned(), why };
    let store = build_store(url, &location.bucket)?;
    let key = Key::parse(&location.key).map_err(|e| failed(format!("its key cannot be used: {e}")))?;
    let options = GetOptions { range: Some(GetRange::Suffix(TAIL_BYTES)), ..GetOptions::default() };
    let tail = run_request(url, async {
        match store.get_opts(&key, options).await {
            Ok(found) => whole(found).await,
            // An empty object has no last byte to ask for.
            Err(error) => match store.head(&key).await {
                Ok(meta) if meta.size == 0 => Ok((meta, Bytes::new())),
                _ => Err(error),
            },
        }
    })?;
    let (meta, bytes) = tail.map_err(|e| failed(explain_error(&e, location)))?;
    if meta.size == 0 {
        return Err(RecordingError::NotMcap { path: url.into(), why: "the object is empty".into() });
    }
    let identity = ObjectIdentity {
        etag: meta.e_tag.clone().unwrap_or_default(),
        last_modified: meta.last_modified.to_rfc3339(),
    };
    let object = Object { url: url.to_owned(), location: location.clone(), store, key, etag: meta.e_tag };
    Ok(Ranged::new(Box::new(object), meta.size, bytes, Some(identity)))
}

/// Every key of a bucket under a folder.
pub(crate) fn keys(url: &str, bucket: &str, folder: &str) -> Result<Vec<String>, RecordingError> {
    let location = Location { bucket: bucket.to_owned(), key: folder.to_owned() };
    let failed = |why: String| RecordingError::Object { url: url.to_owned(), why };
    let store = build_store(url, bucket)?;
    let folder = Key::parse(folder).map_err(|e| failed(format!("its key cannot be used: {e}")))?;
    let found: Result<Vec<ObjectMeta>, Error> = run_request(url, store.list(Some(&folder)).try_collect())?;
    let found = found.map_err(|e| failed(explain_error(&e, &location)))?;
    Ok(found.into_iter().map(|meta| meta.location.to_string()).collect())
}

/// One object, as it was when it was opened.
struct Object {
    url: String,
    location: Location,
    store: AmazonS3,
    key: Key,
    etag: Option<String>,
}

impl ReadRanges for Object {
    fn read(&self, ranges: &[Range<u64>]) -> Result<Vec<Bytes>, RecordingError> {
        let failed = |why: String| RecordingError::Object { url: self.url.clone(), why };
        let get = |range: Range<u64>| async move {
            let options = GetOptions {
                range: Some(GetRange::Bounded(range.clone())),
                if_match: self.etag.clone(),
                ..GetOptions::default()
            };
            let (_, bytes) = whole(self.store.get_opts(&self.key, options).await?).await?;
            Ok::<_, Error>((range, bytes))
        };
        let requests = futures_util::stream::iter(ranges.iter().cloned()).map(get).buffered(IN_FLIGHT);
        let answers: Result<Vec<_>, Error> = run_request(&self.url, requests.try_collect())?;
        let answers = answers.map_err(|e| failed(explain_error(&e, &self.location)))?;
        let whole = |(range, bytes): (Range<u64>, Bytes)| {
            let wanted = range.end - range.start;
            let short = || {
                failed(format!("the store sent {} bytes instead of {wanted} at {}", bytes.len(), range.start))
            };
            if bytes.len() as u64 == wanted { Ok(bytes) } else { Err(short()) }
        };
        answers.into_iter().map(whole).collect()
    }
}

async fn whole(found: GetResult) -> Result<(ObjectMeta, Bytes), Error> {
    let meta = found.meta.clone();
    Ok((meta, found.bytes().await?))
}

fn build_store(url: &str, bucket: &str) -> Result<AmazonS3, RecordingError> {
    let retry = RetryConfig { max_retries: RETRIES, retry_timeout: RETRY_FOR, ..RetryConfig::default() };
    AmazonS3Builder::from_env().with_bucket_name(bucket).with_retry(retry).build().map_err(|e| {
        let why = format!("the store cannot be set up: {}; check the AWS_* variables", with_causes(&e));
        RecordingError::Object { url: url.to_owned(), why }
    })
}

/// Runs a request to its end on the runtime of this module.
fn run_request<F: Future + Send>(url: &str, request: F) -> Result<F::Output, RecordingError>
where
    F::Output: Send,
{
    static RUNTIME: OnceLock<Result<Runtime, String>> = OnceLock::new();
    let build = || Builder::new_current_thread().enable_all().build().map_err(|e| e.to_string());
    match RUNTIME.get_or_init(build) {
        // A thread of somebody else's runtime must not wait in ours.
        Ok(runtime) if Handle::try_current().is_ok() => std::thread::scope(|threads| {
            let waiting = threads.spawn(|| runtime.block_on(request));
            waiting.join().map_err(|panic| std::panic::resume_unwind(panic))
        }),
        Ok(runtime) => Ok(runtime.block_on(request)),
        Err(why) => {
            let why = format!("no request can be made: {why}");
            Err(RecordingError::Object { url: url.to_owned(), why })
        }
    }
}

/// What went wrong, and what to do.
fn explain_error(error: &Error, location: &Location) -> String {
    let (Location { bucket, key }, said) = (location, with_causes(error));
    let elsewhere = ["redirect without LOCATION", "PermanentRedirect", "AuthorizationHeaderMalformed"];
    match error {
        _ if elsewhere.iter().any(|word| said.contains(word)) => {
            format!("bucket {bucket:?} is in another region; set AWS_REGION to its own ({said})")
        }
        _ if said.contains("NoSuchBucket") => {
            format!("there is no bucket {bucket:?} at this endpoint; check the name and AWS_ENDPOINT_URL")
        }
        Error::NotFound { .. } => {
            format!("there is no object {key:?} in bucket {bucket:?}; look with `aws s3 ls s3://{bucket}/`")
        }
        Error::PermissionDenied { .. } | Error::Unauthenticated { .. } => format!(
            "access is denied; check that AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY may read bucket {bucket:?} \
             ({said})"
        ),
        Error::Precondition { .. } => {
            "the object was replaced while it was read; run again, now that it is complete".to_owned()
        }
        _ if said.contains("169.254.169.254") => format!(
            "there are no credentials; set AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, or \
             AWS_SKIP_SIGNATURE=true for a public bucket ({said})"
        ),
        _ if said.contains("URL scheme is not allowed") => {
            format!("set AWS_ALLOW_HTTP=true if the endpoint is meant to be without TLS ({said})")
        }
        _ => said,
    }
}

/// The message of an error and of its causes, each once, on one line.
fn with_causes(error: &Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(next) = cause {
        let said = next.to_string();
        if !text.contains(&said) {
            text = format!("{text}: {said}");
        }
        cause = next.source();
    }
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
