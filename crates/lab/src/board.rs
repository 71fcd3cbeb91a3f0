//! The calibration board: as drawn, as machined, as tilted.

use crate::random::{Purpose, Stream};
use crate::screw::{Line, pose_from_axes, rotate_vector};
use crate::{LabError, checks};
use armcal_core::Pose;
use armcal_recording::input;
use nalgebra::Vector3;
use serde::Deserialize;
use std::path::Path;

/// A board with its cavities.
#[derive(Debug, Clone, PartialEq)]
pub struct Board {
    /// Cavities in the order of the file.
    pub cavities: Vec<Cavity>,
    /// Clearance of the tip in a cavity, per visit and axis, 1 sigma [m].
    pub seat_sigma_m: f64,
    /// Tolerance of a cavity's position that the file declares, per axis, 1 sigma [m].
    pub declared_sigma_m: f64,
    mechanism: Option<TiltMechanism>,
}

/// One cavity, in the frame of the board [m].
#[derive(Debug, Clone, PartialEq)]
pub struct Cavity {
    /// Its name.
    pub name: String,
    /// Where the drawing has the centre of the seated tip.
    pub drawn_m: Vector3<f64>,
    /// Where it was machined.
    pub true_m: Vector3<f64>,
}

#[derive(Debug, Clone, PartialEq)]
struct TiltMechanism {
    roll: Line,
    pitch: Line,
    max_roll_deg: f64,
    max_pitch_deg: f64,
}

/// The board file, as far as the lab needs it.
#[derive(Deserialize)]
struct BoardFile {
    #[serde(default)]
    cavity_sigma_mm: f64,
    #[serde(default)]
    seat_sigma_mm: f64,
    mechanism: Option<MechanismTable>,
    cavities: Vec<CavityTable>,
}

#[derive(Deserialize)]
struct MechanismTable {
    pivot_xyz_mm: [f64; 3],
    roll_axis: [f64; 3],
    pitch_axis: [f64; 3],
    max_roll_deg: f64,
    max_pitch_deg: f64,
}

#[derive(Deserialize)]
struct CavityTable {
    name: String,
    xyz_mm: [f64; 3],
}

impl Board {
    /// Reads a board file and machines one such board: every cavity off by its tolerance, the file's or `true_mm`.
    pub fn machine(path: &Path, seed: u64, true_mm: Option<f64>) -> Result<Board, LabError> {
        let file: BoardFile = checks::parse_toml("board file", &read_drawing(path)?, path)?;
        checks::check_not_negative("cavity_sigma_mm", file.cavity_sigma_mm)?;
        checks::check_not_negative("seat_sigma_mm", file.seat_sigma_mm)?;
        if file.cavities.is_empty() {
            return Err(checks::value_error("cavities", format!("{} has none", path.display())));
        }
        let tolerance_mm = true_mm.unwrap_or(file.cavity_sigma_mm);
        let mut tolerance = Stream::new(seed, Purpose::Board, 0);
        let cavities = file
            .cavities
            .into_iter()
            .map(|cavity| {
                let drawn_m = Vector3::from(cavity.xyz_mm) * 1e-3;
                let true_m = drawn_m + tolerance.normal3() * (tolerance_mm * 1e-3);
                Cavity { name: cavity.name, drawn_m, true_m }
            })
            .collect();
        let mechanism = file.mechanism.map(TiltMechanism::new).transpose()?;
        Ok(Board {
            cavities,
            seat_sigma_m: file.seat_sigma_mm * 1e-3,
            declared_sigma_m: file.cavity_sigma_mm * 1e-3,
            mechanism,
        })
    }

    /// The tilted board in the frame in which it lies flat at zero tilt: first rolled, then pitched, about the
    /// mechanism's two lines.
    pub fn tilted(&self, roll_deg: f64, pitch_deg: f64) -> Result<Pose, LabError> {
        let Some(mechanism) = &self.mechanism else {
            return if roll_deg == 0.0 && pitch_deg == 0.0 {
                Ok(Pose::identity())
            } else {
                Err(checks::value_error(
                    "recordings",
                    "asks for a tilt, but the board file has no [mechanism]".into(),
                ))
            };
        };
        Ok(mechanism.pose(roll_deg.to_radians(), pitch_deg.to_radians()))
    }

