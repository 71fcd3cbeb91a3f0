//! The tilting mechanism: a board turned about a pivot by a roll and a pitch.
//!
//! `frame_from_board(tilt) = T(pivot) R(pitch about pitch_axis) R(roll about roll_axis) T(-pivot)`,
//! the identity at zero tilt: roll turns with the board, pitch is fixed to the frame.

use crate::TableError;
use nalgebra::{Unit, Vector3};
use serde::Deserialize;
use std::path::Path;

/// How a board tilts. Axes and pivot are in the board frame at zero tilt.
#[derive(Debug, Clone, PartialEq)]
pub struct Mechanism {
    /// The point that stays where it is [m].
    pub pivot_m: Vector3<f64>,
    /// Axis of roll.
    pub roll_axis: Unit<Vector3<f64>>,
    /// Axis of pitch.
    pub pitch_axis: Unit<Vector3<f64>>,
    /// Largest roll either way [rad].
    pub max_roll_rad: f64,
    /// Largest pitch either way [rad].
    pub max_pitch_rad: f64,
}

/// A setting of the mechanism.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(from = "TiltFile")]
pub struct Tilt {
    /// Turn about the roll axis [rad]; `roll_deg` in a configuration.
    pub roll_rad: f64,
    /// Turn about the pitch axis [rad]; `pitch_deg` in a configuration.
    pub pitch_rad: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TiltFile {
    #[serde(default)]
    roll_deg: f64,
    #[serde(default)]
    pitch_deg: f64,
}

impl From<TiltFile> for Tilt {
    fn from(f: TiltFile) -> Tilt {
        Tilt { roll_rad: f.roll_deg.to_radians(), pitch_rad: f.pitch_deg.to_radians() }
    }
}

/// The `[mechanism]` of a board file as written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct MechanismFile {
    pivot_xyz_mm: [f64; 3],
    roll_axis: [f64; 3],
    pitch_axis: [f64; 3],
    max_roll_deg: f64,
    max_pitch_deg: f64,
}

impl MechanismFile {
    pub(crate) const KEYS: [&'static str; 5] =
        ["pivot_xyz_mm", "roll_axis", "pitch_axis", "max_roll_deg", "max_pitch_deg"];

    pub(crate) fn check(self, path: &Path) -> Result<Mechanism, TableError> {
        let invalid = |what: String| TableError::Invalid { path: path.to_path_buf(), what };
        if !self.pivot_xyz_mm.iter().all(|v| v.is_finite()) {
            return Err(invalid(format!("mechanism.pivot_xyz_mm = {:?} must be finite", self.pivot_xyz_mm)));
        }
        let axis = |key: &str, v: [f64; 3]| {
            let v3 = Vector3::from(v);
            match v3.iter().all(|x| x.is_finite()).then(|| Unit::try_new(v3, 1e-9)).flatten() {
                Some(axis) => Ok(axis),
                None => Err(invalid(format!("mechanism.{key} = {v:?} must be a direction, not zero"))),
            }
        };
        let (roll_axis, pitch_axis) =
            (axis("roll_axis", self.roll_axis)?, axis("pitch_axis", self.pitch_axis)?);
        if roll_axis.cross(&pitch_axis).norm() < 1e-3 {
            return Err(invalid("mechanism.roll_axis and mechanism.pitch_axis are parallel".into()));
        }
        for (key, value) in [("max_roll_deg", self.max_roll_deg), ("max_pitch_deg", self.max_pitch_deg)] {
            if !(0.0..=180.0).contains(&value) {
                return Err(invalid(format!("mechanism.{key} = {value} must be between 0 and 180")));
            }
        }
        Ok(Mechanism {
            pivot_m: Vector3::from(self.pivot_xyz_mm) * 1e-3,
            roll_axis,
            pitch_axis,
            max_roll_rad: self.max_roll_deg.to_radians(),
            max_pitch_rad: self.max_pitch_deg.to_radians(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Board;
    use armcal_core::Pose;
    use nalgebra::{Point3, point};
    use proptest::prelude::*;

    fn paper() -> Board {
        let text = include_str!("../../../pipelines/boards/paper.toml");
        Board::from_toml(text, Path::new("paper.toml")).unwrap()
    }

    fn degrees(roll: f64, pitch: f64) -> Tilt {
        Tilt { roll_rad: roll.to_radians(), pitch_rad: pitch.to_radians() }
    }

    #[test]
    fn a_roll_and_a_pitch_by_hand() {
        // Pivot 60 mm below the centre. Roll by a about x: the centre moves to (0, -60 sin a, 60 cos a - 60).
        let (s, c) = 11.7_f64.to_radians().sin_cos();
        let centre = paper().tilted(degrees(11.7, 0.0)).unwrap() * Point3::origin();
        assert!((centre - point![0.0, -0.06 * s, 0.06 * c - 0.06]).norm() < 1e-15);
        // Pitch by b about y: (60 sin b, 0, 60 cos b - 60).
        let (s, c) = 11.8_f64.to_radians().sin_cos();
        let centre = paper().tilted(degrees(0.0, 11.8)).unwrap() * Point3::origin();
        assert!((centre - point![0.06 * s, 0.0, 0.06 * c - 0.06]).norm() < 1e-15);
        // Both: roll first, then pitch about the frame's y. y is not touched by the pitch.
        let both = paper().tilted(degrees(90.0_f64.min(20.0), 45.0)).unwrap() * point![0.0, 0.1, -0.06];
        let (sr, cr) = 20.0_f64.to_radians().sin_cos();
        let h = 0.1 * sr * std::f64::consts::FRAC_1_SQRT_2;
        assert!((both - point![h, 0.1 * cr, h - 0.06]).norm() < 1e-15);
    }

    #[test]
    fn a_tilt_beyond_the_limit_says_the_limit() {
        let e = paper().tilted(degrees(20.5, 0.0)).unwrap_err().to_string();
        assert!(e.contains("roll_deg = 20.500") && e.contains("max_roll_deg = 20"), "{e}");
        let e = paper().tilted(degrees(0.0, -46.0)).unwrap_err().to_string();
        assert!(e.contains("pitch_deg = -46.000") && e.contains("max_pitch_deg = 45"), "{e}");
        assert!(paper().tilted(degrees(20.0, -45.0)).is_ok());
        assert!(paper().tilted(degrees(f64::NAN, 0.0)).is_err());
        let mut fixed = paper();
        fixed.mechanism = None;
        assert!(fixed.tilted(degrees(1.0, 0.0)).unwrap_err().to_string().contains("[mechanism]"));
        assert_eq!(fixed.tilted(Tilt::default()).unwrap(), Pose::identity());
    }

    #[test]
    fn tilt_is_configured_in_degrees() {
        let tilt: Tilt = toml::from_str("roll_deg = 11.7").unwrap();
        assert_eq!(tilt, degrees(11.7, 0.0));
        assert!(toml::from_str::<Tilt>("roll_rad = 0.2").is_err());
    }

    proptest! {
        #[test]
        fn the_pivot_never_moves_and_distances_stay(roll in -20.0..20.0, pitch in -45.0..45.0) {
            let board = paper();
            let pose = board.tilted(degrees(roll, pitch)).unwrap();
            let pivot = Point3::from(board.mechanism.as_ref().unwrap().pivot_m);
            prop_assert!((pose * pivot - pivot).norm() < 1e-12);
            let (a, b) = (board.cavities[3].in_board_m, board.cavities[30].in_board_m);
            let moved = (pose * Point3::from(a) - pose * Point3::from(b)).norm();
            prop_assert!((moved - (a - b).norm()).abs() < 1e-12);
        }
    }
}
