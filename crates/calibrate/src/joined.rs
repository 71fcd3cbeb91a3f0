//! What joint angles leave open of arms whose tips are joined to each other and to nothing else.

use crate::problem::Symmetry;
use armcal_core::Unit;
use armcal_model::Model;

/// All lengths growing by one factor about the base that is fixed: joint angles alone give shapes, not sizes. None for a
/// single arm.
pub(crate) fn scale(model: &Model, p: &[f64]) -> Option<Symmetry> {
    let arms = model.chain().arms();
    let names: Vec<&str> = arms.iter().map(|arm| arm.name.as_str()).collect();
    let [first, .., last] = names.as_slice() else { return None };
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
