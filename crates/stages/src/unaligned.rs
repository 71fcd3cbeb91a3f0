//! Clocks that cannot be aligned because something is read wrongly: the tip's speed is then another one than the arm's.

use crate::readings::LEAP_RAD;
use crate::still::{still_tip, value_range};
use armcal_core::units::DEGREES;
use armcal_core::{FEW_PER_S, JointSamples, PoseSamples, Samples};
use std::f64::consts::TAU;

/// With the right reading, the speeds agree like this.
const AGREES: f64 = 0.97;
/// Correlations this close to each other are the same.
const SAME: f64 = 1e-3;
/// Rates of a sensor's clock: its frames stamped as if they came at another rate that sensors have.
pub const CLOCK_RATES: [f64; 12] =
    [0.5, 2.0 / 3.0, 0.75, 0.8, 5.0 / 6.0, 1.2, 1.25, 4.0 / 3.0, 1.5, 2.0, 0.25, 4.0];
/// Ratios of gears and units that are mistaken for none.
const RATIOS: [f64; 5] = [2.0, 3.0, 5.0, 57.2958, 100.0];

/// What the clocks are aligned with.
#[derive(Clone)]
pub struct Reading {
    /// The joints.
    pub joints: JointSamples,
    /// The body that is taken for the tip.
    pub tip: PoseSamples,
    /// Factor on the model's lengths.
    pub lengths: f64,
}

/// The one change with which the clocks align, in a sentence without its full stop; or what is seen of the streams that
/// keeps them from it. None where there is neither. `correlation` aligns: of the tip's speed with that of the nominal
/// arm, if it can.
pub fn what_would_align(
    samples: &Samples,
    correlation: &(dyn Fn(&Reading) -> Option<f64> + Sync),
) -> Option<String> {
    // What is lost between the readings, no change brings back: whatever fits then fits by chance.
    if let Some(few) = low_rate_note(samples) {
        return Some(few);
    }
    let tip = samples.tip.clone()?;
    let now = Reading { joints: samples.joints.clone(), tip, lengths: 1.0 };
    let mut tried: Vec<(f64, String)> = Vec::new();
    // With a body that stands still no reading of the joints aligns but by chance: it is another one, or read in another unit.
    let still = still_body_note(samples);
    let mut all = if still.is_none() { of_joints(&now) } else { Vec::new() };
    all.extend(of_bodies(&now, samples));
    for (changed, words) in all {
        tried.extend(correlation(&changed).filter(|c| *c >= AGREES).map(|c| (c, words)));
    }
    // Of those that do as well, the first: it is the simplest.
    let best = tried.iter().map(|t| t.0).fold(0.0, f64::max);
    let like = |t: &(f64, String)| t.0 >= best - SAME.max(0.25 * (1.0 - best));
    let first = tried.into_iter().find(like);
    first.map(|(c, words)| format!("{words} the clocks align (correlation {c:.3})")).or(still)
}

fn of_joints(now: &Reading) -> Vec<(Reading, String)> {
    let joints = &now.joints;
    let n = joints.joint_rad.len();
    let named = |j: usize| format!("joint {} ({})", j + 1, joints.names.get(j).map_or("", String::as_str));
    let mut all = Vec::new();
    let mut with_joints = |change: &dyn Fn(&mut JointSamples), words: String| {
        let mut changed = now.clone();
        change(&mut changed.joints);
        all.push((changed, words));
    };
    for j in 0..n {
        let words = format!("[joint-sign] with the sign of {} reversed", named(j));
        with_joints(&|s| s.joint_rad[j].iter_mut().for_each(|q| *q = -*q), words);
        for k in j + 1..n {
            let words = format!("[joint-order] with {} and {} exchanged", named(j), named(k));
            with_joints(&|s| s.joint_rad.swap(j, k), words);
        }
        for ratio in RATIOS {
            let words =
                format!("[joint-scale] with the reading of {} divided by {ratio} (a gear ratio)", named(j));
            with_joints(&|s| s.joint_rad[j].iter_mut().for_each(|q| *q /= ratio), words);
        }
        if let Some(leap_rad) = largest_leap_rad(&joints.joint_rad[j]) {
            let words = format!(
                "[encoder-wrap] with the leaps of {} (by up to {:.1} deg from one reading to the next: its reading wraps, or \
                 jumps) undone",
                named(j),
                leap_rad.to_degrees()
            );
            with_joints(&|s| without_leaps(&mut s.joint_rad[j]), words);
        }
    }
    for by in (1..n).filter(|_| n > 2) {
        let order: Vec<&str> =
            (0..n).filter_map(|j| joints.names.get((j + by) % n).map(String::as_str)).collect();
        let words = format!("[joint-order] with the joints read in the order {}", order.join(", "));
        with_joints(&|s| s.joint_rad.rotate_left(by), words);
    }
    for (factor, words) in [
        (DEGREES, "radians where degrees are declared"),
        (1.0 / DEGREES, "degrees where radians are declared"),
        (TAU, "turns where radians are declared"),
    ] {
        let words = format!("[joint-unit] with the joints' readings taken for {words}");
        with_joints(&|s| s.joint_rad.iter_mut().flatten().for_each(|q| *q *= factor), words);
    }
    let words = "[wrong-field] with the joints' readings taken for speeds and summed over time";
    with_joints(&integrate_speeds, words.to_owned());
    all
}

