//! What the dwells say about each joint, by direction of arrival.

use super::drawn::{What, tip_moving_joints};
use super::panels::{BLUE, GREY, VERMILION, dot_series};
use super::scale::axis_range;
use super::spec::{Colour, Content, Direction, Plot};
use crate::channels::implied_topic;
use crate::findings::Findings;
use armcal_core::printable_name;
use armcal_core::robust::percentile;
use armcal_result::proto::JointErrors;

/// A joint on which the effects found act by less than this share of the largest is not drawn again.
const MOVED: f64 = 0.3;
/// Nor is one on which they act by less than this many times what is left.
const ABOVE_REST: f64 = 1.5;

/// Columns of joints that fit beside each other on a laptop beside other panels.
const SHOWN: usize = 2;

/// Over its angle, where play and eccentricity show.
pub(super) fn over_angle(f: &Findings, m: &JointErrors, what: What) -> Content {
    let title = format!("{}{}", printable_name(&m.joint), what.words());
    joint_plot(m, &title, ("reading", "reading", &m.unit), what, axis_range(f, m, what))
}

/// Over its torque, where compliance shows; none where gravity's torque hardly moves.
pub(super) fn over_torque(f: &Findings, m: &JointErrors, what: What) -> Option<Content> {
    let felt = f.joints.iter().zip(&f.feels_gravity).any(|(joint, felt)| joint.number == m.number && *felt);
    let title = format!("{}{}", printable_name(&m.joint), what.words());
    let torque = ("torque_nm", "gravity torque", "N m");
    felt.then(|| joint_plot(m, &title, torque, what, axis_range(f, m, what)))
}

/// Implied error by direction of arrival against one of the arrays: field, name and unit.
fn joint_plot(
    m: &JointErrors,
    title: &str,
    (x, x_name, x_unit): (&str, &str, &str),
    what: What,
    y_range: Option<[f64; 2]>,
) -> Content {
    let path = |field: &str| format!("{}.{field}[:]", implied_topic(m.number));
    let arrivals =
        [("positive", 1, "+q", BLUE), ("negative", -1, "-q", VERMILION), ("unknown", 0, "?", GREY)];
    let seen = arrivals.into_iter().filter(|(_, sign, ..)| m.arrival.contains(sign));
    let dots_of = |(field, _, label, colour): (&str, i32, &str, Colour)| {
        dot_series(path(&format!("{field}{}", what.suffix())), label, colour)
    };
    let outside =
        |[least, most]: [f64; 2]| what.whole(m).iter().filter(|e| **e < least || **e > most).count();
    let plot = Plot {
        x_path: path(x),
        x_label: format!("{x_name} [{x_unit}]"),
        y_label: format!("error [{}]", m.unit),
        y_range,
        beyond: y_range.map_or(0, outside),
        series: seen.map(dots_of).collect(),
    };
    Content::plot(title, plot)
}

/// The joints the effects found act on most, each with what they do and what is left. Sizes are counted in the standard
/// deviations of the dwells, so that joints which hardly move the tip do not lead.
/// A joint alone is drawn over its angle and over its torque; two have room for one of them, which is the torque where the
/// effects are `of_load`.
pub(super) fn what_effects_do(f: &Findings, of_load: bool) -> Option<Content> {
    let size = |m: &JointErrors, what: What| {
        let sigmas: Vec<f64> = what.whole(m).iter().zip(&m.sigma).map(|(e, s)| (e / s).abs()).collect();
        percentile(&sigmas, 0.9)
    };
    let effect = |m: &JointErrors| size(m, What::Effect);
    let largest = tip_moving_joints(f).map(effect).fold(0.0, f64::max);
    let mut moved: Vec<&JointErrors> = tip_moving_joints(f)
        .filter(|m| effect(m) >= MOVED * largest && effect(m) > ABOVE_REST * size(m, What::After))
        .collect();
    moved.sort_by(|a, b| effect(b).total_cmp(&effect(a)));
    moved.truncate(SHOWN);
    let alone = moved.len() == 1;
    let column = |m: &JointErrors| {
        let (angle, torque) = (over_angle(f, m, What::Effect), over_torque(f, m, What::Effect));
        let effects = match torque {
            Some(torque) if alone => vec![angle, torque],
            Some(torque) if of_load => vec![torque],
            _ => vec![angle],
        };
        let rest = over_angle(f, m, What::After);
        Content::even(Direction::Column, effects.into_iter().chain([rest]).collect())
    };
    (!moved.is_empty()).then(|| Content::even(Direction::Row, moved.into_iter().map(column).collect()))
}
