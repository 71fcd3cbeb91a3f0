//! Why a criterion cannot be computed. Every variant names the criterion or the input, and what would help.

use thiserror::Error;

/// What can go wrong between poses and criteria.
#[derive(Debug, Clone, PartialEq, Error)]
#[allow(missing_docs, reason = "each message says what its fields are")]
pub enum IsoError {
    /// Fewer cycles, poses or points than the formula can do with.
    #[error("{what} needs at least {needed} {of}, and has {given}")]
    TooFew { what: &'static str, of: &'static str, needed: usize, given: usize },
    /// A coordinate is NaN or infinite.
    #[error(
        "{what}: number {index} has a coordinate that is not finite: leave out frames in which the tip was not seen"
    )]
    NotFinite {
        what: String,
        /// Its index in the list, from 0.
        index: usize,
    },
    /// A number that must be positive is not.
    #[error("{what} is {value}: it must be finite and above zero")]
    NotPositive { what: String, value: f64 },
    /// Two lists that belong together differ in length.
    #[error("{what}: {left} and {right} entries belong together one by one")]
    Uneven { what: &'static str, left: usize, right: usize },
    /// Times run backwards.
    #[error("{what}: sample {index} is not later than the one before it: sort the samples by time")]
    TimeNotIncreasing {
        what: String,
        /// Index of the sample, from 0.
        index: usize,
    },
    /// Visits of the same name were commanded to different places.
    #[error(
        "visit {visit} to '{pose}' was commanded {distance_mm:.3} mm or {angle_deg:.3} deg away from the first visit of \
         that name: give poses that differ different names (a tilted board's cavities, for one)"
    )]
    CommandMoved {
        pose: String,
        /// Index of the visit, from 0.
        visit: usize,
        distance_mm: f64,
        angle_deg: f64,
    },
    /// The samples begin inside the limit band.
    #[error(
        "the samples begin inside the limit band of {band_mm:.3} mm: record the approach from further away"
    )]
    CrossingNotSeen { band_mm: f64 },
    /// The samples end outside the limit band.
    #[error(
        "the samples end outside the limit band of {band_mm:.3} mm: record until the arm rests, or widen the band"
    )]
    NeverSettles { band_mm: f64 },
    /// A path without length.
    #[error("the command path has no length: give at least two points that differ")]
    NoLength,
}

/// Fails with fewer than `needed`.
pub(crate) fn at_least(
    needed: usize,
    of: &'static str,
    given: usize,
    what: &'static str,
) -> Result<(), IsoError> {
    if given < needed { Err(IsoError::TooFew { what, of, needed, given }) } else { Ok(()) }
}
