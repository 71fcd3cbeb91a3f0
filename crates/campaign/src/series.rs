//! A quantity over the recordings of a campaign.

use crate::Row;
use armcal_core::Unit;
use serde::Serialize;
use std::collections::BTreeMap;

/// One quantity in the order of time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Series {
    /// Its name.
    pub quantity: String,
    /// Its unit.
    pub unit: Unit,
    /// Its values, by time.
    pub points: Vec<SeriesPoint>,
}

/// One value.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SeriesPoint {
    /// Which row it is from.
    pub row: usize,
    /// When [ns].
    pub time_ns: i64,
    /// The value.
    pub value: f64,
    /// Its standard error, where known.
    pub sigma: Option<f64>,
}

/// The quantities that at least one recording determines, in the order in which the rows name them; values that a
/// recording does not determine are left out, and so are rows that do not count.
pub fn quantity_series(rows: &[Row], counts: impl Fn(usize) -> bool) -> Vec<Series> {
    let mut order: BTreeMap<&str, usize> = BTreeMap::new();
    let mut found: Vec<Series> = Vec::new();
    for (row, of) in rows.iter().enumerate().filter(|(row, _)| counts(*row)) {
        for q in of.quantities.iter().filter(|q| q.determined && q.value.is_finite()) {
            let at = *order.entry(&q.name).or_insert_with(|| {
                found.push(Series { quantity: q.name.to_string(), unit: q.unit, points: Vec::new() });
                found.len() - 1
            });
            let sigma = q.sigma.filter(|s| s.is_finite());
            found[at].points.push(SeriesPoint { row, time_ns: of.start_ns, value: q.value, sigma });
        }
    }
    for one in &mut found {
        one.points.sort_by_key(|p| (p.time_ns, p.row));
    }
    found
}
