//! What tells two effects apart that are the same to every motion (notes/diagnosis.md, section 3).

use armcal_model::{EffectKind, Lookalikes, catalogue, find};

/// The sensor or test that separates two effects, by their names: that of one of them, that of what both are lookalikes in, or
/// what tells most things apart.
pub fn separating_sensor(a: &str, b: &str) -> &'static str {
    let kind = |name: &str| name.split([':', '@', ',']).next().and_then(find);
    let pair: Vec<&EffectKind> = [a, b].into_iter().filter_map(kind).collect();
    // In the order of the catalogue, so that it does not matter which of the two comes first.
    let is_one = |kind: &&&EffectKind| pair.iter().any(|own| own.name == kind.name);
    let own = catalogue().iter().filter(is_one).map(|kind| kind.told_by).find(|told_by| !told_by.is_empty());
    let of = |alike: &Lookalikes| pair.iter().filter(|kind| kind.lookalikes.contains(alike)).count();
    let shared = SEPARATED.iter().find(|(alike, least, _)| of(alike) >= *least);
    own.or(shared.map(|(.., by)| *by))
        .unwrap_or("put a marker on the base or on a link, or record the motor currents")
}

/// What separates lookalikes, and how many of the two have to be such, in the order in which they are looked for. One event is
/// enough: its moment is nothing that a motion could show.
const SEPARATED: [(Lookalikes, usize, &str); 6] = [
    (Lookalikes::LostMotion, 2, "record the motor currents, or rest in the same poses with the motors off"),
    (Lookalikes::Springs, 2, "put a marker on the forearm close to its joint, or lock the belt"),
    (
        Lookalikes::Moments,
        1,
        "put a static marker on the base and a second one on the tool, or move every joint widely in each recording",
    ),
    (Lookalikes::Lengths, 2, "measure one known length, such as a bar with two markers"),
    (
        Lookalikes::Turns,
        2,
        "compare the encoder with one on the joint itself, or turn the joint over its whole range",
    ),
    (Lookalikes::Slow, 2, "put a static marker on the base and record the temperature of the links"),
];

#[cfg(test)]
mod tests {
    use super::separating_sensor;

    #[test]
    fn what_separates_two_effects_does_not_depend_on_their_order() {
        let cases = [
            ("base_compliance", "undeclared_load@1", "put a marker on the robot's base"),
            ("backlash:1", "backlash:2", "record the motor currents, or rest"),
            ("compliance:2", "link_bending:2", "put a marker on the forearm"),
            ("compliance:2", "tool_shift@1.17", "put a static marker on the base and a second one"),
            ("sensor_scale", "warm_up", "measure one known length"),
            ("periodic:1,frequency=3", "error_curve:1", "compare the encoder"),
            ("zero_drift:1", "frame_drift", "put a static marker on the base and record the temperature"),
            ("backlash:1", "compliance:2", "put a marker on the base or on a link"),
        ];
        for (a, b, by) in cases {
            assert!(separating_sensor(a, b).starts_with(by), "{a} and {b}: {}", separating_sensor(a, b));
            assert_eq!(separating_sensor(a, b), separating_sensor(b, a), "{a} and {b}");
        }
    }
}
