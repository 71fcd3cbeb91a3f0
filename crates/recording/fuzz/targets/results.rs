//! See `armcal_fuzz::files::results`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| armcal_fuzz::files::results(bytes));
