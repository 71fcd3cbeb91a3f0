//! What a fit is worth: covariance, intervals, rank, and what the data cannot determine.

pub(crate) mod describe;
pub(crate) mod statistics;
pub(crate) mod undetermined;
