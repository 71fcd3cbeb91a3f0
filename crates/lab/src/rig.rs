//! The rig of one seed: what was designed, and what was built.

use crate::LabError;
use crate::arm::{AxisArm, DhRow};
use crate::board::Board;
use crate::commands::Commands;
use crate::config::{ArmConfig, DeviationConfig, LabConfig};
use crate::random::{Purpose, Stream};
use armcal_core::Pose;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use std::path::Path;

/// Everything that stays the same through a session.
#[derive(Debug, Clone)]
pub struct Rig {
    /// The arm as designed: what the controller believes.
    pub nominal: AxisArm,
    /// The arm as built.
    pub built: AxisArm,
    /// The table the built arm was laid out from.
    pub built_rows: Vec<DhRow>,
    /// The robot's base in the world.
    pub world_from_base: Pose,
    /// What the base's marker plate makes of that, relative to the base.
    pub base_from_plate: Pose,
    /// The board.
    pub board: Board,
    /// The untilted board as the lab believes it stands, in the base frame.
    pub base_from_table: Pose,
    /// The untilted board as it stands, in the world.
    pub world_from_table: Pose,
    /// Gravity in the base frame [m/s^2].
    pub gravity_m_s2: Vector3<f64>,
    /// True mass of each link [kg].
    pub masses_kg: Vec<f64>,
    /// True mass of the tool at the tip [kg].
    pub tip_kg: f64,
    /// Set-points from files.
    pub commands: Vec<Commands>,
}

/// The board in one recording.
#[derive(Debug, Clone, PartialEq)]
pub struct BoardPlace {
    /// Tilt reached: roll and pitch [deg].
    pub reached_deg: [f64; 2],
    /// Where it is, in the world.
    pub world_from_board: Pose,
    /// Where the lab believes it to be, in the base frame.
    pub base_from_board: Pose,
}

impl Rig {
    /// Builds the rig of the configured seed.
    pub fn build(config: &LabConfig, base_dir: &Path) -> Result<Rig, LabError> {
        let mut geometry = Stream::new(config.seed, Purpose::Geometry, 0);
        let built_rows = build_rows(&config.arm.rows, &config.arm.deviation, &mut geometry);
        let world_from_base = Pose::from(config.base);
        let base_from_table = Pose::from(config.board.in_base);
        let mut mounting = Stream::new(config.seed, Purpose::Mounting, 0);
        let plate = [config.vicon.base_mount_sigma_mm, config.vicon.base_mount_sigma_deg];
        let base_from_plate = small_motion(&mut mounting, plate);
        let placement = [config.board.placement_sigma_mm, config.board.placement_sigma_deg];
        let placed = base_from_table * small_motion(&mut mounting, placement);
        let tolerance_mm = config.board.true_cavity_sigma_mm;
        let mut board = Board::machine(&base_dir.join(&config.board.file), config.seed, tolerance_mm)?;
        config.mechanisms.iter().for_each(|m| m.hidden().machine_board(&mut board));
        let (masses_kg, tip_kg) = true_masses(&config.arm, config.seed);
        Ok(Rig {
            nominal: AxisArm::from_rows(&config.arm.rows),
            built: AxisArm::from_rows(&built_rows),
            built_rows,
            world_from_base,
            base_from_plate,
            board,
            base_from_table,
            world_from_table: world_from_base * placed,
            gravity_m_s2: world_from_base.rotation.inverse() * Vector3::new(0.0, 0.0, -9.81),
            masses_kg,
            tip_kg,
            commands: Commands::load_all(config, base_dir)?,
        })
    }

    /// Tilts the board for recording `recording`, as well as a person with a spirit level can.
    pub fn place_board(&self, config: &LabConfig, recording: usize) -> Result<BoardPlace, LabError> {
        let wanted = &config.recordings[recording];
        self.board.check_tilt(&wanted.name, wanted.roll_deg, wanted.pitch_deg)?;
        // Stream 0 of this purpose machines the board.
        let mut level = Stream::new(config.seed, Purpose::Board, recording + 1);
        let mut reached = |declared: f64| declared + level.normal() * config.board.tilt_sigma_deg;
        let mut reached_deg = [reached(wanted.roll_deg), reached(wanted.pitch_deg)];
        if !self.board.tilts() {
            reached_deg = [0.0, 0.0];
        }
        Ok(BoardPlace {
            reached_deg,
            world_from_board: self.world_from_table * self.board.tilted(reached_deg[0], reached_deg[1])?,
            base_from_board: self.base_from_table * self.board.tilted(wanted.roll_deg, wanted.pitch_deg)?,
        })
    }
}

/// The table of the built arm: every entry of every row uniform within its bounds.
pub(crate) fn build_rows(rows: &[DhRow], deviation: &DeviationConfig, draw: &mut Stream) -> Vec<DhRow> {
    let mut within = |half_width: f64| draw.uniform([-half_width, half_width]);
    let (length_m, angle_deg) = (deviation.length_mm * 1e-3, deviation.angle_deg);
    let deviate = |row: &DhRow| DhRow {
        theta_deg: row.theta_deg + within(angle_deg),
        d_m: row.d_m + within(length_m),
        a_m: row.a_m + within(length_m),
        alpha_deg: row.alpha_deg + within(angle_deg),
        ..row.clone()
    };
    rows.iter().map(deviate).collect()
}

/// Masses of the built arm's links and tool, each uniform within its bound.
fn true_masses(arm: &ArmConfig, seed: u64) -> (Vec<f64>, f64) {
    let mut draw = Stream::new(seed, Purpose::Masses, 0);
    let half = arm.deviation.mass_percent / 100.0;
    let mut made = |drawn_kg: f64| drawn_kg * (1.0 + draw.uniform([-half, half]));
    let links = arm.drives.iter().map(|drive| made(drive.link_kg)).collect();
    (links, made(arm.tip_kg))
}

/// A small random displacement: each coordinate and each rotation about an axis normally distributed.
pub(crate) fn small_motion(draw: &mut Stream, [sigma_mm, sigma_deg]: [f64; 2]) -> Pose {
    let shift = draw.normal3() * (sigma_mm * 1e-3);
    let turn = draw.normal3() * sigma_deg.to_radians();
    Isometry3::from_parts(Translation3::from(shift), UnitQuaternion::from_scaled_axis(turn))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_built_arm_stays_within_the_papers_bounds_and_uses_them() {
        let arm = ArmConfig::default();
        let mut largest = [0.0f64; 2];
        for seed in 0..50 {
            let mut draw = Stream::new(seed, Purpose::Geometry, 0);
            let rows = build_rows(&arm.rows, &arm.deviation, &mut draw);
            for (built, nominal) in rows.iter().zip(&arm.rows) {
                let mm = 1e3 * (built.d_m - nominal.d_m).abs().max((built.a_m - nominal.a_m).abs());
                let turned = (built.theta_deg - nominal.theta_deg).abs();
                let deg = turned.max((built.alpha_deg - nominal.alpha_deg).abs());
                assert!(mm <= 5.0 && deg <= 2.0);
                largest = [largest[0].max(mm), largest[1].max(deg)];
            }
        }
        assert!(largest[0] > 4.9 && largest[1] > 1.95, "{largest:?}");
    }
}
