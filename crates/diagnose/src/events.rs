//! Events: effects that begin, or act, at a moment that their names tell.

use armcal_model::{Since, place_and_moment};

/// Dwells by which one event may be told elsewhere by another effect, or once other effects are in the model.
const MOVED: usize = 3;

/// What an event does where, and when; none for what always acts.
fn parse_event(spec: &str) -> Option<(&str, Since)> {
    let (place, since) = place_and_moment(spec)?;
    Some((place, since?))
}

/// When an event acts.
pub(crate) fn event_since(spec: &str) -> Option<Since> {
    parse_event(spec).map(|(_, since)| since)
}

/// When an event acts that ends again.
pub(crate) fn temporary_since(spec: &str) -> Option<Since> {
    event_since(spec).filter(|since| matches!(since, Since::Dwells { .. }))
}

/// Whether two names are one effect, told a few dwells apart.
pub(crate) fn is_same_event(from: &str, to: &str) -> bool {
    let (Some((place, from)), Some((other, to))) = (parse_event(from), parse_event(to)) else { return false };
    place == other && from.near(&to, MOVED)
}

/// The names that tell of one moment, where there are at least two of it: a collision or a restart changes joints, tool
/// and frames at once.
pub(crate) fn simultaneous_events<'n>(names: &[&'n str]) -> Vec<Vec<&'n str>> {
    let mut moments: Vec<(Since, Vec<&str>)> = Vec::new();
    for name in names {
        let Some((_, since)) = parse_event(name) else { continue };
        match moments.iter_mut().find(|(moment, _)| moment.near(&since, MOVED)) {
            Some((_, of_it)) => of_it.push(name),
            None => moments.push((since, vec![name])),
        }
    }
    moments.into_iter().map(|(_, of_it)| of_it).filter(|of_it| of_it.len() > 1).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_event_told_a_few_dwells_apart_is_the_same() {
        assert!(
            is_same_event("tool_shift@1.17", "tool_shift@1.20")
                && !is_same_event("tool_shift@1.17", "tool_shift@1.21")
        );
        assert!(
            !is_same_event("tool_shift@1.17", "tool_shift@2.17")
                && !is_same_event("tool_shift@1.17", "zero_slip:2@1.17")
        );
        assert!(is_same_event("zero_slip:2@1.17-25", "zero_slip:2@1.16-26"));
        assert!(!is_same_event("zero_slip:2@1.17-25", "zero_slip:2@1.17-29"));
        assert!(
            !is_same_event("zero_slip:2@1.17-25", "zero_slip:2@1.17")
                && !is_same_event("backlash:1", "backlash:1")
        );
    }

    #[test]
    fn effects_of_one_moment_are_one_event() {
        let names = ["zero_slip:2@1.17", "backlash:1", "tool_shift@1.18", "zero_slip:3@2", "zero_slip:1@1"];
        assert_eq!(simultaneous_events(&names), [["zero_slip:2@1.17", "tool_shift@1.18"]]);
        assert_eq!(simultaneous_events(&["zero_slip:3@2", "tool_shift@2"]).len(), 1);
        assert!(simultaneous_events(&names[1..]).is_empty());
    }
}