/// Units of tip and model, and other bodies that may be the tip.
fn of_bodies(now: &Reading, samples: &Samples) -> Vec<(Reading, String)> {
    let mut all = Vec::new();
    for (factor, words) in [(1e3, "a thousand times as large"), (1e-3, "a thousandth")] {
        let mut changed = now.clone();
        changed.tip.position_m.iter_mut().for_each(|p| *p *= factor);
        all.push((
            changed,
            format!("[position-unit] with the tip's positions {words} (the unit of the tip)"),
        ));
        let words = format!("[length-unit] with the lengths of the model {words} (the unit of the model)");
        all.push((Reading { lengths: factor, ..now.clone() }, words));
    }
    for rate in CLOCK_RATES {
        let mut changed = now.clone();
        changed.tip.slow_down(rate);
        let words = format!(
            "[clock-rate] with the stamps of the tip taken for those of a clock that runs {rate:.4} times as fast (a rate that was declared \
             wrongly: `clock_rate = {rate:.4}` under [streams.tip])"
        );
        all.push((changed, words));
    }
    for (role, body) in [("base", &samples.base), ("table", &samples.table)] {
        if let Some(body) = body.as_ref().filter(|body| !body.is_empty()) {
            let words = format!(
                "[streams-swapped] with the body read as the {role} taken for the tip (they are mistaken for each other)"
            );
            all.push((Reading { tip: body.clone(), ..now.clone() }, words));
        }
    }
    all
}

/// The largest leap, where a joint leaps at all [rad].
fn largest_leap_rad(reading_rad: &[f64]) -> Option<f64> {
    let leaps = reading_rad.windows(2).map(|w| (w[1] - w[0]).abs());
    leaps.filter(|leap| *leap > LEAP_RAD).reduce(f64::max)
}

fn without_leaps(reading_rad: &mut [f64]) {
    let (mut undone, mut before) = (0.0, reading_rad.first().copied().unwrap_or_default());
    for q in reading_rad {
        let step = *q - before;
        before = *q;
        if step.abs() > LEAP_RAD {
            undone -= step;
        }
        *q += undone;
    }
}

/// Readings as speeds, summed by the trapezoidal rule from zero.
fn integrate_speeds(joints: &mut JointSamples) {
    let seconds: Vec<f64> = joints.time_ns.windows(2).map(|w| (w[1] - w[0]) as f64 * 1e-9).collect();
    for column in &mut joints.joint_rad {
        let mut angle = 0.0;
        let mut before = column.first().copied().unwrap_or_default();
        for (q, dt) in column.iter_mut().skip(1).zip(&seconds) {
            angle += 0.5 * (before + *q) * dt;
            before = *q;
            *q = angle;
        }
        column.iter_mut().take(1).for_each(|q| *q = 0.0);
    }
}

/// A body that stands still while the arm moves.
fn still_body_note(samples: &Samples) -> Option<String> {
    let tip = samples.tip.as_ref()?;
    let first = tip.position_m.first()?;
    let tip_m = tip.position_m.iter().map(|p| (p - first).norm()).fold(0.0, f64::max);
    let columns = samples.joints.joint_rad.iter();
    let turned_rad = columns.map(|column| value_range(column.iter().copied())).fold(0.0, f64::max);
    still_tip(tip_m, turned_rad).map(|message| format!("[streams-swapped] {message}"))
}

/// A stream that is too thin to show movements.
fn low_rate_note(samples: &Samples) -> Option<String> {
    let tip = samples.tip.as_ref().map(|tip| ("tip", &tip.time_ns));
    let thin = |(role, time_ns): (&str, &Vec<i64>)| {
        let seconds = (time_ns.last()? - time_ns.first()?) as f64 * 1e-9;
        let per_s = (time_ns.len() - 1) as f64 / seconds;
        (per_s < FEW_PER_S).then(|| {
            format!(
                "[low-rate] the stream of the {role} has {} messages in {seconds:.0} s, {per_s:.2} messages per second: too \
                 few to show the movements; most were lost or never recorded",
                time_ns.len()
            )
        })
    };
    [("joints", &samples.joints.time_ns)].into_iter().chain(tip).find_map(thin)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaps_are_undone_and_motion_is_kept() {
        let angle: Vec<f64> = (0..200).map(|i| 0.02 * f64::from(i)).collect();
        let mut wrapped: Vec<f64> = angle.iter().map(|q| q.rem_euclid(1.0)).collect();
        assert!((largest_leap_rad(&wrapped).expect("it wraps") - 0.98).abs() < 1e-9);
        without_leaps(&mut wrapped);
        // Each undone leap loses the one step of 0.02 that it hid.
        assert!(angle.iter().zip(&wrapped).all(|(a, b)| (a - b).abs() < 0.02 * 4.0));
        assert_eq!(largest_leap_rad(&angle), None);
    }

    #[test]
    fn speeds_sum_to_angles() {
        let time_ns: Vec<i64> = (0..=1000).map(|i| i * 10_000_000).collect();
        let t = |ns: i64| ns as f64 * 1e-9;
        let speed = time_ns.iter().map(|ns| t(*ns).cos()).collect();
        let mut joints =
            JointSamples { time_ns: time_ns.clone(), joint_rad: vec![speed], ..JointSamples::default() };
        integrate_speeds(&mut joints);
        let off = time_ns.iter().zip(&joints.joint_rad[0]).map(|(ns, q)| (t(*ns).sin() - q).abs());
        assert!(off.fold(0.0, f64::max) < 1e-4);
    }
}
