//! The geometry of a calibration board, read from its TOML file.
//!
//! Board frame: origin where the file puts it (the board's centre), z out of the board towards the arm.
//! A cavity's position is that of the tip's centre when it is seated.

use crate::keys::check_keys;
use crate::tilt::MechanismFile;
use crate::{Mechanism, TableError, Tilt};
use armcal_core::Pose;
use nalgebra::{Matrix3, Translation3, UnitQuaternion, Vector3};
use serde::Deserialize;
use std::path::Path;

/// Cavities closer together than this are taken for a slip in the file [m].
const COINCIDENT_M: f64 = 1e-3;
/// Cavities are compared with each other, so that more than this would take hours and gigabytes.
const MOST_CAVITIES: usize = 5_000;
/// A coordinate beyond this is taken for metres or micrometres written where millimetres belong [mm].
const LARGEST_MM: f64 = 10_000.0;

/// A board on which no coordinate reaches this is written in metres [mm].
const SMALLEST_BOARD_MM: f64 = 2.0;

/// Slack on the limits, for angles that went through degrees and back [rad].
const LIMIT_SLACK_RAD: f64 = 1e-9;

/// A calibration board.
#[derive(Debug, Clone, PartialEq)]
pub struct Board {
    /// Name, for messages.
    pub name: String,
    /// Machining tolerance of a cavity's position, per axis, one standard deviation [m].
    pub cavity_sigma_m: f64,
    /// Clearance of the tip in a cavity, per visit and axis, one standard deviation [m].
    pub seat_sigma_m: f64,
    /// How the board tilts, where it does.
    pub mechanism: Option<Mechanism>,
    /// The cavities, in the order of the file.
    pub cavities: Vec<Cavity>,
}

/// One cavity of a board.
#[derive(Debug, Clone, PartialEq)]
pub struct Cavity {
    /// Unique name.
    pub name: String,
    /// Centre of the seated tip in the board frame [m].
    pub in_board_m: Vector3<f64>,
}

impl Board {
    /// Reads a board from the text of its file; `path` is only named in messages.
    ///
    /// # Errors
    /// Bad TOML, unknown keys (with the nearest known one), missing or non-finite values, negative
    /// tolerances, no cavities, two cavities of one name or in one place, a mechanism without axes.
    pub fn from_toml(text: &str, path: &Path) -> Result<Board, TableError> {
        let syntax = |e: toml::de::Error| TableError::Syntax {
            path: path.to_path_buf(),
            message: e.to_string().trim_end().to_owned(),
        };
        check_all_keys(&text.parse::<toml::Table>().map_err(syntax)?, path)?;
        toml::from_str::<BoardFile>(text).map_err(syntax)?.check(path)
    }

    /// The cavity of that name.
    pub fn cavity(&self, name: &str) -> Option<&Cavity> {
        self.cavities.iter().find(|c| c.name == name)
    }

    /// Covariance of a seated tip about its cavity's nominal position, in any frame: tolerance and
    /// clearance, equal in all directions [m^2].
    pub fn seat_covariance_m2(&self) -> Matrix3<f64> {
        Matrix3::identity() * (self.cavity_sigma_m.powi(2) + self.seat_sigma_m.powi(2))
    }

    /// Pose of the board tilted by `tilt` in the frame it has at zero tilt (`frame_from_board`).
    /// Zero tilt of a board without a mechanism is the identity.
    ///
    /// # Errors
    /// A tilt beyond the mechanism's limits (the message says the limit), not finite, or not zero while
    /// the board has no mechanism.
    pub fn tilted(&self, tilt: Tilt) -> Result<Pose, TableError> {
        let board = || self.name.clone();
        if !(tilt.roll_rad.is_finite() && tilt.pitch_rad.is_finite()) {
            return Err(TableError::TiltNotFinite { board: board() });
        }
        let Some(m) = &self.mechanism else {
            return if tilt == Tilt::default() {
                Ok(Pose::identity())
            } else {
                Err(TableError::NoMechanism { board: board() })
            };
        };
        for (axis, value_rad, limit_rad) in
            [("roll", tilt.roll_rad, m.max_roll_rad), ("pitch", tilt.pitch_rad, m.max_pitch_rad)]
        {
            if value_rad.abs() > limit_rad + LIMIT_SLACK_RAD {
                return Err(TableError::TiltLimit {
                    board: board(),
                    axis,
                    value_deg: value_rad.to_degrees(),
                    limit_deg: limit_rad.to_degrees(),
                });
            }
        }
        let turn = UnitQuaternion::from_axis_angle(&m.pitch_axis, tilt.pitch_rad)
            * UnitQuaternion::from_axis_angle(&m.roll_axis, tilt.roll_rad);
        Ok(Translation3::from(m.pivot_m) * turn * Translation3::from(-m.pivot_m))
    }
}

