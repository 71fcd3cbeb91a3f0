//! Which change explains the errors: how far they must fall, and which of several is believed.

use super::hypotheses::Freedom;
use super::trial::Misfit;
use std::cmp::Ordering;

/// Errors below this many times the floor give no reason to look.
pub const WORTH_LOOKING: f64 = 1.5;
/// A change that undoes a mistake divides the errors by at least this.
const LEAST_FACTOR: f64 = 3.0;
/// Changes that fit within this factor of each other are not told apart.
pub const ALIKE_FACTOR: f64 = 1.3;
/// Errors that differ by less than this factor are the same.
pub const SAME_FACTOR: f64 = 1.05;
/// Below this many times the floor, frames that are let go are possible, not sure.
const FRAMES_FROM: f64 = 5.0;
/// A model that predicts the mean of what was measured, whatever the joints do, errs by this much of its spread.
const KNOWS_NOTHING: f64 = 1.0;
/// What errs by more than this share of the way that the joints move it may have joints in no unit of angles, or an axis that
/// is another.
const GROSS: f64 = 0.03;
/// Errors within this many times the floor leave nothing to explain.
const NOTHING_LEFT: f64 = 1.2;
/// With this many dwells at the board and in no cavity, and this share of all there, the board is in doubt.
const HOMELESS: usize = 5;
const HOMELESS_SHARE: f64 = 0.1;
/// A change of the board that seats this many times as many dwells, the errors no larger than at the floor, undoes a
/// mistake.
const SEATED_FACTOR: f64 = 1.4;
/// Where nothing could be fitted, fewer dwells than this that a change finds a place for say nothing: their places are free.
const LEAST_USED: usize = 10;
/// With a change that explains the errors they come within this many times the floor.
pub const EXPLAINED: f64 = 10.0;
/// The same of a change that estimates something.
const ESTIMATED_EXPLAINED: f64 = 3.0;

/// Whether the errors, or dwells at the board that no cavity wants, give a reason to look.
pub fn in_doubt(m: &Misfit) -> bool {
    let at_board = (m.seated + m.homeless) as f64;
    let homeless = m.homeless >= HOMELESS && m.homeless as f64 >= HOMELESS_SHARE * at_board;
    m.mean_m.is_infinite() || m.times_floor() >= WORTH_LOOKING || homeless
}

/// Whether the errors are so large a share of the way that each joint alone moves the arm that it may hardly be this one.
pub fn is_gross(m: &Misfit, moved_m: f64) -> bool {
    m.mean_m > GROSS * moved_m
}

/// Whether a change divides the errors as only the right one does; or lets far more dwells be used, no worse.
pub fn explains_errors(before: &Misfit, after: &Misfit) -> bool {
    // Dwells that fit as they are, and dwells that no change can place, hide in a mean of logarithms what happens to the
    // rest: then no dwell may be lost for it.
    let keeps = after.used >= before.used && after.homeless <= before.homeless && after.log < before.log;
    let all = before.log - after.log >= LEAST_FACTOR.ln();
    let enough = before.used > 0 || after.used >= LEAST_USED;
    // What shrinks all data shrinks all errors: they are judged by the spread of the data.
    let least = before.of_spread().min(KNOWS_NOTHING) / LEAST_FACTOR;
    let falls = enough && after.of_spread() <= least && (all || keeps);
    let seats = after.seated as f64 >= SEATED_FACTOR * before.seated as f64
        && before.seated > 0
        && after.homeless < before.homeless
        && after.times_floor() <= before.times_floor().max(WORTH_LOOKING)
        && after.of_spread() <= KNOWS_NOTHING / LEAST_FACTOR;
    falls || seats
}

/// Whether a change that loses dwells could explain the errors, if it left no more than this of their logarithms.
pub fn could_explain(before: &Misfit, least_log: f64) -> bool {
    before.log - least_log >= LEAST_FACTOR.ln()
}

