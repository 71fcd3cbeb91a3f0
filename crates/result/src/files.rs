//! What identifies the files of a recording.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};

/// One file of a recording.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct ObservedFile {
    /// Path as the pipeline gave it.
    pub path: String,
    /// What identifies it ([`armcal_recording::FileReport::identity`]); in results of earlier versions its SHA-256.
    #[serde(alias = "sha256")]
    pub identity: String,
    /// Size [bytes].
    pub bytes: u64,
}

/// SHA-256 of a text, hexadecimal.
pub fn sha256(text: &str) -> String {
    hex::encode(Sha256::digest(text))
}

/// SHA-256 of parts that cannot run into each other, hexadecimal.
pub fn hash_of_parts(parts: impl IntoIterator<Item = String>) -> String {
    let mut hasher = Sha256::new();
    for part in parts {
        hasher.update((part.len() as u64).to_le_bytes());
        hasher.update(part.as_bytes());
    }
    hex::encode(hasher.finalize())
}