/// The file as written: millimetres and degrees.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BoardFile {
    name: String,
    #[serde(default)]
    cavity_sigma_mm: f64,
    #[serde(default)]
    seat_sigma_mm: f64,
    mechanism: Option<MechanismFile>,
    #[serde(default)]
    cavities: Vec<CavityFile>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CavityFile {
    name: String,
    xyz_mm: [f64; 3],
}

impl BoardFile {
    fn check(self, path: &Path) -> Result<Board, TableError> {
        let invalid = |what: String| TableError::Invalid { path: path.to_path_buf(), what };
        for (key, value) in [("cavity_sigma_mm", self.cavity_sigma_mm), ("seat_sigma_mm", self.seat_sigma_mm)]
        {
            if !(value.is_finite() && value >= 0.0) {
                return Err(invalid(format!("{key} = {value} must be a finite number of at least 0")));
            }
        }
        if self.cavities.is_empty() {
            return Err(invalid("it has no cavities; add [[cavities]] with name and xyz_mm".into()));
        }
        if self.cavities.len() > MOST_CAVITIES {
            let n = self.cavities.len();
            return Err(invalid(format!("it has {n} cavities; at most {MOST_CAVITIES} can be told apart")));
        }
        if let Some(c) = self.cavities.iter().find(|c| c.name.trim().is_empty()) {
            return Err(invalid(format!("the cavity at xyz_mm = {:?} has an empty name", c.xyz_mm)));
        }
        for c in &self.cavities {
            if let Some(v) = c.xyz_mm.iter().find(|v| !v.is_finite() || v.abs() > LARGEST_MM) {
                return Err(invalid(format!(
                    "cavity `{}` has xyz_mm = {:?}: {v} is not a position on a board (finite, in \
                     millimetres, at most {LARGEST_MM})",
                    c.name, c.xyz_mm
                )));
            }
        }
        let largest_mm = self.cavities.iter().flat_map(|c| c.xyz_mm).fold(0.0, |a: f64, v| a.max(v.abs()));
        if self.cavities.len() > 2 && largest_mm < SMALLEST_BOARD_MM {
            return Err(invalid(format!(
                "all cavities lie within {largest_mm} mm of the board's origin: the positions look like metres, and \
                 xyz_mm is in millimetres"
            )));
        }
        let mechanism = self.mechanism.map(|m| m.check(path)).transpose()?;
        let cavities: Vec<Cavity> = self
            .cavities
            .into_iter()
            .map(|c| Cavity { name: c.name, in_board_m: Vector3::from(c.xyz_mm) * 1e-3 })
            .collect();
        check_distinct(&cavities, path)?;
        Ok(Board {
            name: self.name,
            cavity_sigma_m: self.cavity_sigma_mm * 1e-3,
            seat_sigma_m: self.seat_sigma_mm * 1e-3,
            mechanism,
            cavities,
        })
    }
}

fn check_all_keys(table: &toml::Table, path: &Path) -> Result<(), TableError> {
    let top = ["name", "cavity_sigma_mm", "seat_sigma_mm", "mechanism", "cavities"];
    check_keys(table, &top, "", path)?;
    if let Some(mechanism) = table.get("mechanism").and_then(|v| v.as_table()) {
        check_keys(mechanism, &MechanismFile::KEYS, "mechanism", path)?;
    }
    let cavities = table.get("cavities").and_then(|v| v.as_array()).into_iter().flatten();
    for cavity in cavities.filter_map(|v| v.as_table()) {
        check_keys(cavity, &["name", "xyz_mm"], "cavities", path)?;
    }
    Ok(())
}