/// Whether a change comes near the floor, or divides the errors so much that the rest is another mistake. What estimates
/// a number always takes a share of an error that is not its own.
pub fn far_enough(before: &Misfit, freedom: Freedom, after: &Misfit) -> bool {
    let near = match freedom {
        Freedom::Discrete => EXPLAINED,
        Freedom::Number | Freedom::Frame => ESTIMATED_EXPLAINED,
    };
    after.times_floor() < near || after.log < before.log - EXPLAINED.ln()
}

/// Whether errors are so large that what explains them with this freedom is a mistake and no share that it takes of
/// something physical.
pub fn is_certain(before: &Misfit, freedom: Freedom) -> bool {
    freedom != Freedom::Frame || before.times_floor() >= FRAMES_FROM
}

/// Whether a change loses no dwell and leaves nothing to explain.
pub fn at_the_floor(before: &Misfit, after: &Misfit) -> bool {
    let keeps = after.used >= before.used && after.homeless <= before.homeless;
    keeps && after.times_floor() <= NOTHING_LEFT && after.of_spread() < before.of_spread()
}

/// Whether physics, `within` its bounds, explains the errors with less freedom than what is believed, or better.
pub fn physics_explains_better((freedom, log): (Freedom, f64), within: &[(Freedom, f64)]) -> bool {
    within.iter().any(|(own, own_log)| match own.cmp(&freedom) {
        Ordering::Less => *own_log <= log + LEAST_FACTOR.ln() / 2.0,
        Ordering::Equal => *own_log < log - ALIKE_FACTOR.ln(),
        Ordering::Greater => false,
    })
}

