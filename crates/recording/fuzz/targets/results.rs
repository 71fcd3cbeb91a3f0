//! See `armcal_fuzz::files::results`.
#![no_main]

use armcal_fuzz::files::results;
use armcal_fuzz::limits::{Size, held};

libfuzzer_sys::fuzz_target!(init: armcal_fuzz::on_this_thread(), |bytes: &[u8]| {
    held(Size::plain(bytes), || results(bytes));
});