fn check_distinct(cavities: &[Cavity], path: &Path) -> Result<(), TableError> {
    for (i, a) in cavities.iter().enumerate() {
        for (j, b) in cavities.iter().enumerate().skip(i + 1) {
            let path = path.to_path_buf();
            if a.name == b.name {
                return Err(TableError::DuplicateName {
                    path,
                    name: a.name.clone(),
                    first: i + 1,
                    second: j + 1,
                });
            }
            let distance_m = (a.in_board_m - b.in_board_m).norm();
            if distance_m < COINCIDENT_M {
                return Err(TableError::Coincident {
                    path,
                    first: a.name.clone(),
                    second: b.name.clone(),
                    distance_mm: distance_m * 1e3,
                });
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAPER: &str = include_str!("../../../pipelines/boards/paper.toml");
    const MUKCA: &str = include_str!("../../../pipelines/boards/mukca.toml");

    fn read(text: &str) -> Result<Board, TableError> {
        Board::from_toml(text, Path::new("board.toml"))
    }

    fn message(text: &str) -> String {
        match read(text) {
            Err(e) => e.to_string(),
            Ok(board) => panic!("accepted: {board:?}"),
        }
    }

    #[test]
    fn the_papers_board_has_a_circle_and_a_line_25_mm_apart() {
        let board = read(PAPER).unwrap();
        assert_eq!(board.cavities.len(), 33);
        let (circle, line) = board.cavities.split_at(20);
        for i in 0..20 {
            assert!((circle[i].in_board_m.norm() - 0.08).abs() < 1e-6);
            let chord = (circle[i].in_board_m - circle[(i + 1) % 20].in_board_m).norm();
            assert!((chord - 2.0 * 0.08 * (std::f64::consts::PI / 20.0).sin()).abs() < 1e-6);
        }
        for pair in line.windows(2) {
            assert!(((pair[1].in_board_m - pair[0].in_board_m).norm() - 0.025).abs() < 1e-12);
        }
        let clear =
            circle.iter().flat_map(|c| line.iter().map(move |l| (c.in_board_m - l.in_board_m).norm()));
        assert!(clear.fold(f64::INFINITY, f64::min) > 0.020);
    }

    #[test]
    fn mukcas_sockets_are_50_mm_apart() {
        let board = read(MUKCA).unwrap();
        let [a, b] = &board.cavities[..] else { panic!("two sockets") };
        assert_eq!((a.name.as_str(), b.name.as_str()), ("hole_0", "hole_1"));
        assert!(((a.in_board_m - b.in_board_m).norm() - 0.05).abs() < 1e-15);
        assert!(board.mechanism.is_none());
    }

    #[test]
    fn a_misspelt_key_is_answered_with_the_nearest() {
        assert!(message("name = \"b\"\ncavity_sigma = 0.1").contains("did you mean `cavity_sigma_mm`?"));
        let text = "name = \"b\"\n[[cavities]]\nname = \"a\"\nxyz_m = [0, 0, 0]";
        assert!(message(text).contains("`cavities.xyz_m`, did you mean `xyz_mm`?"));
        let text = PAPER.replace("max_roll_deg", "maxroll_deg");
        assert!(message(&text).contains("`mechanism.maxroll_deg`, did you mean `max_roll_deg`?"));
    }

    #[test]
    fn a_board_in_metres_is_named() {
        let metres = |line: &str| match line.strip_prefix("xyz_mm = [") {
            Some(rest) => {
                let mm = rest
                    .trim_end()
                    .trim_end_matches(']')
                    .split(',')
                    .map(|v| v.trim().parse::<f64>().unwrap());
                format!("xyz_mm = {:?}", mm.map(|v| v * 1e-3).collect::<Vec<_>>())
            }
            None => line.to_owned(),
        };
        let text: Vec<String> = PAPER.lines().map(metres).collect();
        assert!(message(&text.join("\n")).contains("look like metres"));
    }

    #[test]
    fn impossible_boards_are_named() {
        let two = |a: &str, b: &str| {
            format!("name = \"b\"\n[[cavities]]\nname = \"a\"\nxyz_mm = {a}\n[[cavities]]\nname = {b}")
        };
        assert!(message("name = \"b\"").contains("no cavities"));
        let many = |n| (0..n).map(|i| format!("\n[[cavities]]\nname = \"{i}\"\nxyz_mm = [{}, 0, 0]", 2 * i));
        assert!(
            message(&format!("name = \"b\"{}", many(5001).collect::<String>())).contains("5001 cavities")
        );
        assert!(message(&two("[0, 0, nan]", "\"b\"\nxyz_mm = [9, 0, 0]")).contains("cavity `a`"));
        assert!(message(&two("[0, 0, inf]", "\"b\"\nxyz_mm = [9, 0, 0]")).contains("cavity `a`"));
        assert!(message(&two("[0, 0, 0]", "\"a\"\nxyz_mm = [9, 0, 0]")).contains("both named `a`"));
        assert!(message(&two("[0, 0, 0]", "\"b\"\nxyz_mm = [0, 0.5, 0]")).contains("0.500 mm apart"));
        assert!(message(&two("[0, 0]", "\"b\"\nxyz_mm = [9, 0, 0]")).contains("board.toml"));
        assert!(message("name = \"b\"\nseat_sigma_mm = -1").contains("seat_sigma_mm = -1"));
        assert!(message("name = [").contains("board.toml"));
        assert!(
            message(&PAPER.replace("roll_axis = [1.0, 0.0, 0.0]", "roll_axis = [0, 0, 0]"))
                .contains("roll_axis")
        );
    }

    #[test]
    fn bytes_gone_bad_never_panic() {
        for at in (0..PAPER.len()).step_by(7) {
            for byte in [b'"', b'=', b'-', b'\n', b'9'] {
                let mut bytes = PAPER.as_bytes().to_vec();
                bytes[at] = byte;
                if let Ok(text) = std::str::from_utf8(&bytes) {
                    let _ = read(text);
                }
            }
        }
    }
}
