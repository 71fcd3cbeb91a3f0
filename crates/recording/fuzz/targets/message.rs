//! A schema and a message, every encoding.
#![no_main]

use armcal_fuzz::limits::{Size, held};
use armcal_fuzz::message::message;

libfuzzer_sys::fuzz_target!(init: armcal_fuzz::on_this_thread(), |bytes: &[u8]| {
    held(Size::plain(bytes), || message(bytes));
});
