//! Databases of rosbag2, compared with what was written.
#![no_main]

libfuzzer_sys::fuzz_target!(init: armcal_fuzz::on_this_thread(), |bytes: &[u8]| armcal_fuzz::bag::bag(bytes));
