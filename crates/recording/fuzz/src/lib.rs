//! What the fuzz targets do, one function a target, so that ordinary tests can replay their findings:
//! `crates/recording/tests/hostile.rs` includes [`recordings`], [`structured`] and [`memory`], `tests/fuzzed_files.rs`
//! includes `files`.

#[cfg(feature = "files")]
pub mod files;
pub mod memory;
pub mod recordings;
pub mod structured;
