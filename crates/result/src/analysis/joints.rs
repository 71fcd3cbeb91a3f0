//! What every dwell says about each joint, by direction of arrival: hysteresis opens into two branches.

use super::course::recorded_min;
use crate::points::Point;
use crate::proto::JointErrors;
use crate::proto::saturating_u32;
use crate::run::Run;
use armcal_calibrate::{BLURRED, ImpliedError, implied_joint_errors};
use armcal_core::robust::median;
use nalgebra::Vector3;

const DEGREES: &str = "deg";
/// Up to here an angle counts as small.
const SMALL_ANGLE_DEG: f64 = 10.0;

/// Whether a joint of these implied errors moves the tip, so that page and layouts draw it. An implied error is linear in the
/// angle, so of one that is usually large it says nothing but that the joint has no leverage, as one that only turns a ball
/// about its middle.
pub fn moves_tip(unit: &str, errors: impl IntoIterator<Item = f64>) -> bool {
    let sizes: Vec<f64> = errors.into_iter().map(f64::abs).collect();
    !sizes.is_empty() && (unit != DEGREES || median(&sizes) < SMALL_ANGLE_DEG)
}

/// A joint whose gravity torque moves by less than this share of the one that moves most hardly feels gravity.
const SMALLEST_TORQUE: f64 = 0.03;

/// Whether gravity's torque on each joint moves enough over the dwells for page and layouts to draw errors over it: a
/// compliance shows where the torque differs, not where it is large.
pub fn feels_gravity(torques_nm: &[Vec<f64>]) -> Vec<bool> {
    let spread = |torque_nm: &Vec<f64>| {
        let known = torque_nm.iter().filter(|t| t.is_finite());
        let (low, high) = known.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), t| (l.min(*t), h.max(*t)));
        (high - low).max(0.0)
    };
    let spreads_nm: Vec<f64> = torques_nm.iter().map(spread).collect();
    let largest_nm = spreads_nm.iter().copied().fold(0.0, f64::max);
    spreads_nm.iter().map(|&s| s > SMALLEST_TORQUE * largest_nm).collect()
}

/// Gravity's torque on every joint, `[joint][observation]` [N m].
pub fn torques_nm(run: &Run) -> Vec<Vec<f64>> {
    let of = |o| run.model.drivers(&run.session, o).torque().to_vec();
    let driven: Vec<_> = run.observations.iter().map(of).collect();
    let joints = 0..run.model.joint_count();
    joints.map(|j| driven.iter().map(|torque| torque[j].total_nm()).collect()).collect()
}

/// What one dwell says about all joints.
struct Seen {
    before: Vec<Option<ImpliedError>>,
    /// With everything found; as `before` when nothing was.
    after: Vec<Option<ImpliedError>>,
    /// What the effects found do; as `before` when nothing was.
    effect: Vec<Option<ImpliedError>>,
}

/// One entry a joint; `torques_nm` are those of [`torques_nm`].
pub fn joint_errors(
    run: &Run,
    points: &[Point],
    in_time: &[usize],
    torques_nm: &[Vec<f64>],
) -> Vec<JointErrors> {
    let fitted = run.calibration.fit.values();
    let last = run
        .steps
        .last()
        .map(|step| (&step.model, step.calibration.fit.values(), step.values_without_effects(&run.model)));
    let seen: Vec<Seen> = points
        .iter()
        .map(|point| {
            let o = point.observation;
            let implied = |model, p: &[f64], r: &Vector3<f64>| implied_joint_errors(model, p, o, r);
            let before = implied(&run.model, &fitted, &point.residual.fitted_m);
            let after = match (&last, point.steps_m.last()) {
                (Some((model, p, _)), Some(residual_m)) => implied(model, p, residual_m),
                _ => before.clone(),
            };
            let effect = match (&last, &point.effect_m) {
                (Some((model, _, p)), Some(effect_m)) => implied(model, p, effect_m),
                _ => before.clone(),
            };
            Seen { before, after, effect }
        })
        .collect();
    let time_min = recorded_min(run, points);
    let of_joint = |j: usize| errors_of_joint(run, j, points, in_time, &seen, (&time_min, &torques_nm[j]));
    (0..run.model.joint_count()).map(of_joint).collect()
}

