//! Times for people, in UTC.

use chrono::DateTime;

/// `2026-03-01 14:05`; robots whose clock does not know the year show 1970.
pub(super) fn utc_minute(time_ns: i64) -> String {
    DateTime::from_timestamp_nanos(time_ns).format("%Y-%m-%d %H:%M").to_string()
}
