//! Which entries are one name, and which are one cause.

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use super::{own, planted, quick};
use crate::weigh::{Weighed, weigh};

/// A weighed problem whose first entries are called so; all of them were given.
fn named(specs: &[&str]) -> Weighed {
    let mut weighed = weigh(&planted(&[], 0, 1), &quick());
    weighed.entries.truncate(specs.len());
    assert_eq!(weighed.entries.len(), specs.len());
    weighed.entries.iter_mut().zip(specs).for_each(|(e, spec)| e.candidate.spec = (*spec).to_string());
    weighed.given = specs.len();
    weighed
}

#[test]
fn when_an_event_happened_and_a_shape_are_no_other_cause() {
    let one = |a: &str, b: &str| {
        let weighed = named(&[a, b]);
        assert_eq!(weighed.one_cause(0, 1), weighed.one_cause(1, 0), "{a} {b}");
        assert!(weighed.one_cause(0, 0) && weighed.one_cause(1, 1), "{a} {b}");
        weighed.one_cause(0, 1)
    };
    assert!(one("tool_shift@1.17", "tool_shift@1.18"));
    assert!(one("zero_slip:2@1", "zero_slip:2@1.17-25"), "in a recording, and in some of its dwells");
    assert!(one("marker_shift:hand@0.25", "marker_shift:hand@0.24"));
    assert!(one("periodic:3,frequency=3", "periodic:3,frequency=4.5"));
    assert!(one("periodic:3", "periodic:3,frequency=4.5"), "with a shape and without");
    assert!(!one("zero_slip:2@1", "zero_slip:3@1"), "another joint");
    assert!(!one("tool_shift@1", "frame_shift@1"), "another thing at the same moment");
    assert!(!one("marker_shift:hand@0.25", "marker_shift:elbow@0.25"), "another marker");
    assert!(!one("backlash:1", "backlash:2") && !one("backlash:1", "backlash:1+backlash:2"));
}

#[test]
fn moments_are_names_of_their_own_and_values_of_a_search_are_not() {
    let mut weighed = named(&["tool_shift@1.17", "tool_shift@1.18", "periodic:3", "periodic:3,frequency=4"]);
    assert!(weighed.one_cause(0, 1) && !weighed.one_name(0, 1));
    assert!(weighed.one_cause(2, 3) && !weighed.one_name(2, 3), "both were given");
    weighed.given = 3;
    assert!(weighed.one_name(2, 3), "one was searched for");
}

#[test]
fn every_entry_of_a_catalogue_without_events_is_a_cause_of_its_own() {
    let p = planted(&[], 0, 1);
    let weighed = weigh(&p, &quick());
    let at = |spec: &str| super::entry(&weighed, spec);
    let (play, drift) = (own(&p, "backlash:1").spec, own(&p, "zero_drift:1").spec);
    assert!(!weighed.one_cause(at(&play), at(&drift)));
}
