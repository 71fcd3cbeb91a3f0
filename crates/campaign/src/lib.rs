//! What many recordings of one rig say together.
//!
//! `Row` (one a recording) -> `Series` (a quantity over time) -> `Change` (a step, a single outlier, a trend). A table
//! that was bumped, a belt that slipped a tooth and a gear that wears are such changes; what scatters from recording to
//! recording is not.

mod change;
mod line;
mod row;
mod segment;
mod series;

pub use change::{Change, ChangeKind, find_changes};
pub use row::{ErrorFigures, Quantity, Row, Status};
pub use series::{Series, SeriesPoint, quantity_series};

#[cfg(test)]
mod tests;