fn errors_of_joint(
    run: &Run,
    j: usize,
    points: &[Point],
    in_time: &[usize],
    seen: &[Seen],
    (time_min, torque_nm): (&[f64], &[f64]),
) -> JointErrors {
    let sigmas: Vec<f64> = seen.iter().filter_map(|s| s.before[j].map(|e| e.sigma)).collect();
    let usual = median(&sigmas);
    let sharp = |i: usize| {
        let implied = (seen[i].before[j]?, seen[i].after[j]?, seen[i].effect[j]?);
        (implied.0.sigma <= BLURRED * usual && points[i].observation.joint_rad[j].is_finite())
            .then_some(implied)
    };
    let drawn: Vec<usize> = in_time.iter().copied().filter(|&i| sharp(i).is_some()).collect();
    let unit = run.model.chain().joint_unit(j);
    let mut m = JointErrors {
        joint: run.model.chain().joint_names()[j].clone(),
        number: saturating_u32(j + 1),
        unit: unit.display_symbol().into(),
        left_out: saturating_u32(points.len() - drawn.len()),
        effort_nm: drawn.iter().filter_map(|&i| points[i].observation.effort_of(j)).collect(),
        ..Default::default()
    };
    if m.effort_nm.len() < drawn.len() {
        m.effort_nm.clear();
    }
    for i in drawn {
        let Some((before, after, effect)) = sharp(i) else { continue };
        let o = points[i].observation;
        m.recording_index.push(saturating_u32(o.dwell.recording));
        m.dwell.push(saturating_u32(o.dwell.dwell));
        m.reading.push(unit.to_display(o.joint_rad[j]));
        m.torque_nm.push(super::or_zero(torque_nm[i]));
        m.time_min.push(time_min[i]);
        m.arrival.push(o.arrival.get(j).map_or(0, |a| a.sign() as i32));
        m.error.push(unit.to_display(before.error));
        m.sigma.push(unit.to_display(before.sigma));
        if !run.steps.is_empty() {
            m.error_after.push(unit.to_display(after.error));
            m.effect.push(unit.to_display(effect.error));
        }
    }
    [m.positive, m.negative, m.unknown] = [1, -1, 0].map(|sign| of_arrival(sign, &m.arrival, &m.error));
    [m.positive_after, m.negative_after, m.unknown_after] =
        [1, -1, 0].map(|sign| of_arrival(sign, &m.arrival, &m.error_after));
    [m.positive_effect, m.negative_effect, m.unknown_effect] =
        [1, -1, 0].map(|sign| of_arrival(sign, &m.arrival, &m.effect));
    m
}

/// The errors of one direction of arrival, NaN in the place of the others: a plot has one x for all its series.
fn of_arrival(sign: i32, arrival: &[i32], error: &[f64]) -> Vec<f64> {
    error.iter().zip(arrival).map(|(e, s)| if *s == sign { *e } else { f64::NAN }).collect()
}

#[cfg(test)]
mod tests {
    use super::{feels_gravity, moves_tip};

    #[test]
    fn a_large_torque_that_stays_the_same_shows_no_compliance() {
        let still = vec![40.0, 40.2, f64::NAN];
        let moving = vec![-5.0, 5.0, 1.0];
        let vertical = vec![0.0; 3];
        assert_eq!(feels_gravity(&[still, moving, vertical]), [false, true, false]);
        assert_eq!(feels_gravity(&[vec![], vec![0.0, 0.0]]), [false, false]);
    }

    #[test]
    fn a_joint_with_large_implied_errors_has_no_leverage_and_a_slide_has() {
        assert!(moves_tip("deg", [0.2, -0.7, 170.0]));
        assert!(!moves_tip("deg", [12.0, -90.0, 0.1]));
        assert!(moves_tip("mm", [12.0, -90.0]));
        assert!(!moves_tip("deg", []) && !moves_tip("mm", []), "a joint of which no dwell says anything");
    }
}
