//! What the fuzz targets do, one function a target, so that ordinary tests can replay their findings and corpora:
//! `crates/recording/tests/fuzzed_corpus.rs` and `tests/fuzzed_files.rs` include these modules.

pub mod bag;
pub mod compared;
#[cfg(feature = "files")]
pub mod files;
pub mod inflated;
pub mod limits;
pub mod memory;
pub mod message;
pub mod recordings;
pub mod structured;

#[global_allocator]
static COUNTING: memory::Counting = memory::Counting;

/// Makes this thread the only one that works: what an input reaches must not depend on how threads meet, and handing
/// each input to another thread would take longer than most inputs.
pub fn on_this_thread() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread();
    pool.build_global().expect("no pool was made before");
}
