//! Checks of base, tip and boards against an accepted result: a table that was bumped between two jobs.
//!
//! Poses are in the sensor's frame. Where base and boards all moved by one rigid motion, the sensor's frame did (cameras
//! calibrated anew) and the rig stands as it stood: that breaks no limit.

use super::limits::Limits;
use super::measured::Check;
use super::reasons;
use super::reference::{Calibrated, FittedFrame};
use armcal_core::Pose;
use armcal_core::printable_name;
use armcal_result::Run;

/// A frame in both results.
#[derive(Debug, Clone, PartialEq)]
struct Shift {
    name: String,
    /// Distance between the origins [m].
    by_m: f64,
    /// Angle between the axes [rad].
    by_rad: f64,
    /// Joint standard deviations [m], [rad].
    sigma: [f64; 2],
}

impl Shift {
    fn of(name: &str, then: FittedFrame, now: FittedFrame) -> Shift {
        let sigma = [now.sigma_m.hypot(then.sigma_m), now.sigma_rad.hypot(then.sigma_rad)];
        let between = then.pose.inverse() * now.pose;
        Shift {
            name: name.to_owned(),
            by_m: between.translation.vector.norm(),
            by_rad: between.rotation.angle(),
            sigma,
        }
    }

    /// The change that the uncertainties do not explain [m], [rad]; 0 otherwise.
    fn real(&self, sigmas: f64) -> [f64; 2] {
        let beyond = |by: f64, sigma: f64| if by > sigmas * sigma { by } else { 0.0 };
        [beyond(self.by_m, self.sigma[0]), beyond(self.by_rad, self.sigma[1])]
    }
}

/// How every frame of both results moved.
struct Shifts {
    /// In the order of the result: base, tip, boards.
    frames: Vec<Shift>,
    /// The common motion of base and boards, where the rig moved as one.
    common: Option<Shift>,
}

/// Positions and rotations of base, tip and boards.
pub fn frame_shifts(run: &Run, now: &Calibrated, limits: &Limits) -> Vec<Check> {
    let Some(reference) = &limits.reference else { return Vec::new() };
    let section = &limits.section;
    let shifts = Shifts::of(reference, now, limits);
    let rows = [
        ("max_frame_shift_mm", 0, 1e3, "mm", section.max_frame_shift_mm),
        ("max_frame_shift_deg", 1, 1f64.to_degrees(), "deg", section.max_frame_shift_deg),
    ];
    rows.into_iter()
        .filter_map(|(name, which, to_display, unit, limit)| {
            let limit = limit?;
            let real = |s: &Shift| s.real(limits.shift_sigmas)[which] * to_display;
            let largest = shifts.judged().map(real).fold(0.0, f64::max);
            let measured = (!shifts.frames.is_empty()).then_some(largest);
            let moved: Vec<&Shift> = shifts.judged().filter(|s| real(s) > limit).collect();
            let check = Check::at_most(name, measured, limit, unit);
            Some(check.saying(shifts.said(&moved), || shifts.causes(&moved, reasons::is_model_adequate(run))))
        })
        .collect()
}

impl Shifts {
    fn of(reference: &Calibrated, now: &Calibrated, limits: &Limits) -> Shifts {
        let both = |name: &str| Some((reference.frame(name)?, now.frame(name)?));
        let shift = |name: &str| both(name).map(|(then, now)| Shift::of(name, then, now));
        let frames: Vec<Shift> = now.frame_names().filter_map(shift).collect();
        let common = both("base").zip(shift("base")).filter(|((then, now_base), base)| {
            // Where the boards are, seen from the base.
            let seen = |f: FittedFrame, base: Pose| FittedFrame { pose: base.inverse() * f.pose, ..f };
            let mut boards = now.frame_names().filter(|n| is_board(n)).filter_map(both).peekable();
            exceeds_limits(base, limits)
                && boards.peek().is_some()
                && boards.all(|(a, b)| {
                    !exceeds_limits(&Shift::of("", seen(a, then.pose), seen(b, now_base.pose)), limits)
                })
        });
        Shifts { frames, common: common.map(|(_, base)| base) }
    }

    /// The frames that can break a limit.
    fn judged(&self) -> impl Iterator<Item = &Shift> {
        self.frames.iter().filter(|s| self.common.is_none() || s.name == "tip")
    }

    fn said(&self, moved: &[&Shift]) -> String {
        let n = self.frames.len();
        match (moved, &self.common) {
            ([], _) if n == 0 => {
                "the reference has none of this result's frames, so nothing was compared; are the recordings named alike?"
                    .to_owned()
            }
            ([], Some(common)) => format!(
                "base and boards moved as one by {}: the sensor's frame is another (cameras calibrated anew), the rig stands \
                 as it stood",
                shift_text(common)
            ),
            ([], None) => format!("none of {n} frames (base, tip, boards) moved by more than is allowed or explained"),
            (moved, _) => {
                let names: Vec<String> = moved.iter().map(|s| printable_name(&s.name)).collect();
                format!("{} of {n} frames moved: {}", moved.len(), names.join(", "))
            }
        }
    }

