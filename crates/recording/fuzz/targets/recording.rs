//! Whole recordings, byte by byte.
#![no_main]

use armcal_fuzz::inflated::size;
use armcal_fuzz::limits::held;
use armcal_fuzz::recordings::recording;

libfuzzer_sys::fuzz_target!(init: armcal_fuzz::on_this_thread(), |bytes: &[u8]| {
    held(size(bytes), || recording(bytes));
});
