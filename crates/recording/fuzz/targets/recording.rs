//! Whole recordings, byte by byte.
#![no_main]

use armcal_fuzz::{memory, recordings};

#[global_allocator]
static COUNTING: memory::Counting = memory::Counting;

libfuzzer_sys::fuzz_target!(init: armcal_fuzz::on_this_thread(), |bytes: &[u8]| {
    let ((), peak) = memory::peak_bytes(|| recordings::recording(bytes));
    assert!(peak <= recordings::bound(bytes.len()), "{peak} bytes for {}", bytes.len());
});
