//! What reading found: the facts `armcal inspect` prints and every output carries along.

use armcal_core::Warning;
use serde::Serialize;
use std::path::PathBuf;
use std::sync::Arc;

/// How the records of a file were found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Source {
    /// Through the file's own summary and chunk index.
    Index,
    /// By walking the records, because the file has no usable index (unchunked, cut off, damaged).
    Scan,
}

/// One file of a recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FileReport {
    /// Path or URL as given.
    pub path: PathBuf,
    /// Size [bytes].
    pub bytes: u64,
    /// What tells its content from any other: `blake3:` and the hash of the whole file, as `b3sum` prints it; of an object,
    /// which is not read whole to be hashed, `object:` with ETag, size and time of the last change.
    pub identity: String,
    /// What identifies an object in its store.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub object: Option<ObjectIdentity>,
    /// What was read, of a file read by ranges. What was not read was not judged either: the numbers of messages of
    /// channels nobody asked for are then those that the file's summary declares, and damage is told of what was read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fetched: Option<Fetched>,
    /// How its records were found.
    pub source: Source,
    /// Profile of the MCAP header (`ros2`, `ros1`, empty).
    pub profile: String,
    /// Library of the MCAP header.
    pub library: String,
    /// Chunks in the file, good and bad.
    pub chunks: usize,
    /// Where the file was cut off [byte], if it was.
    pub truncated_at: Option<u64>,
    /// Parts that could not be used: byte offset and reason.
    pub damaged: Vec<(u64, String)>,
}

/// What a store says of an object. A store gives changed content another ETag.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ObjectIdentity {
    /// ETag.
    pub etag: String,
    /// Time of the last change (RFC 3339).
    pub last_modified: String,
}

impl ObjectIdentity {
    /// The same in one line, of an object of this size.
    pub(crate) fn identity(&self, bytes: u64) -> String {
        format!("object:etag={},bytes={bytes},modified={}", self.etag, self.last_modified)
    }
}

/// How much of a file was read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Fetched {
    /// Bytes read; more than the file has where parts were read twice.
    pub bytes: u64,
    /// Requests made, repetitions after failures not counted.
    pub requests: u64,
}

/// One channel (same topic, schema and encoding in all files of the recording).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChannelReport {
    /// Topic.
    pub topic: String,
    /// Schema name, such as `sensor_msgs/msg/JointState`.
    pub schema: Arc<str>,
    /// Schema encoding (`ros2msg`, `ros1msg`, `protobuf`, `jsonschema`, ...).
    pub schema_encoding: Arc<str>,
    /// Message encoding (`cdr`, `ros1`, `protobuf`, `json`, ...).
    pub message_encoding: Arc<str>,
    /// Messages found; for channels that were not read of a file read by ranges, what its summary declares.
    pub messages: u64,
    /// First log time [ns].
    pub first_ns: i64,
    /// Last log time [ns].
    pub last_ns: i64,
    /// What armcal can read it as (`joints`, `pose`, `temperature`), or why it cannot.
    pub decodable: Result<&'static str, Arc<str>>,
}

/// Which stamp of a message its time was taken from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Clock {
    /// The message's own header stamp.
    Header,
    /// MCAP publish time.
    Publish,
    /// MCAP log time.
    Log,
}

impl Clock {
    /// As the pipeline spells it.
    pub fn word(self) -> &'static str {
        match self {
            Clock::Header => "header",
            Clock::Publish => "publish",
            Clock::Log => "log",
        }
    }
}

/// What was read for one stream of the pipeline.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StreamReport {
    /// Role in the pipeline: `joints`, `tip`, `base`, `table`, `temperature`.
    pub role: String,
    /// Topic it was read from.
    pub topic: String,
    /// Clock used and why.
    pub clock: Clock,
    /// Why that clock, in words.
    pub clock_reason: String,
    /// Messages read.
    pub messages: u64,
    /// Rows that entered the columns.
    pub rows: usize,
    /// Messages that could not be decoded.
    pub undecodable: u64,
    /// Rows with NaN or infinite values, dropped.
    pub non_finite: u64,
    /// Rows with finite numbers that no joint or laboratory can have, dropped.
    pub impossible: u64,
    /// Rows without a stamp on the clock used, dropped.
    pub unstamped: u64,
    /// Rows whose header stamp is far from all others and from log time, dropped.
    pub stray_stamps: u64,
    /// Rows whose stamp equals the one before, dropped.
    pub duplicate_stamps: u64,
    /// Rows whose stamp goes backwards; sorted into place.
    pub backward_stamps: u64,
    /// Messages that do not hold all wanted joints (a gripper on the same topic), skipped.
    pub other_joints: u64,
    /// Pose rows rejected as occluded, by reason.
    pub occluded: Occlusion,
    /// Median rate [Hz].
    pub rate_hz: f64,
    /// Largest gap between rows [s].
    pub largest_gap_s: f64,
    /// Step of the quantisation of the readings [rad], per joint, where there is one.
    pub quantisation_rad: Vec<Option<f64>>,
}

/// Pose rows rejected because the sensor did not see the body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Occlusion {
    /// Exactly zero translation.
    pub zero: u64,
    /// The same pose repeated bit for bit while a live sensor would jitter.
    pub frozen: u64,
    /// Quaternion not of unit length.
    pub non_unit_quaternion: u64,
    /// Flagged as occluded by the message itself.
    pub flagged: u64,
}

impl Occlusion {
    /// All rejected rows.
    pub fn total(&self) -> u64 {
        self.zero + self.frozen + self.non_unit_quaternion + self.flagged
    }
}

/// Everything known about one recording (which may consist of several split files).
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct RecordingReport {
    /// Its files, in time order.
    pub files: Vec<FileReport>,
    /// Its channels, by topic; whoever keeps the report shares them.
    pub channels: Arc<[ChannelReport]>,
    /// Its streams, once a pipeline has named them.
    pub streams: Vec<StreamReport>,
    /// What the user should know.
    pub warnings: Vec<Warning>,
}