/// The least freedom that comes within reach of the best fit; `tried` are freedoms and logarithmic misfits.
pub fn most_parsimonious(tried: &[(Freedom, f64)]) -> Option<usize> {
    let lowest = |of: &[usize]| of.iter().map(|k| tried[*k].1).min_by(f64::total_cmp);
    let all: Vec<usize> = (0..tried.len()).collect();
    let reach = lowest(&all)? + LEAST_FACTOR.ln() / 2.0;
    let near: Vec<usize> = all.into_iter().filter(|k| tried[*k].1 <= reach).collect();
    let least = near.iter().map(|k| tried[*k].0).min()?;
    let free: Vec<usize> = near.into_iter().filter(|k| tried[*k].0 == least).collect();
    // Of what cannot be told apart the first in the list: a joint's sign is wrong more often than a row of the model.
    let alike = lowest(&free)? + ALIKE_FACTOR.ln();
    free.into_iter().find(|k| tried[*k].1 <= alike)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// So many dwells, all of them used and seated, with errors of so many times a floor of 0.1 mm.
    fn seated(n: usize, times_floor: f64) -> Misfit {
        let (log, mean_m) = (times_floor.ln(), times_floor * 1e-4);
        Misfit { log, mean_m, floor_m: 1e-4, spread_m: 0.15, used: n, seated: n, homeless: 0 }
    }

    #[test]
    fn errors_at_the_floor_give_no_reason_to_look() {
        assert!(!in_doubt(&seated(100, 1.49)));
        assert!(in_doubt(&seated(100, 1.5)));
        assert!(in_doubt(&Misfit::of_nothing()));
    }

    #[test]
    fn dwells_that_no_cavity_wants_are_a_reason_from_five_and_a_tenth_on() {
        let with =
            |seated: usize, homeless: usize| in_doubt(&Misfit { seated, homeless, ..self::seated(60, 1.0) });
        assert!(!with(36, 4), "four are too few, though a tenth");
        assert!(with(45, 5), "five of fifty are a tenth");
        assert!(!with(46, 5), "five of fifty-one are less than a tenth");
        assert!(with(0, 5));
    }

    #[test]
    fn a_third_of_the_error_explains_and_a_little_more_does_not() {
        let before = seated(100, 30.0);
        assert!(explains_errors(&before, &seated(100, 9.99)));
        assert!(!explains_errors(&before, &seated(100, 10.01)));
    }

    #[test]
    fn where_nothing_was_fitted_a_handful_of_dwells_explains_nothing() {
        assert!(!explains_errors(&Misfit::of_nothing(), &seated(9, 1.0)));
        assert!(explains_errors(&Misfit::of_nothing(), &seated(10, 1.0)));
        assert!(explains_errors(&seated(5, 30.0), &seated(5, 1.0)));
    }

    #[test]
    fn a_mean_that_falls_for_a_few_large_errors_alone_explains_only_if_no_dwell_is_lost() {
        // A few dwells dominate the mean; the logarithm of the others hardly moves.
        let before = Misfit { log: 1.0, ..seated(100, 30.0) };
        let kept = Misfit { log: 0.9, ..seated(100, 5.0) };
        assert!(explains_errors(&before, &kept));
        assert!(!explains_errors(&before, &Misfit { used: 99, ..kept }), "it lost a dwell");
        assert!(!explains_errors(&before, &Misfit { homeless: 1, ..kept }), "one has no place now");
        assert!(!explains_errors(&before, &Misfit { log: 1.0, ..kept }), "the others are no better");
        assert!(!explains_errors(&before, &Misfit { mean_m: 1.1e-3, ..kept }), "the mean fell too little");
        let divided = Misfit { log: 1.0 - 3.01f64.ln(), used: 80, ..seated(80, 5.0) };
        assert!(explains_errors(&before, &divided), "every error is a third: dwells may change their places");
    }

    #[test]
    fn what_loses_dwells_must_leave_a_third_of_every_error() {
        let before = Misfit { log: 2.0, ..seated(100, 30.0) };
        assert!(could_explain(&before, 2.0 - 1.01 * 3f64.ln()));
        assert!(!could_explain(&before, 2.0 - 0.99 * 3f64.ln()));
        let after = Misfit { log: 2.0 - 0.99 * 3f64.ln(), ..seated(60, 5.0) };
        assert!(!explains_errors(&before, &after), "what could not explain does not");
    }

    #[test]
    fn seating_far_more_dwells_explains_if_they_sit_well() {
        let before = Misfit { seated: 50, homeless: 50, ..seated(50, 1.2) };
        let after = Misfit { homeless: 0, ..seated(70, 1.4) };
        assert!(explains_errors(&before, &after));
        assert!(!explains_errors(&before, &Misfit { seated: 69, ..after }), "less than 1.4 times as many");
        assert!(!explains_errors(&before, &Misfit { homeless: 50, ..after }), "as many have no place");
        assert!(!explains_errors(&before, &Misfit { mean_m: 1.6e-4, ..after }), "they do not sit well");
        let coarse = Misfit { mean_m: 4e-4, ..before };
        assert!(explains_errors(&coarse, &Misfit { mean_m: 4e-4, ..after }), "no worse than before");
        assert!(
            !explains_errors(&Misfit { seated: 0, ..before }, &after),
            "of none, any number is many times as much"
        );
    }

    #[test]
    fn a_number_must_come_nearer_the_floor_than_a_sign() {
        let before = seated(100, 25.0);
        assert!(far_enough(&before, Freedom::Discrete, &seated(100, 9.9)));
        assert!(!far_enough(&before, Freedom::Discrete, &seated(100, 10.0)));
        for freedom in [Freedom::Number, Freedom::Frame] {
            assert!(far_enough(&before, freedom, &seated(100, 2.9)));
            assert!(!far_enough(&before, freedom, &seated(100, 3.0)));
        }
        // What is left may be another mistake, where the errors fell to a tenth.
        let before = seated(100, 300.0);
        assert!(far_enough(&before, Freedom::Frame, &seated(100, 29.9)));
        assert!(!far_enough(&before, Freedom::Frame, &seated(100, 30.1)));
    }

    #[test]
    fn the_least_freedom_within_reach_is_believed_and_the_first_of_those_alike() {
        use Freedom::{Discrete, Frame, Number};
        assert_eq!(most_parsimonious(&[]), None);
        // exp(0.5 ln 3) = 1.73 is the reach of the lesser freedom.
        assert_eq!(most_parsimonious(&[(Frame, 0.0), (Number, 0.54), (Discrete, 0.56)]), Some(1));
        assert_eq!(most_parsimonious(&[(Frame, 0.0), (Number, 0.56), (Discrete, 0.54)]), Some(2));
        // Within a factor of 1.3 (0.262) the first in the list.
        assert_eq!(most_parsimonious(&[(Discrete, 0.26), (Discrete, 0.0)]), Some(0));
        assert_eq!(most_parsimonious(&[(Discrete, 0.27), (Discrete, 0.0)]), Some(1));
    }

    #[test]
    fn a_change_that_loses_no_dwell_and_leaves_nothing_ends_at_the_floor() {
        let before = seated(100, 2.5);
        assert!(at_the_floor(&before, &seated(100, 1.2)));
        assert!(!at_the_floor(&before, &seated(100, 1.21)));
        assert!(!at_the_floor(&before, &seated(99, 1.0)));
        assert!(!at_the_floor(&before, &Misfit { homeless: 1, ..seated(100, 1.0) }));
    }

    #[test]
    fn frames_are_sure_of_large_errors_only() {
        assert!(
            is_certain(&seated(100, 1.5), Freedom::Discrete)
                && is_certain(&seated(100, 1.5), Freedom::Number)
        );
        assert!(
            !is_certain(&seated(100, 4.99), Freedom::Frame) && is_certain(&seated(100, 5.0), Freedom::Frame)
        );
        assert!(is_certain(&Misfit::of_nothing(), Freedom::Frame));
    }

    #[test]
    fn physics_outdoes_with_less_freedom_or_a_better_fit() {
        use Freedom::{Discrete, Frame, Number};
        assert!(!physics_explains_better((Frame, 0.0), &[]));
        assert!(
            physics_explains_better((Frame, 0.0), &[(Number, 0.54)])
                && !physics_explains_better((Frame, 0.0), &[(Number, 0.56)])
        );
        assert!(
            physics_explains_better((Number, 0.0), &[(Number, -0.27)])
                && !physics_explains_better((Number, 0.0), &[(Number, -0.26)])
        );
        assert!(!physics_explains_better((Discrete, 0.0), &[(Number, -3.0), (Frame, -3.0)]));
    }

    proptest! {
        #[test]
        fn what_is_believed_is_never_far_behind_the_best(
            logs in prop::collection::vec((0usize..3, -3.0f64..3.0), 1..20)
        ) {
            let all = [Freedom::Discrete, Freedom::Number, Freedom::Frame];
            let tried: Vec<_> = logs.iter().map(|(f, log)| (all[*f], *log)).collect();
            let chosen = most_parsimonious(&tried).expect("there is one");
            let lowest = tried.iter().map(|t| t.1).fold(f64::INFINITY, f64::min);
            prop_assert!(tried[chosen].1 <= lowest + 0.5 * 3f64.ln() + 1e-12);
        }

        #[test]
        fn what_scales_measured_positions_and_errors_alike_is_judged_as_if_it_did_not(
            before in 1.0f64..300.0, after in 0.1f64..300.0, n in 10usize..300, scale in 1e-3f64..1e3
        ) {
            let scaled = |m: Misfit| {
                Misfit { mean_m: scale * m.mean_m, floor_m: scale * m.floor_m, spread_m: scale * m.spread_m, ..m }
            };
            let (before, after) = (seated(n, before), seated(n, after));
            // Where the two are alike, rounding decides.
            prop_assume!((before.of_spread() / after.of_spread() / LEAST_FACTOR - 1.0).abs() > 1e-9);
            prop_assert_eq!(explains_errors(&before, &scaled(after)), explains_errors(&before, &after));
            prop_assert!(!explains_errors(&before, &scaled(before)), "nothing but the scale is another");
            let in_one_point = Misfit { spread_m: after.mean_m, ..after };
            prop_assert!(!explains_errors(&Misfit::of_nothing(), &in_one_point));
        }

        #[test]
        fn nothing_that_got_worse_explains(before in 1.0f64..300.0, worse in 1.0f64..10.0, n in 1usize..300) {
            prop_assert!(!explains_errors(&seated(n, before), &seated(n, before * worse)));
        }
    }
}
