//! Errors at points: Table 4 of the source paper, and where they come from.

use crate::compared::{Compared, Error};
use armcal_calibrate::independent_groups;
use armcal_core::{Arrival, DwellId};
use nalgebra::Vector3;
use serde::Serialize;

/// The error of one dwell.
#[derive(Debug, Clone, PartialEq)]
pub struct PointError {
    /// The dwell.
    pub dwell: DwellId,
    /// Cavity; absent when the tip was tracked or joined to another.
    pub cavity: Option<String>,
    /// Whether it is from one tip to another that it was joined to.
    pub joined: bool,
    /// Direction of arrival of each joint.
    pub arrival: Vec<Arrival>,
    /// Measured minus predicted by the nominal model, base axes [m].
    pub before_m: Vector3<f64>,
    /// The same by the calibrated model [m].
    pub after_m: Vector3<f64>,
}

/// One row of the table.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PointsRow {
    /// What is compared: `all`, a recording, an axis, an arrival.
    pub subject: String,
    /// Of which kind that is.
    pub by: By,
    /// Errors before and after: sizes, or signed components where the row is an axis.
    #[serde(flatten)]
    pub errors: Compared,
}

/// By what a row groups the points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum By {
    /// All points.
    All,
    /// One recording, that is, one tilt of the board.
    Recording,
    /// Dwells in a cavity, tracked in free space, or with joined tips.
    Reference,
    /// A joint that arrived from one side.
    Arrival,
    /// A signed component: what is left on average in one direction of the base frame.
    Axis,
}

/// All rows: all points, each recording, seated against tracked, each joint's arrival, each axis. Groups without a point
/// have no row. `recordings` and `joints` are names.
pub fn compare_points(errors: &[PointError], recordings: &[String], joints: &[String]) -> Vec<PointsRow> {
    let norm = |v: &Vector3<f64>| v.norm();
    let mut rows: Vec<PointsRow> = table_row(errors, "all", By::All, |_| true, norm).into_iter().collect();
    for (index, name) in recordings.iter().enumerate() {
        rows.extend(table_row(errors, name, By::Recording, |e| e.dwell.recording == index, norm));
    }
    type IsOf = fn(&PointError) -> bool;
    let kinds: [(&str, IsOf); 3] = [
        ("seated in a cavity", |e| e.cavity.is_some()),
        ("tracked", |e| e.cavity.is_none() && !e.joined),
        ("tip to joined tip", |e| e.joined),
    ];
    // All of one kind are the first row.
    for (name, is_of) in kinds.into_iter().filter(|(_, is_of)| !errors.iter().all(is_of)) {
        rows.extend(table_row(errors, name, By::Reference, is_of, norm));
    }
    for (joint, name) in joints.iter().enumerate() {
        for (way, sign) in [(Arrival::Positive, "+"), (Arrival::Negative, "-")] {
            let came = |e: &PointError| e.arrival.get(joint) == Some(&way);
            rows.extend(table_row(errors, &format!("{name} {sign}"), By::Arrival, came, norm));
        }
    }
    for (axis, name) in ["x", "y", "z"].iter().enumerate() {
        rows.extend(table_row(errors, name, By::Axis, |_| true, |v| v[axis]));
    }
    rows
}

fn table_row(
    errors: &[PointError],
    subject: &str,
    by: By,
    belongs: impl Fn(&PointError) -> bool,
    value: impl Fn(&Vector3<f64>) -> f64,
) -> Option<PointsRow> {
    let chosen: Vec<&PointError> = errors.iter().filter(|e| belongs(e)).collect();
    let names: Vec<(String, Option<&str>)> =
        chosen.iter().map(|e| (e.dwell.to_string(), e.cavity.as_deref())).collect();
    let groups = independent_groups(&names);
    let pairs: Vec<Error<'_>> = chosen
        .iter()
        .zip(&groups)
        .map(|(e, group)| Error { group, before_m: value(&e.before_m), after_m: value(&e.after_m) })
        .collect();
    Compared::of(&pairs).map(|errors| PointsRow { subject: subject.to_owned(), by, errors })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(recording: usize, dwell: usize, before_m: [f64; 3], way: Arrival) -> PointError {
        PointError {
            dwell: DwellId { recording, dwell },
            cavity: None,
            joined: false,
            arrival: vec![way],
            before_m: before_m.into(),
            after_m: Vector3::from(before_m) * 0.1,
        }
    }

    #[test]
    fn rows_are_means_of_what_belongs_to_them() {
        let errors = [
            error(0, 0, [3.0, 4.0, 0.0], Arrival::Positive),
            error(0, 1, [0.0, 0.0, -1.0], Arrival::Negative),
            error(1, 0, [-3.0, 0.0, 0.0], Arrival::Positive),
        ];
        let rows = compare_points(&errors, &["flat".into(), "roll".into()], &["joint1".into()]);
        let mean = |subject: &str| {
            rows.iter().find(|r| r.subject == subject).map(|r| (r.errors.n, r.errors.before.mean_m))
        };
        assert_eq!(mean("all"), Some((3, 3.0)));
        assert_eq!(mean("flat"), Some((2, 3.0)));
        assert_eq!(mean("roll"), Some((1, 3.0)));
        assert_eq!(mean("joint1 +"), Some((2, 4.0)));
        assert_eq!(mean("joint1 -"), Some((1, 1.0)));
        assert_eq!(mean("x"), Some((3, 0.0)));
        assert_eq!(mean("y"), Some((3, 4.0 / 3.0)));
        assert_eq!(mean("seated in a cavity"), None);
    }
}