    /// Whether there is a mechanism that tilts it.
    pub fn tilts(&self) -> bool {
        self.mechanism.is_some()
    }

    /// Checks a declared tilt against the limits of the mechanism.
    pub fn check_tilt(&self, recording: &str, roll_deg: f64, pitch_deg: f64) -> Result<(), LabError> {
        let Some(mechanism) = &self.mechanism else { return Ok(()) };
        for (axis, angle, limit) in
            [("roll", roll_deg, mechanism.max_roll_deg), ("pitch", pitch_deg, mechanism.max_pitch_deg)]
        {
            if angle.is_nan() || angle.abs() > limit {
                let why =
                    format!("recording `{recording}`: the mechanism stops at {limit} deg, asked for {angle}");
                return Err(checks::value_error(&format!("recordings.{axis}_deg"), why));
            }
        }
        Ok(())
    }
}

/// Name of the board that the lab knows without a file.
pub const BUILTIN: &str = "builtin:paper";

/// The paper's board, as `pipelines/boards/paper.toml` has it.
pub const PAPER: &str = include_str!("../../../pipelines/boards/paper.toml");

/// The text of a board file.
pub fn read_drawing(path: &Path) -> Result<String, LabError> {
    if path.ends_with(BUILTIN) {
        return Ok(PAPER.to_owned());
    }
    let refused = |source| LabError::Read { what: "board file", path: path.to_owned(), source };
    input::read_to_string(path, input::Kind::Text).map_err(refused)
}

impl TiltMechanism {
    fn new(table: MechanismTable) -> Result<TiltMechanism, LabError> {
        let pivot = Vector3::from(table.pivot_xyz_mm) * 1e-3;
        let line = |key: &str, axis: [f64; 3]| {
            let direction = Vector3::from(axis);
            if !direction.iter().all(|v| v.is_finite()) || direction.norm() < 1e-6 {
                return Err(checks::value_error(&format!("mechanism.{key}"), "is not a direction".into()));
            }
            Ok(Line { point_m: pivot, direction: direction.normalize() })
        };
        Ok(TiltMechanism {
            roll: line("roll_axis", table.roll_axis)?,
            pitch: line("pitch_axis", table.pitch_axis)?,
            max_roll_deg: table.max_roll_deg,
            max_pitch_deg: table.max_pitch_deg,
        })
    }

    fn pose(&self, roll_rad: f64, pitch_rad: f64) -> Pose {
        let origin = self.pitch.turn_point(&self.roll.turn_point(&Vector3::zeros(), roll_rad), pitch_rad);
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()].map(|v| {
            rotate_vector(
                &self.pitch.direction,
                &rotate_vector(&self.roll.direction, &v, roll_rad),
                pitch_rad,
            )
        });
        pose_from_axes(origin, &axes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Translation3, UnitQuaternion};

    fn tilting() -> Board {
        let mechanism = TiltMechanism::new(MechanismTable {
            pivot_xyz_mm: [10.0, 0.0, -60.0],
            roll_axis: [2.0, 0.0, 0.0],
            pitch_axis: [0.0, 1.0, 0.0],
            max_roll_deg: 20.0,
            max_pitch_deg: 45.0,
        });
        Board {
            cavities: Vec::new(),
            seat_sigma_m: 0.0,
            declared_sigma_m: 0.0,
            mechanism: Some(mechanism.unwrap()),
        }
    }

    #[test]
    fn tilting_is_roll_then_pitch_about_the_pivot() {
        let pose = tilting().tilted(11.7, 11.8).unwrap();
        let pivot = Translation3::new(0.010, 0.0, -0.060);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 11.8f64.to_radians())
            * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 11.7f64.to_radians());
        let expected = pivot * turn * pivot.inverse();
        assert!((pose.to_homogeneous() - expected.to_homogeneous()).norm() < 1e-12);
    }

    #[test]
    fn the_mechanism_has_stops() {
        let error = tilting().check_tilt("steep", 25.0, 0.0).unwrap_err().to_string();
        assert!(error.contains("steep") && error.contains("stops at 20"), "{error}");
        let flat = Board { mechanism: None, ..tilting() };
        assert!(flat.tilted(1.0, 0.0).is_err());
        assert_eq!(flat.tilted(0.0, 0.0).unwrap(), Pose::identity());
    }
}
