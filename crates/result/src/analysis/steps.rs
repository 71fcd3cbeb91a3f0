//! The falling error: nominal, calibrated, and with each effect that the diagnosis found.

use crate::proto::saturating_u32;
use crate::proto::{Step, Steps};
use crate::recording_names::RecordingNames;
use crate::run::Run;
use armcal_calibrate::SideErrors;
use armcal_core::ErrorStats;

/// The mean errors, step by step.
pub fn steps(run: &Run) -> Steps {
    let calibration = &run.calibration;
    let held_out = calibration.held_out();
    let side =
        |c: &armcal_calibrate::Calibration| -> SideErrors { if held_out { c.holdout } else { c.train } };
    let mut rows = vec![
        ("nominal".to_owned(), side(calibration).nominal),
        ("calibration".to_owned(), side(calibration).fitted),
    ];
    let names = run.recording_names();
    for (step, name) in run.steps.iter().zip(run.step_effects()) {
        rows.push((effects_label(&names, &name), side(&step.calibration).fitted));
    }
    let before = std::iter::once(None).chain(rows.iter().map(|(_, errors)| Some(errors.mean_m)));
    let steps = rows
        .iter()
        .zip(before)
        .enumerate()
        .map(|(n, ((adds, e), before))| error_step(n, adds, e, before))
        .collect();
    Steps {
        timestamp: None,
        steps,
        noise_floor_mm: super::round_significant(super::or_zero(calibration.noise_floor_m * 1e3)),
        held_out,
    }
}

/// Effects as people call them: error curves by their joints, and not by how they are made.
pub fn effects_label(names: &RecordingNames, effects: &[String]) -> String {
    let joint_of = |effect: &String| {
        let joint = effect.strip_prefix("error_curve:")?.split(',').next()?;
        joint.chars().all(|c| c.is_ascii_digit()).then(|| joint.to_owned())
    };
    let joints: Vec<String> = effects.iter().filter_map(joint_of).collect();
    let curves = match joints.as_slice() {
        [] => None,
        [joint] => Some(format!("error curve of joint {joint}")),
        joints => Some(format!("error curves of joints {}", joints.join(", "))),
    };
    let others = effects.iter().filter(|effect| joint_of(effect).is_none()).map(|effect| names.label(effect));
    curves.into_iter().chain(others).collect::<Vec<_>>().join(" + ")
}

fn error_step(number: usize, adds: &str, e: &ErrorStats, before_m: Option<f64>) -> Step {
    let falls = before_m.filter(|b| *b > 0.0).map_or(0.0, |b| 100.0 * (b - e.mean_m) / b);
    let mm = |m: f64| super::round_significant(super::or_zero(m * 1e3));
    Step {
        number: saturating_u32(number),
        adds: adds.to_owned(),
        mean_mm: mm(e.mean_m),
        rms_mm: mm(e.rms_m),
        p95_mm: mm(e.p95_m),
        max_mm: mm(e.max_m),
        falls_by_percent: super::round_significant(super::or_zero(falls)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_curves_are_called_by_their_joints() {
        let names = RecordingNames::new(["normal".to_owned()]);
        let told = |effects: &[&str]| {
            effects_label(&names, &effects.iter().map(|e| (*e).to_owned()).collect::<Vec<_>>())
        };
        assert_eq!(told(&["error_curve:2,harmonics=60,typical=0.00024"]), "error curve of joint 2");
        assert_eq!(
            told(&["error_curve:2,harmonics=60", "error_curve:1,harmonics=60", "arm_compliance"]),
            "error curves of joints 2, 1 + arm_compliance"
        );
        assert_eq!(told(&["backlash:1", "backlash:2"]), "backlash:1 + backlash:2");
    }
}
