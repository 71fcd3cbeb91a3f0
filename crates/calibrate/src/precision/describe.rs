//! Undetermined directions in physical words.

use crate::objective::axes::Axis;
use armcal_core::{Parameter, Role};
use nalgebra::DMatrix;

/// Information below this share of a prior's counts as none at all.
const NO_INFORMATION: f64 = 1e-6;

/// `joint2.d - joint3.d: the axes of joint2 and joint3 are parallel, moving along them is the same`.
///
/// `shares` are (axis, share in units of the prior); the words keep the order of the model.
pub(crate) fn describe_direction(
    shares: &[(usize, f64)],
    axes: &[Axis],
    parameters: &[Parameter],
    information: &DMatrix<f64>,
) -> String {
    let mut in_order = shares.to_vec();
    in_order.sort_by_key(|&(k, _)| k);
    let terms: Vec<Term<'_>> = in_order
        .iter()
        .map(|&(k, share)| Term::new(&parameters[axes[k].index], share * axes[k].scale))
        .collect();
    let blind = shares.iter().all(|&(k, _)| information[(k, k)] < NO_INFORMATION);
    format!("{}: {}", format_sum(&terms), reason(&terms, blind))
}

/// How readily a person understands that two parameters cannot be told apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Simplicity {
    /// One parameter alone.
    Single,
    /// A pair with a physical reason of its own.
    Known,
    /// Two of the same unit.
    SameUnit,
    /// Any two.
    Any,
}

/// How readily the pair is understood.
pub(crate) fn simplicity(a: &Parameter, b: &Parameter) -> Simplicity {
    let terms = [Term::new(a, 1.0), Term::new(b, 1.0)];
    let parts = distinct_parts(&terms);
    let (turning, sliding) =
        (terms.iter().all(Term::turns_about_axis), terms.iter().all(Term::slides_along_axis));
    let parallel = terms.iter().all(|t| t.quantity == "d");
    if parts.len() == 2 && (parallel || base_of(&parts).is_some() && (turning || sliding)) {
        Simplicity::Known
    } else if a.unit == b.unit {
        Simplicity::SameUnit
    } else {
        Simplicity::Any
    }
}

/// One parameter of a direction.
struct Term<'a> {
    parameter: &'a Parameter,
    /// Frame, row or joint.
    part: &'a str,
    /// `theta`, `d`, `x`, `rz`, ...
    quantity: &'a str,
    /// Change of the parameter along the direction, SI.
    change: f64,
}

impl<'a> Term<'a> {
    fn new(parameter: &'a Parameter, change: f64) -> Term<'a> {
        let (part, quantity) = parameter.name.rsplit_once('.').unwrap_or(("", &parameter.name));
        Term { parameter, part, quantity, change }
    }

    fn is_of_board(&self) -> bool {
        self.part.starts_with("board")
    }

    /// Whether it places a marker on its link.
    fn is_of_marker(&self) -> bool {
        let frame = matches!(self.parameter.role, Role::EstimatedFrame | Role::KnownFrame);
        frame && !self.is_of_board() && !is_frame(self.part, "base") && !is_frame(self.part, "tip")
    }

    fn turns_about_axis(&self) -> bool {
        matches!(self.quantity, "theta" | "rz" | "zero")
    }

    fn slides_along_axis(&self) -> bool {
        matches!(self.quantity, "d" | "z")
    }
}

/// The sum of the terms as written in algebra; factors only between equal units.
fn format_sum(terms: &[Term<'_>]) -> String {
    let (boards, others): (Vec<&Term<'_>>, Vec<&Term<'_>>) = terms.iter().partition(|t| t.is_of_board());
    let followers = distinct_parts(boards.iter().copied());
    let [first, rest @ ..] = (if others.is_empty() { &boards } else { &others }).as_slice() else {
        return "nothing".to_string();
    };
    let mut text = first.parameter.name.clone();
    for term in rest {
        let ratio = term.change / first.change;
        let sign = if ratio < 0.0 { '-' } else { '+' };
        let same_unit = term.parameter.unit == first.parameter.unit;
        if same_unit && !(0.95..1.05).contains(&ratio.abs()) {
            text += &format!(" {sign} {:.2} {}", ratio.abs(), term.parameter.name);
        } else {
            text += &format!(" {sign} {}", term.parameter.name);
        }
    }
    // Boards have six entries each; that they follow is what matters, not by how much along each axis.
    if !others.is_empty() && !followers.is_empty() {
        text += &format!(" with {}", join_names(&followers));
    }
    text
}

fn reason(terms: &[Term<'_>], blind: bool) -> String {
    let parts = distinct_parts(terms);
    let (base, tip) = (base_of(&parts), tip_of(&parts));
    let seen = if terms.iter().any(Term::is_of_marker) { "what was measured" } else { "the tip" };
    let robot: Vec<&Term<'_>> = terms.iter().filter(|t| !t.is_of_board()).collect();
    let pair_with_base = parts.len() == 2 && terms.len() == 2;
    let boards = parts.iter().filter(|p| p.starts_with("board")).count();
    let frames = parts.iter().all(|p| is_frame(p, "base") || p.starts_with("board"));
    if blind {
        return "no observation depends on it".to_string();
    }
    if let [only] = terms {
        let name = &only.parameter.name;
        return format!("these dwells move {seen} by less than their noise when {name} changes");
    }
    if let (true, Some(base)) = (pair_with_base, base) {
        let joint = other_than(&parts, base);
        let base = frame_phrase(base);
        if terms.iter().all(Term::turns_about_axis) {
            return format!("turning the zero of {joint} is the same as turning {base}");
        }
        if terms.iter().all(Term::slides_along_axis) {
            return format!("moving {joint} along its axis is the same as raising {base}");
        }
    }
    if frames && parts.len() > 1 {
        return format!("{} moving together leave every distance as it is", join_names(&parts));
    }
    if frames && boards == 1 {
        return "its seated points lie on one line (or are too few): turning about them changes nothing"
            .to_string();
    }
    if boards > 0 {
        let joints = join_names(&distinct_parts(robot.iter().copied()));
        return if robot.iter().all(|t| t.turns_about_axis()) {
            format!(
                "turning the zero of {joints} is the same as turning what it reaches for, and the boards are estimated"
            )
        } else if robot.iter().all(|t| t.slides_along_axis()) {
            format!(
                "moving {joints} along its axis is the same as moving what it reaches for, and the boards are estimated"
            )
        } else {
            format!("the estimated boards follow {joints}, so that no distance changes")
        };
    }
    if parts.len() > 1 && terms.iter().all(|t| t.quantity == "d") {
        return format!("the axes of {} are parallel, moving along them is the same", join_names(&parts));
    }
    if let (Some(tip), true) = (tip, parts.len() > 1) {
        let others = join_names(&parts_without(&parts, tip));
        return format!("{others} and {} frame cannot be told apart", frame_phrase(tip));
    }
    if let Some(tip) = tip {
        return format!("these dwells do not show {} from enough sides", frame_phrase(tip));
    }
    if let Some(base) = base {
        let base_in_words = frame_phrase(base);
        let mut all = parts_without(&parts, base);
        if all.is_empty() {
            return format!("these dwells do not tie {base_in_words} down");
        }
        all.push(&base_in_words);
        return format!("{} move {seen} alike over these dwells", join_names(&all));
    }
    format!("{} move {seen} alike over these dwells", join_names(&parameter_names(terms)))
}

/// Whether a part is the frame of this name, of the only arm or (`left.base`) of one of two.
fn is_frame(part: &str, frame: &str) -> bool {
    part.strip_suffix(frame).is_some_and(|arm| arm.is_empty() || arm.ends_with('.'))
}

fn base_of<'a>(parts: &[&'a str]) -> Option<&'a str> {
    parts.iter().copied().find(|p| is_frame(p, "base"))
}

