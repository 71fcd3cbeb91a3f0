//! Replays the corpora of fuzzing and what it found, with the limits of memory and time that the targets have, and draws more
//! orders (docs/hardening.md).
#![cfg(unix)]
#![allow(clippy::print_stdout, reason = "a test says which input it replays")]

#[path = "../fuzz/src/bag.rs"]
mod bag;
#[path = "../fuzz/src/compared.rs"]
mod compared;
#[path = "../fuzz/src/inflated.rs"]
mod inflated;
#[path = "../fuzz/src/limits.rs"]
mod limits;
#[path = "../fuzz/src/memory.rs"]
mod memory;
#[path = "../fuzz/src/message.rs"]
mod message;
#[path = "../fuzz/src/recordings.rs"]
mod recordings;
#[path = "../fuzz/src/structured.rs"]
mod structured;

use limits::{Size, held};
use std::path::Path;

#[global_allocator]
static COUNTING: memory::Counting = memory::Counting;

fn replay(target: &str, run: impl Fn(&[u8]) + Sync) {
    let fuzz = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz");
    // What is measured is measured by thread.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    pool.install(|| {
        let mut replayed = 0;
        for kind in ["corpus", "regressions"] {
            let folder = fuzz.join(kind).join(target);
            for entry in folder.read_dir().into_iter().flatten() {
                let path = entry.expect("an entry").path();
                println!("{}", path.display());
                run(&std::fs::read(&path).expect("readable"));
                replayed += 1;
            }
        }
        assert!(replayed > 10, "{target} has no corpus");
    });
}

#[test]
fn bytes_of_recordings_keep_to_the_limits() {
    replay("recording", |bytes| held(inflated::size(bytes), || recordings::recording(bytes)));
}

#[test]
fn built_recordings_are_read_as_they_were_written_or_the_loss_is_reported() {
    replay("records", compared::records_of);
}

#[test]
fn built_databases_are_read_as_they_were_written_or_the_loss_is_reported() {
    replay("bag", bag::bag);
}

#[test]
fn messages_keep_to_the_limits() {
    replay("message", |bytes| held(Size::plain(bytes), || message::message(bytes)));
}

/// Orders drawn by a generator of fixed seed (the LCG of Numerical Recipes).
#[test]
fn orders_drawn_at_random_are_read_as_they_were_written_or_the_loss_is_reported() {
    let mut state = 1_u32;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    for length in 0..1500 {
        let orders: Vec<u8> = (0..length % 300)
            .map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (state >> 24) as u8
            })
            .collect();
        pool.install(|| compared::records_of(&orders));
        if length % 10 == 0 {
            pool.install(|| bag::bag(&orders));
        }
    }
}
