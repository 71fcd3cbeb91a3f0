//! One row of a verification's tables in words and millimetres, the same on terminal and page.

use armcal_core::units::format_mm;
use armcal_verify::{By, Compared, Estimate, PathRow, Plane, PointsRow};

/// Cells of a row; empty where a number would say nothing.
pub(super) struct Row {
    pub subject: String,
    pub n: usize,
    /// Mean error before and after [mm], each with the half width of its 95 % interval.
    pub before: [String; 2],
    pub after: [String; 2],
    /// 95 % interval of the paired difference [mm].
    pub difference: [String; 2],
    pub better: String,
}

impl Row {
    pub fn of_points(r: &PointsRow) -> Row {
        let subject = match r.by {
            By::All | By::Recording | By::Reference => r.subject.clone(),
            By::Arrival => format!("arriving {}", r.subject),
            By::Axis => format!("along {} (signed)", r.subject),
        };
        let mut row = Row::of(subject, &r.errors);
        if r.by == By::Axis {
            // A signed mean that falls in size may do so by turning its sign: a share says nothing there.
            row.better.clear();
        }
        row
    }

    /// Planes are told below the row of the space they are cut from.
    pub fn of_path(r: &PathRow) -> Row {
        let subject = match r.plane {
            Plane::Space => r.subject.clone(),
            plane => format!("{} in {}", r.subject, plane.word()),
        };
        Row::of(subject, &r.errors)
    }

    fn of(subject: String, c: &Compared) -> Row {
        let half = |e: &Estimate| e.ci95_m.map_or(String::new(), |[low, high]| format_mm(0.5 * (high - low)));
        let mean = |e: &Estimate| [format_mm(e.mean_m), half(e)];
        Row {
            subject,
            n: c.n,
            before: mean(&c.before),
            after: mean(&c.after),
            difference: c.difference_ci95_m.map_or_else(Default::default, |ends| ends.map(format_mm)),
            better: format!("{:.1} %", 100.0 * c.improvement),
        }
    }
}

/// A cell that says when there is nothing to say.
pub(super) fn or_dash(cell: String) -> String {
    if cell.is_empty() { "-".into() } else { cell }
}
