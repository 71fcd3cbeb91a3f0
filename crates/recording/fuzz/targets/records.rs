//! Recordings made of mostly sound records, compared with what was written.
#![no_main]

libfuzzer_sys::fuzz_target!(init: armcal_fuzz::on_this_thread(), |bytes: &[u8]| armcal_fuzz::compared::records_of(bytes));