fn tip_of<'a>(parts: &[&'a str]) -> Option<&'a str> {
    parts.iter().copied().find(|p| is_frame(p, "tip"))
}

/// `the base` of the only arm, `left.base` of one of two.
fn frame_phrase(frame: &str) -> String {
    if frame.contains('.') { frame.to_owned() } else { format!("the {frame}") }
}

fn parameter_names<'a>(terms: &[Term<'a>]) -> Vec<&'a str> {
    terms.iter().map(|t| t.parameter.name.as_str()).collect()
}

fn distinct_parts<'t, 'a: 't>(terms: impl IntoIterator<Item = &'t Term<'a>>) -> Vec<&'a str> {
    let mut parts: Vec<&str> = Vec::new();
    for term in terms {
        if !parts.contains(&term.part) {
            parts.push(term.part);
        }
    }
    parts
}

fn parts_without<'a>(parts: &[&'a str], part: &str) -> Vec<&'a str> {
    parts.iter().copied().filter(|p| *p != part).collect()
}

fn other_than<'a>(parts: &[&'a str], part: &str) -> &'a str {
    parts_without(parts, part).first().copied().unwrap_or_default()
}

/// `a`, `a and b`, `a, b and c`.
fn join_names(names: &[&str]) -> String {
    match names {
        [] => String::new(),
        [one] => (*one).to_string(),
        [most @ .., last] => format!("{} and {last}", most.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::precision::undetermined::tests::{axis, parameter};
    use armcal_core::Unit;

    fn text(parts: &[(&str, f64)]) -> String {
        let parameters: Vec<Parameter> = parts
            .iter()
            .map(|(name, _)| Parameter {
                unit: if name.ends_with('d') || name.ends_with('x') { Unit::Metre } else { Unit::Radian },
                ..parameter(name)
            })
            .collect();
        let axes: Vec<Axis> = (0..parts.len()).map(|index| axis(index, 1.0)).collect();
        let shares: Vec<(usize, f64)> = parts.iter().map(|p| p.1).enumerate().collect();
        describe_direction(&shares, &axes, &parameters, &DMatrix::identity(parts.len(), parts.len()))
    }

    #[test]
    fn known_patterns_read_like_physics() {
        assert_eq!(
            text(&[("joint2.d", 0.707), ("joint3.d", -0.707)]),
            "joint2.d - joint3.d: the axes of joint2 and joint3 are parallel, moving along them is the same"
        );
        assert_eq!(
            text(&[("joint1.theta", 0.93), ("base.rz", -0.37)]),
            "joint1.theta - 0.40 base.rz: turning the zero of joint1 is the same as turning the base"
        );
        assert!(text(&[("joint4.d", 0.7), ("tip.x", 0.7)]).contains("joint4 and the tip frame"));
        assert_eq!(
            text(&[("joint1.theta", 0.6), ("board.a.rx", -0.5), ("board.a.ry", 0.4), ("board.b.ry", 0.4)]),
            "joint1.theta with board.a and board.b: turning the zero of joint1 is the same as turning what it reaches \
             for, and the boards are estimated"
        );
        assert!(text(&[("board.a.rx", 1.0), ("board.a.ry", 0.1)]).contains("one line"));
    }
}
