//! What joint angles leave open of arms that are joined to each other, or brought into unknown places, and to nothing else.

use crate::problem::Symmetry;
use armcal_core::Unit;
use armcal_model::Model;
use nalgebra::Vector3;

/// All lengths growing by one factor about the base that is fixed: joint angles alone give shapes, not sizes.
pub(crate) fn scale(model: &Model, p: &[f64]) -> Option<Symmetry> {
    let arms = model.chain().arms();
    let names: Vec<&str> = arms.iter().map(|arm| arm.name.as_str()).collect();
    let [first, .., last] = names.as_slice() else { return Some(of_one_arm(model, p)) };
    let base_m: Vec<_> =
        (0..arms.len()).map(|arm| model.arm_base_in_world(p, arm).translation.vector).collect();
    let is_free = |name: &&&str| {
        let of_base = format!("{name}.base.");
        model.parameters().iter().any(|p| p.free && p.name.starts_with(&of_base))
    };
    let fixed = names.iter().position(|name| !is_free(&name)).unwrap_or(0);
    let grows = |(parameter, value): (&armcal_core::Parameter, &f64)| {
        let of_base = names.iter().enumerate().find_map(|(arm, name)| {
            let quantity = parameter.name.strip_prefix(name)?.strip_prefix(".base.")?;
            let axis = ["x", "y", "z"].iter().position(|axis| *axis == quantity)?;
            Some((base_m[arm] - base_m[fixed])[axis])
        });
        of_base.unwrap_or(if parameter.unit == Unit::Metre { *value } else { 0.0 })
    };
    let direction = model.parameters().iter().zip(p).map(grows).collect();
    let text = format!(
        "scale (every length of {first}, of {last} and between their bases, in proportion): growing together changes no joint \
         angle, and no length is known; measure one, such as a rigid link between the tips"
    );
    Some(Symmetry { direction, text })
}

/// Of a single arm: its lengths, and the places that it was brought to as seen from its base.
fn of_one_arm(model: &Model, p: &[f64]) -> Symmetry {
    let base_m = model.base_in_world(p).translation.vector;
    let grows = |(parameter, value): (&armcal_core::Parameter, &f64)| {
        let of_place = model.places().find_map(|(place, name, is_plane)| {
            let quantity = parameter.name.strip_prefix(name)?.strip_prefix('.')?;
            let axis = ["x", "y", "z"].iter().position(|axis| *axis == quantity)?;
            let place = model.place_in_world(p, place);
            let from_base_m = place.translation.vector - base_m;
            Some(if is_plane { (place.rotation * Vector3::z()).dot(&from_base_m) } else { from_base_m[axis] })
        });
        let of_base = parameter.name.starts_with("base.").then_some(0.0);
        of_place.or(of_base).unwrap_or(if parameter.unit == Unit::Metre { *value } else { 0.0 })
    };
    let direction = model.parameters().iter().zip(p).map(grows).collect();
    let text = "scale (every length of the arm and the distances of the places it was brought to, in proportion): growing together \
                changes no joint angle, and no length is known; measure one, such as the distance of two points"
        .to_owned();
    Symmetry { direction, text }
}
