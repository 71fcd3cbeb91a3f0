//! See `armcal_fuzz::files::geometry`.
#![no_main]

use armcal_fuzz::files::geometry;
use armcal_fuzz::limits::{Size, held};

libfuzzer_sys::fuzz_target!(init: armcal_fuzz::on_this_thread(), |bytes: &[u8]| {
    held(Size::plain(bytes), || geometry(bytes));
});
