//! What the dwells say about each joint, by direction of arrival.

use super::panels::{BLUE, GREY, VERMILION, dots};
use super::spec::{Content, Direction, Kind, Plot, X};
use crate::channels::implied_topic;
use crate::findings::Findings;
use crate::proto::JointErrors;
use crate::text::printable;
use armcal_core::robust::percentile;

/// A joint that gravity loads by less than this share of the most loaded one is not drawn over its torque.
const UNLOADED: f64 = 0.05;
/// A joint on which the effects found act by less than this share of the largest is not drawn again.
const MOVED: f64 = 0.3;
/// Nor is one on which they act by less than this many times what is left.
const ABOVE_REST: f64 = 1.5;

/// What is drawn of a joint, split by direction of arrival.
#[derive(Clone, Copy)]
pub(super) enum What {
    /// Of the calibrated model.
    Error,
    /// With everything found.
    After,
    /// What the effects found do.
    Effect,
}

impl What {
    /// All directions together, for the scale.
    fn whole(self, m: &JointErrors) -> &[f64] {
        match self {
            What::Error => &m.error,
            What::After => &m.error_after,
            What::Effect => &m.effect,
        }
    }

    fn suffix(self) -> &'static str {
        match self {
            What::Error => "",
            What::After => "_after",
            What::Effect => "_effect",
        }
    }
}

/// The joints that move the tip in at least one dwell.
pub(super) fn drawn(f: &Findings) -> impl Iterator<Item = &JointErrors> {
    f.joints.iter().filter(|m| !m.reading.is_empty())
}

/// Over its angle and, where gravity loads it, over its torque.
pub(super) fn joint_row(f: &Findings, m: &JointErrors, what: What) -> Vec<Content> {
    let name = printable(&m.joint);
    let title = match what {
        What::Error => name,
        What::After => format!("{name}, what is left"),
        What::Effect => format!("{name}, what the effects do"),
    };
    let range = common_range(f, m, what);
    let angle =
        joint_plot(m, format!("{title}, over its angle"), ("reading", "reading", &m.unit), what, range);
    let mut row = vec![angle];
    let span = |m: &JointErrors| m.torque_nm.iter().fold(0.0, |most: f64, torque| most.max(torque.abs()));
    let largest = f.joints.iter().map(span).fold(0.0, f64::max);
    if span(m) > UNLOADED * largest {
        let torque = ("torque_nm", "gravity torque", "N m");
        row.push(joint_plot(m, format!("{title}, over its torque"), torque, what, range));
    }
    row
}

/// Implied error by direction of arrival against one of the arrays: field, name and unit.
fn joint_plot(
    m: &JointErrors,
    title: String,
    (x, x_name, x_unit): (&str, &str, &str),
    what: What,
    y_range: Option<[f64; 2]>,
) -> Content {
    let path = |field: &str| format!("{}.{field}[:]", implied_topic(m.number));
    let arrivals = [
        ("positive", 1, "arrived in +q", BLUE),
        ("negative", -1, "arrived in -q", VERMILION),
        ("unknown", 0, "arrival unknown", GREY),
    ];
    let seen = arrivals.into_iter().filter(|(_, sign, ..)| m.arrival.contains(sign));
    let dots_of = |(field, _, label, colour): (&str, i32, &str, &'static str)| {
        dots(path(&format!("{field}{}", what.suffix())), label, colour)
    };
    let plot = Plot {
        x: X::Array(path(x), format!("{x_name} [{x_unit}]")),
        y_label: format!("implied error [{}]", m.unit),
        y_range,
        series: seen.map(dots_of).collect(),
    };
    Content::panel(title, Kind::Plot(plot))
}

/// The same for all joints of a unit; what is left keeps the scale of what the effects do.
fn common_range(f: &Findings, m: &JointErrors, what: What) -> Option<[f64; 2]> {
    let scale = if matches!(what, What::After) { What::Effect } else { what };
    let same = f.joints.iter().filter(|other| other.unit == m.unit);
    let errors: Vec<f64> = same.flat_map(|m| scale.whole(m)).map(|e| e.abs()).collect();
    let large = 1.3 * percentile(&errors, 0.98);
    (large > 0.0).then_some([-large, large])
}

/// The joints the effects found act on most, each with what they do and what is left.
pub(super) fn what_effects_do(f: &Findings) -> Vec<Content> {
    let size = |m: &JointErrors, what: What| {
        percentile(&what.whole(m).iter().map(|e| e.abs()).collect::<Vec<f64>>(), 0.9)
    };
    let effect = |m: &JointErrors| size(m, What::Effect);
    let largest = |unit: &str| f.joints.iter().filter(|m| m.unit == unit).map(effect).fold(0.0, f64::max);
    let moved = drawn(f)
        .filter(|m| effect(m) >= MOVED * largest(&m.unit) && effect(m) > ABOVE_REST * size(m, What::After));
    let row = |m: &JointErrors| {
        let mut row = joint_row(f, m, What::Effect);
        row.push(joint_row(f, m, What::After).swap_remove(0));
        Content::even(Direction::Row, row)
    };
    moved.map(row).collect()
}
