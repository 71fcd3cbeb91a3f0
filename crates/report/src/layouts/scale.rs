//! What the axes of joints reach to.

use super::drawn::{What, tip_moving_joints};
use crate::findings::Findings;
use armcal_core::robust::{median, percentile};
use armcal_result::proto::JointErrors;

/// A joint whose errors are told so many times less sharply than those of the sharpest has a scale of its own.
const BLUNT: f64 = 2.5;
/// Share of the errors of a joint that its axis reaches to, and of what effects do, which has a shape and few far points.
const MOST: f64 = 0.95;
const MOST_OF_EFFECTS: f64 = 0.98;
/// How much further it goes.
const ROOM: f64 = 1.1;

/// The same for all joints of a unit that move the tip as well as each other; one that hardly does, as the last one of a
/// wrist that only turns the tool, would flatten the others. What effects do is compared with what they leave, which is on
/// the same scale.
pub(super) fn axis_range(f: &Findings, m: &JointErrors, what: What) -> Option<[f64; 2]> {
    let usual = |m: &JointErrors| median(&m.sigma);
    let unit = || tip_moving_joints(f).filter(|other| other.unit == m.unit && !other.sigma.is_empty());
    let sharpest = unit().map(usual).fold(f64::INFINITY, f64::min);
    let sharp = |m: &JointErrors| usual(m) <= BLUNT * sharpest;
    let (scale, shared, most) = match what {
        What::Error => (What::Error, sharp(m), MOST),
        What::After | What::Effect => (What::Effect, false, MOST_OF_EFFECTS),
    };
    let beside = unit().filter(|other| if shared { sharp(other) } else { other.number == m.number });
    // Of each joint by itself: the errors of one are not far points among those of the others.
    let far = |m: &JointErrors| percentile(&scale.whole(m).iter().map(|e| e.abs()).collect::<Vec<_>>(), most);
    let large = nice_up(ROOM * beside.map(far).fold(0.0, f64::max));
    (large > 0.0).then_some([-large, large])
}

/// The next number that an axis may end in: of these, the viewers' steps (1, 2 or 5 and powers of ten, at most ten of them) meet
/// zero and both ends, also where every second is left out for want of room. From -0.06 they would go -0.06, -0.05, 0, and
/// from -0.1 there would be -0.1, -0.06, -0.02, 0.02.
fn nice_up(value: f64) -> f64 {
    const ENDS: [&str; 4] = ["2", "4", "8", "20"];
    let exponent = value.log10().floor();
    if !exponent.is_finite() {
        return value;
    }
    // By its digits, because powers of ten are no floating-point numbers.
    let ends = ENDS.iter().filter_map(|digits| format!("{digits}e{exponent}").parse::<f64>().ok());
    ends.into_iter().find(|end| *end >= value).unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axis_ends_in_a_round_number_above_the_data() {
        assert_eq!(
            [0.12, 0.18, 2.0, 2.1, 9e-7, 81.0, 0.0].map(nice_up),
            [0.2, 0.2, 2.0, 4.0, 2e-6, 200.0, 0.0]
        );
    }

    #[test]
    fn steps_of_the_viewers_meet_zero_and_the_ends() {
        for end in [0.2, 0.4, 0.8] {
            // Chart.js: the range by how many steps have room, up to the next of 1, 2, 5, 10. Four rows of plots on a laptop have
            // room for eight.
            for room in 8..=10 {
                let rough: f64 = 2.0 * end / f64::from(room);
                let power = 10_f64.powf(rough.log10().floor());
                let step =
                    [1.0, 2.0, 5.0, 10.0].map(|s| s * power).into_iter().find(|s| *s >= rough * (1.0 - 1e-9));
                let steps = end / step.expect("10 is enough");
                assert!((steps - steps.round()).abs() < 1e-9, "{end}, {room}: {step:?}");
                assert!(
                    (steps.round() as u32).is_multiple_of(2),
                    "{end}, {room}: every second step leaves zero out"
                );
            }
        }
    }
}
