//! What the fuzz targets do, one function a target, so that ordinary tests can replay their findings:
//! `crates/recording/tests/hostile.rs` includes [`recordings`], [`structured`] and [`memory`], `tests/fuzzed_files.rs`
//! includes `files`.

#[cfg(feature = "files")]
pub mod files;
pub mod memory;
pub mod recordings;
pub mod structured;

/// Makes this thread the only one that works: what an input reaches must not depend on how threads meet, and handing
/// each input to another thread would take longer than most inputs.
pub fn on_this_thread() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread();
    pool.build_global().expect("no pool was made before");
}
