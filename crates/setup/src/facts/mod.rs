//! What contradicts itself without any refit: bodies that move or stand still where they should not (`bodies`), a joint that
//! never moves, set-points read as readings (`joints`), tilts that are not the declared ones, frames far from their
//! declaration.

mod bodies;
mod joints;

use armcal_core::{Certainty, Code, Observation, Pose, Role, SetupFinding};
use armcal_stages::{Fitted, Inputs};
use armcal_table::Tilt;
use nalgebra::{Matrix3, Vector3};

/// Tilts differ from their declaration by less than this, with the mechanism as it is [rad].
const TILT_RAD: f64 = 0.07;
/// A frame this many standard errors from where it was measured to be contradicts its declaration, if it is off by as
/// much as this too [m], [rad].
const SIGMAS: f64 = 8.0;
const OFF: f64 = 5e-3;
/// Visited cavities nearer than this to one line do not show the board's normal [m].
const FLAT_M: f64 = 0.01;
/// Errors below this many times the floor say that nothing of importance is wrong.
const SOUND: f64 = 1.5;

/// Whether the errors say that nothing of importance is wrong.
pub fn is_sound(fitted: &Fitted) -> bool {
    fitted.calibration.times_floor() <= SOUND
}

/// Streams that are not what they are said to be, whatever was fitted to them; and where the errors are not `sound`, joints
/// that never move and orientations that were never filled in.
pub fn evident_mistakes(inputs: &Inputs, sound: bool) -> Vec<SetupFinding> {
    let mut all: Vec<SetupFinding> = bodies::same_body(inputs).into_iter().collect();
    all.extend(joints::speed_readings(inputs));
    all.extend(bodies::swapped_streams(inputs));
    if !sound {
        all.extend(joints::stuck_readings(inputs));
        all.extend(bodies::no_quaternion(inputs));
    }
    all
}

/// Readings of joints that look like none, beside errors: saturated, with stamps of no clock, set-points.
pub fn suspect_readings(inputs: &Inputs) -> Vec<SetupFinding> {
    let mut all = Vec::new();
    if joints::stuck_readings(inputs).is_empty() {
        all.extend(joints::saturated_readings(inputs));
    }
    all.extend(joints::wrong_stamps(inputs));
    all.extend(joints::set_points(inputs));
    all
}

/// Tilts and frames that contradict their declaration. Poses that are fitted to errors say nothing of them.
pub fn contradicted_declarations(inputs: &Inputs, fitted: &Fitted) -> Vec<SetupFinding> {
    let mut all = contradicted_tilts(inputs, fitted);
    all.extend(declared_frames(fitted));
    all
}

/// Declared tilts against the board's poses: between two recordings the board turns as its tilts say. A board without a
/// mechanism stands as it was put, and cavities on one line do not show how it turned about that.
fn contradicted_tilts(inputs: &Inputs, fitted: &Fitted) -> Vec<SetupFinding> {
    let Some(board) = inputs.board.as_ref().filter(|b| b.mechanism.is_some()) else { return Vec::new() };
    let values = fitted.calibration.fit.values();
    let pose = |r: usize| -> Option<(Pose, Pose)> {
        let seated_m = |o: &Observation| o.in_board_m().copied().filter(|_| o.dwell.recording == r);
        let seated_m: Vec<Vector3<f64>> = fitted.observations.iter().filter_map(seated_m).collect();
        if seated_m.len() < 4 || width_m(&seated_m) < FLAT_M {
            return None;
        }
        let tilt: Tilt = inputs.pipeline.recordings[r].tilt;
        Some((board.tilted(tilt).ok()?, fitted.model.board_in_world(&values, r)?))
    };
    let poses: Vec<Option<(Pose, Pose)>> = (0..inputs.seen.len()).map(pose).collect();
    let mut all = Vec::new();
    for (r, later) in poses.iter().enumerate().skip(1) {
        let (Some((declared_a, found_a)), Some((declared_b, found_b))) = (poses[0], *later) else { continue };
        // The later normal as the earlier board sees it: free of where the board stands, and of turns about its normal.
        let normal = |a: &Pose, b: &Pose| a.rotation.inverse() * b.rotation * Vector3::z();
        let (declared, found) = (normal(&declared_a, &declared_b), normal(&found_a, &found_b));
        let from_upright = |n: &Vector3<f64>| n.angle(&Vector3::z());
        let (declared_rad, found_rad) = (from_upright(&declared), from_upright(&found));
        let apart_rad = declared.angle(&found);
        if apart_rad > TILT_RAD {
            let (a, b) = (&inputs.seen[0].name, &inputs.seen[r].name);
            all.push(mistake_finding(
                Code::TiltDeclared,
                format!("recording `{b}`"),
                format!(
                    "between `{a}` and `{b}` the board's normal turned by {:.1} deg where the declared tilts say {:.1} deg, and \
                     ended {:.1} deg from where they say; mend `tilt` of these recordings (its angles, signs, or which is \
                     roll and which is pitch)",
                    found_rad.to_degrees(),
                    declared_rad.to_degrees(),
                    apart_rad.to_degrees()
                ),
            ));
        }
    }
    all
}

