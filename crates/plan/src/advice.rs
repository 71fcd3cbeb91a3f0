//! What tells two effects apart that are the same to every motion (notes/diagnosis.md, section 3).

use armcal_model::{EffectKind, Lookalikes, find};

/// The sensor or test that separates two effects, by their names: that of one of them, that of what both are lookalikes in, or
/// what tells most things apart.
pub fn sensor(a: &str, b: &str) -> &'static str {
    let kind = |name: &str| name.split([':', '@', ',']).next().and_then(find);
    let pair: Vec<&EffectKind> = [a, b].into_iter().filter_map(kind).collect();
    let own = pair.iter().map(|kind| kind.told_by).find(|told_by| !told_by.is_empty());
    let has = |of: &Lookalikes| pair.iter().filter(|kind| kind.lookalikes.contains(of)).count();
    // One event is enough: its moment is nothing that a motion could show.
    let moment = pair.iter().any(|kind| kind.lookalikes.contains(&Lookalikes::Moments));
    let shared = SEPARATED.iter().find(|(of, _)| has(of) == 2 || *of == Lookalikes::Moments && moment);
    own.or(shared.map(|(_, by)| *by))
        .unwrap_or("put a marker on the base or on a link, or record the motor currents")
}

/// What separates lookalikes, in the order in which they are looked for.
const SEPARATED: [(Lookalikes, &str); 6] = [
    (Lookalikes::LostMotion, "record the motor currents, or rest in the same poses with the motors off"),
    (Lookalikes::Springs, "put a marker on the forearm close to its joint, or lock the belt"),
    (
        Lookalikes::Moments,
        "put a static marker on the base and a second one on the tool, or move every joint widely in each recording",
    ),
    (Lookalikes::Lengths, "measure one known length, such as a bar with two markers"),
    (
        Lookalikes::Turns,
        "compare the encoder with one on the joint itself, or turn the joint over its whole range",
    ),
    (Lookalikes::Slow, "put a static marker on the base and record the temperature of the links"),
];
