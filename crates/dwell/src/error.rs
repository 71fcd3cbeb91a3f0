//! What can go wrong between samples and dwells.

use thiserror::Error;

/// Why clocks could not be aligned or dwells not be looked for.
#[derive(Debug, Clone, PartialEq, Error)]
#[allow(missing_docs, reason = "each message says what its fields are")]
pub enum DwellError {
    /// A configuration value makes no sense.
    #[error("checking the configuration: {section}.{key} = {value} {why}")]
    Config { section: &'static str, key: &'static str, value: f64, why: &'static str },
    /// A stream has no usable row.
    #[error("{doing}: the {stream} stream has no usable rows; check its topic with `armcal inspect`")]
    NoSamples { doing: &'static str, stream: &'static str },
    /// The columns of a stream do not belong together.
    #[error("{doing}: the {stream} stream has {time_rows} stamps but {what} has {rows} rows")]
    Shape { doing: &'static str, stream: &'static str, time_rows: usize, what: String, rows: usize },
    /// Time does not increase.
    #[error(
        "{doing}: the stamps of the {stream} stream do not increase at row {row}; \
         read it with armcal-recording, which sorts and removes duplicates"
    )]
    Unordered { doing: &'static str, stream: &'static str, row: usize },
    /// The two streams do not cover the same time.
    #[error(
        "aligning the clocks: joint stream ({joints_first_ns} to {joints_last_ns} ns) and tip stream \
         ({tip_first_ns} to {tip_last_ns} ns) share only {overlap_s:.1} s within +-{max_offset_s} s of each other; \
         if one clock counts from another epoch set clock.initial_offset_s (tip minus robot, about {suggested_offset_s:.3})"
    )]
    NoOverlap {
        joints_first_ns: i64,
        joints_last_ns: i64,
        tip_first_ns: i64,
        tip_last_ns: i64,
        overlap_s: f64,
        max_offset_s: f64,
        suggested_offset_s: f64,
    },
    /// A stream has too many breaks.
    #[error(
        "aligning the clocks: the {stream} stream has no unbroken stretch of {needed_s:.2} s{rows}; record it without \
         losses, or raise clock.max_gap_s"
    )]
    Broken { stream: &'static str, needed_s: f64, rows: String },
    /// Both streams cover the same time, but hardly ever both at once.
    #[error(
        "aligning the clocks: both streams are unbroken at the same time for less than two fifths of the recording{rows}; \
         record them without losses, or raise clock.max_gap_s"
    )]
    RarelyTogether { rows: String },
    /// Nothing to align by.
    #[error("aligning the clocks: {seen}; {advice}")]
    NoMotion { seen: String, advice: &'static str },
    /// The two speed profiles do not resemble each other at any offset.
    #[error(
        "aligning the clocks: the best correlation of predicted and measured tip speed is {below:.3} \
         (at {offset_s:+.3} s), below clock.min_correlation = {min_correlation}; {hint}",
        // Rounded to nearest it could be as printed.
        below = (.correlation * 1e3).floor() * 1e-3
    )]
    CorrelationTooLow { correlation: f64, offset_s: f64, min_correlation: f64, hint: String },
    /// The best offset lies at the edge of the range searched.
    #[error(
        "aligning the clocks: the correlation still rises at the edge of the search, {offset_s:+.2} s; \
         raise clock.max_offset_s (now {max_offset_s}) or set clock.initial_offset_s"
    )]
    OffsetAtEdge { offset_s: f64, max_offset_s: f64 },
    /// Measured and predicted distances differ by the ratio of two units.
    #[error(
        "aligning the clocks: the measured tip moves {ratio:.4} times as far as the nominal model predicts \
         (correlation {correlation:.2}): {advice}"
    )]
    UnitMismatch { ratio: f64, correlation: f64, advice: &'static str },
}
