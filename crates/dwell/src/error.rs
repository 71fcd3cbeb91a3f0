//! What can go wrong between samples and dwells.

use thiserror::Error;

/// Why clocks could not be aligned or dwells not be looked for.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum DwellError {
    /// A configuration value makes no sense.
    #[error("checking the configuration: {section}.{key} = {value} {why}")]
    Config {
        /// Section of the pipeline.
        section: &'static str,
        /// Key.
        key: &'static str,
        /// Value as given.
        value: f64,
        /// What it must be instead.
        why: &'static str,
    },
    /// A stream has no usable row.
    #[error("{doing}: the {stream} stream has no usable rows; check its topic with `armcal inspect`")]
    NoSamples {
        /// What was being done.
        doing: &'static str,
        /// The stream.
        stream: &'static str,
    },
    /// The columns of a stream do not belong together.
    #[error("{doing}: the {stream} stream has {time_rows} stamps but {what} has {rows} rows")]
    Shape {
        /// What was being done.
        doing: &'static str,
        /// The stream.
        stream: &'static str,
        /// Rows of the time column.
        time_rows: usize,
        /// The column that differs.
        what: String,
        /// Its rows.
        rows: usize,
    },
    /// Time does not increase.
    #[error(
        "{doing}: the stamps of the {stream} stream do not increase at row {row}; \
         read it with armcal-recording, which sorts and removes duplicates"
    )]
    Unordered {
        /// What was being done.
        doing: &'static str,
        /// The stream.
        stream: &'static str,
        /// First offending row.
        row: usize,
    },
    /// The two streams do not cover the same time.
    #[error(
        "aligning the clocks: joint stream ({joints_first_ns} to {joints_last_ns} ns) and tip stream \
         ({tip_first_ns} to {tip_last_ns} ns) share only {overlap_s:.1} s within +-{max_offset_s} s of each other; \
         if one clock counts from another epoch set clock.initial_offset_s (tip minus robot, about {suggested_offset_s:.3})"
    )]
    NoOverlap {
        /// First joint stamp [ns].
        joints_first_ns: i64,
        /// Last joint stamp [ns].
        joints_last_ns: i64,
        /// First tip stamp [ns].
        tip_first_ns: i64,
        /// Last tip stamp [ns].
        tip_last_ns: i64,
        /// Time covered by both [s].
        overlap_s: f64,
        /// Search range [s].
        max_offset_s: f64,
        /// Offset that would bring the starts together [s].
        suggested_offset_s: f64,
    },
    /// A stream has too many breaks.
    #[error(
        "aligning the clocks: the {stream} stream has no unbroken stretch of {needed_s:.2} s{rows}; record it without \
         losses, or raise clock.max_gap_s"
    )]
    Broken {
        /// The stream.
        stream: &'static str,
        /// Length of a stretch that would do [s].
        needed_s: f64,
        /// What its stamps show: lost rows, rows in bursts.
        rows: String,
    },
    /// Both streams cover the same time, but hardly ever both at once.
    #[error(
        "aligning the clocks: both streams are unbroken at the same time for less than two fifths of the recording{rows}; \
         record them without losses, or raise clock.max_gap_s"
    )]
    RarelyTogether {
        /// What the stamps show: lost rows, rows in bursts.
        rows: String,
    },
    /// Nothing to align by.
    #[error("aligning the clocks: {seen}; {advice}")]
    NoMotion {
        /// What was seen.
        seen: String,
        /// What to do.
        advice: &'static str,
    },
    /// The two speed profiles do not resemble each other at any offset.
    #[error(
        "aligning the clocks: the best correlation of predicted and measured tip speed is {correlation:.2} \
         (at {offset_s:+.3} s), below clock.min_correlation = {min_correlation}; {hint}"
    )]
    CorrelationTooLow {
        /// Best correlation found.
        correlation: f64,
        /// Offset at which it was found [s].
        offset_s: f64,
        /// Limit.
        min_correlation: f64,
        /// The likely reason.
        hint: String,
    },
    /// The best offset lies at the edge of the range searched.
    #[error(
        "aligning the clocks: the correlation still rises at the edge of the search, {offset_s:+.2} s; \
         raise clock.max_offset_s (now {max_offset_s}) or set clock.initial_offset_s"
    )]
    OffsetAtEdge {
        /// The edge [s].
        offset_s: f64,
        /// Search range [s].
        max_offset_s: f64,
    },
    /// Measured and predicted distances differ by the ratio of two units.
    #[error(
        "aligning the clocks: the measured tip moves {ratio:.4} times as far as the nominal model predicts \
         (correlation {correlation:.2}): {advice}"
    )]
    UnitMismatch {
        /// Measured distance over predicted distance.
        ratio: f64,
        /// Correlation of the two speeds.
        correlation: f64,
        /// Which unit is wrong and what to set.
        advice: &'static str,
    },
}
