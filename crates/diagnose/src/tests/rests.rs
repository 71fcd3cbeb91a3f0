//! What counts as a gap in which a joint may rest.

use super::*;

#[test]
fn a_joint_rests_in_gaps_that_are_open_and_of_which_no_part_has_been_told() {
    let play = EffectSpec { kind: "backlash".into(), ..EffectSpec::default() };
    let led = play.clone().with("seated", 0.0);
    assert!(may_rest(&play, 1e-3) && may_rest(&led, 1e-3));
    assert!(may_rest(&play, -1e-3), "a gap whose width came out below zero is still told by its name alone");
    assert!(!may_rest(&led, 0.0), "led in the hand of a servo, it is none");
    assert!(!may_rest(&play.with(REST, 0.5), 1e-3) && !may_rest(&led.with(REST, 0.5), 1e-3));
}
