//! What joint angles leave open of arms that are joined to each other, or brought into unknown places, and to nothing else.

use crate::objective::problem::Symmetry;
use armcal_core::{Parameter, Unit};
use armcal_model::Model;
use nalgebra::Vector3;

/// All lengths growing by one factor about the base that is fixed: joint angles alone give shapes, not sizes.
pub(crate) fn scale_symmetry(model: &Model, p: &[f64]) -> Symmetry {
    let bases: Vec<String> = match model.chain().arms() {
        [] => vec!["base".to_owned()],
        arms => arms.iter().map(|arm| format!("{}.base", arm.name)).collect(),
    };
    let base_m: Vec<_> =
        (0..bases.len()).map(|arm| model.arm_base_in_world(p, arm).translation.vector).collect();
    // Which base a parameter is of, and which coordinate of it.
    let of_base = |p: &Parameter| {
        let (frame, axis) = coordinate(p)?;
        Some((bases.iter().position(|base| base == frame)?, axis))
    };
    let is_free = |base: &usize| {
        model.parameters().iter().any(|p| p.free && of_base(p).is_some_and(|(of, _)| of == *base))
    };
    let fixed = (0..bases.len()).find(|base| !is_free(base)).unwrap_or(0);
    // Of a place where it is as seen from that base, of a plane along its normal.
    let of_place = |p_at: &Parameter| {
        let (frame, axis) = coordinate(p_at)?;
        let axis = axis?;
        let (place, _, is_plane) = model.places().find(|(_, name, _)| *name == frame)?;
        let place = model.place_in_world(p, place);
        let from_m = place.translation.vector - base_m[fixed];
        Some(if is_plane { (place.rotation * Vector3::z()).dot(&from_m) } else { from_m[axis] })
    };
    let grows = |(parameter, value): (&Parameter, &f64)| match of_base(parameter) {
        Some((base, Some(axis))) => (base_m[base] - base_m[fixed])[axis],
        None if parameter.unit == Unit::Metre => of_place(parameter).unwrap_or(*value),
        _ => 0.0,
    };
    let direction = model.parameters().iter().zip(p).map(grows).collect();
    let of = match model.chain().arms() {
        [first, .., last] => format!("of {}, of {} and between their bases", first.name, last.name),
        _ if model.places().next().is_some() => {
            "of the arm, and how far the places are that it was brought to".to_owned()
        }
        _ => "of the robot".to_owned(),
    };
    let such = match model.places().next() {
        Some(_) => "the distance of two points",
        None => "a rigid link between the tips",
    };
    let text = format!(
        "scale (every length {of}, in proportion): growing together changes no joint angle, and no length is known; measure \
         one, such as {such}"
    );
    Symmetry { direction, text }
}

/// The frame that a parameter is of, and which coordinate of its position, where it is one.
fn coordinate(p: &Parameter) -> Option<(&str, Option<usize>)> {
    let (frame, quantity) = p.name.rsplit_once('.')?;
    Some((frame, ["x", "y", "z"].iter().position(|axis| *axis == quantity)))
}
