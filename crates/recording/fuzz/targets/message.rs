//! A schema and a message, every encoding.
#![no_main]

#[global_allocator]
static COUNTING: armcal_fuzz::memory::Counting = armcal_fuzz::memory::Counting;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let ((), peak) = armcal_fuzz::memory::peak_bytes(|| armcal_fuzz::recordings::message(bytes));
    assert!(peak <= armcal_fuzz::recordings::bound(bytes.len()), "{peak} bytes for {}", bytes.len());
});