/// Root mean square distance of points from the line that fits them best.
fn width_m(points_m: &[Vector3<f64>]) -> f64 {
    let count = points_m.len().max(1) as f64;
    let mean_m = points_m.iter().sum::<Vector3<f64>>() / count;
    let scatter_m2 =
        points_m.iter().map(|p| (p - mean_m) * (p - mean_m).transpose()).sum::<Matrix3<f64>>() / count;
    let along = scatter_m2.symmetric_eigenvalues();
    (along.sum() - along.max()).max(0.0).sqrt()
}

/// Measured frames that the fit has moved far from their measurement. What a bound holds back of the arm's own, a frame takes:
/// then it says nothing.
fn declared_frames(fitted: &Fitted) -> Vec<SetupFinding> {
    let estimates = &fitted.calibration.fit.estimates;
    if estimates.iter().any(|e| e.at_bound && e.parameter.role == Role::Robot) {
        return Vec::new();
    }
    let mut all = Vec::new();
    for e in estimates {
        let (Role::KnownFrame, Some(sigma)) = (e.parameter.role, e.parameter.prior_sigma) else { continue };
        let off = e.value - e.parameter.nominal;
        if off.abs() > SIGMAS * sigma && off.abs() > OFF && e.parameter.free {
            let unit = e.parameter.unit;
            all.push(possible_finding(
                Code::FrameDeclared,
                e.parameter.name.clone(),
                format!(
                    "{} ends {:.2} {} from where it was measured, {:.0} times the declared standard error; measure it again, \
                     declare its true standard error, or look for what moved",
                    e.parameter.name,
                    unit.to_display(off),
                    unit.display_symbol(),
                    off.abs() / sigma
                ),
            ));
        }
    }
    all
}

/// What is worth a look; the result may stand.
fn possible_finding(code: Code, subject: String, message: String) -> SetupFinding {
    SetupFinding { certainty: Certainty::Possible, ..mistake_finding(code, subject, message) }
}

fn mistake_finding(code: Code, subject: String, message: String) -> SetupFinding {
    let certainty = Certainty::Mistake;
    SetupFinding {
        code,
        subject,
        message,
        certainty,
        before_mm: None,
        after_mm: None,
        alternatives: Vec::new(),
        gives_way: false,
        mend: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_cavities_and_a_row_of_them_have_no_width() {
        let row: Vec<Vector3<f64>> = (0..6).map(|k| Vector3::new(0.05, 0.03, 0.0) * f64::from(k)).collect();
        assert!(width_m(&row[..2]) < 1e-9 && width_m(&row) < 1e-8);
        let square = [[0.0, 0.0], [0.1, 0.0], [0.0, 0.1], [0.1, 0.1]].map(|[x, y]| Vector3::new(x, y, 0.0));
        assert!((width_m(&square) - 0.05).abs() < 1e-12, "{}", width_m(&square));
    }
}
