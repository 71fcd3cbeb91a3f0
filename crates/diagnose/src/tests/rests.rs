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

#[test]
fn the_least_probable_ratio_is_that_of_the_f_distribution() {
    // scipy.stats.f.sf(4, 10, 20), (1, 10, 20), (4, 30, 60)
    for (sums, joint, p) in [
        (&[[10.0, 10.0, 10.0], [40.0, 10.0, 10.0]][..], 1, 0.004_039_541_130_205_944),
        (&[[10.0, 10.0, 10.0]], 0, 0.475_500_468_432_891_6),
        (&[[120.0, 30.0, 30.0], [40.0, 10.0, 10.0], [0.0, 0.0, 0.0]], 0, 2.451_104_862_446_716_5e-6),
    ] {
        let (found, value) = least_probable(sums).expect("a joint with errors");
        assert_eq!(found, joint);
        assert!((value / p - 1.0).abs() < 1e-6, "{value} {p}");
    }
    assert_eq!(least_probable(&[]), None);
}

#[test]
fn what_is_not_along_a_joint_lies_in_two_directions_across_it() {
    assert_eq!(add_dwell_errors([1.0, 2.0, 3.0], 4.0, 10.0), [5.0, 5.0, 4.0]);
}