    fn causes(&self, moved: &[&Shift], healthy: bool) -> Vec<String> {
        let is_moved = |test: &dyn Fn(&str) -> bool| moved.iter().any(|s| test(&s.name));
        let (base, boards) = (is_moved(&|n| n == "base"), is_moved(&is_board));
        let cause = |s: &Shift| match (s.name.as_str(), base, boards) {
            _ if !healthy && s.sigma != [0.0; 2] => {
                "It is fitted with the arm, and this fit does not explain its data: what is missing there may have dragged \
                 it along."
            }
            ("tip", ..) => "The tool was exchanged, remounted or bent.",
            ("base", _, false) => {
                "The boards did not: the robot's foot slid, or the markers on its base were bumped."
            }
            ("base", _, true) => {
                "So did boards, otherwise: look at the robot's foot, its markers and the cameras."
            }
            (_, false, _) => "The base did not: the table was bumped or pushed, or its markers were.",
            (_, true, _) => "So did the base, otherwise: look at the table, its markers and the cameras.",
        };
        moved
            .iter()
            .map(|s| {
                printable_name(&format!(
                    "`{}` moved by {} since the reference. {}",
                    s.name,
                    shift_text(s),
                    cause(s)
                ))
            })
            .collect()
    }
}

fn is_board(name: &str) -> bool {
    name.starts_with("board.")
}

fn shift_text(shift: &Shift) -> String {
    format!("{:.2} mm and {:.3} deg", shift.by_m * 1e3, shift.by_rad.to_degrees())
}

/// Whether a frame moved by more than a limit that is given.
fn exceeds_limits(shift: &Shift, limits: &Limits) -> bool {
    let [by_m, by_rad] = shift.real(limits.shift_sigmas);
    let beyond = |by: f64, limit: Option<f64>| limit.is_some_and(|limit| by > limit);
    beyond(by_m * 1e3, limits.section.max_frame_shift_mm)
        || beyond(by_rad.to_degrees(), limits.section.max_frame_shift_deg)
}

#[cfg(test)]
mod tests {
    use super::*;
    use armcal_config::CheckSection;
    use armcal_core::RollPitchYaw;
    use nalgebra::{Translation3, UnitQuaternion, Vector3};
    use serde_json::{Value, json};

    fn pose(xyz_m: [f64; 3], turn_deg: f64) -> Pose {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * turn_deg.to_radians());
        Pose::from_parts(Translation3::from(Vector3::from(xyz_m)), turn)
    }

    /// A base whose height is known to 3 mm, and two boards.
    fn rig(base: Pose, boards: [Pose; 2]) -> Calibrated {
        let frame = |name: &str, pose: &Pose| {
            let RollPitchYaw { xyz_m, rpy_deg } = pose.into();
            json!({ "frame": name, "parent": "world", "xyz_m": xyz_m, "rpy_deg": rpy_deg })
        };
        let height = json!({ "name": "base.z", "unit": "m", "value": 0.7, "sigma": 0.003, "at_bound": false,
                             "role": "known_frame" });
        let frames: Value =
            [frame("base", &base), frame("board.a", &boards[0]), frame("board.b", &boards[1])].into();
        let summary = json!({ "schema": armcal_result::summary::SCHEMA, "pipeline": "rig",
                              "fit": { "parameters": [height] }, "frames": frames });
        serde_json::from_value(summary).expect("a summary")
    }

    fn limits() -> Limits {
        let section = CheckSection {
            max_frame_shift_mm: Some(1.0),
            max_frame_shift_deg: Some(0.1),
            ..CheckSection::default()
        };
        Limits { section, allowed: Vec::new(), reference: None, shift_sigmas: 4.0 }
    }

    const BASE: [f64; 3] = [1.2, -0.4, 0.7];
    const BOARDS: [[f64; 3]; 2] = [[1.6, -0.2, 0.8], [1.5, -0.3, 0.9]];

    fn shifts(base: Pose, boards: [Pose; 2]) -> Shifts {
        let reference = rig(pose(BASE, 30.0), BOARDS.map(|at| pose(at, 30.0)));
        Shifts::of(&reference, &rig(base, boards), &limits())
    }

    fn names(shifts: &Shifts) -> Vec<&str> {
        let moved = shifts.judged().filter(|s| s.real(4.0) != [0.0, 0.0]);
        moved.map(|s| s.name.as_str()).collect()
    }

    #[test]
    fn a_bumped_board_moved_by_its_distance_and_turn() {
        let bumped = pose([1.6 + 0.003, -0.2 - 0.004, 0.8], 30.0 + 2.0);
        let shifts = shifts(pose(BASE, 30.0), [bumped, pose(BOARDS[1], 30.0)]);
        assert_eq!(names(&shifts), ["board.a"]);
        let board = shifts.judged().find(|s| s.name == "board.a").expect("the board");
        assert!((board.by_m - 0.005).abs() < 1e-12 && (board.by_rad.to_degrees() - 2.0).abs() < 1e-9);
    }

    #[test]
    fn a_sensor_frame_that_moved_moves_everything_and_breaks_nothing() {
        let motion = pose([0.05, 0.02, -0.01], 3.0);
        let boards = BOARDS.map(|at| motion * pose(at, 30.0));
        let shifts = shifts(motion * pose(BASE, 30.0), boards);
        assert!(shifts.common.is_some() && names(&shifts).is_empty());
        // With one board bumped besides, it is no common motion.
        let mut boards = boards;
        boards[1].translation.vector.x += 0.004;
        assert!(self::shifts(motion * pose(BASE, 30.0), boards).common.is_none());
    }

    #[test]
    fn a_shift_within_its_uncertainty_is_none() {
        let boards = BOARDS.map(|at| pose(at, 30.0));
        let lifted = |by_m: f64| pose([BASE[0], BASE[1], BASE[2] + by_m], 30.0);
        // 4 times sqrt(3^2 + 3^2) mm is 16.97 mm.
        assert!(names(&shifts(lifted(0.0169), boards)).is_empty());
        assert_eq!(names(&shifts(lifted(0.0171), boards)), ["base"]);
    }
}
