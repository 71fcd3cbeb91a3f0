//! What each joint went through before a moment: from which side it came, and the turning points a gap remembers.

use crate::DwellConfig;
use crate::arrival::Past;
use crate::memory::path_memory;
use crate::pauses::Encoders;
use armcal_core::Arrival;

/// The encoder stream, prepared for questions about its past.
pub(crate) struct History<'a> {
    encoders: &'a Encoders<'a>,
    past: Vec<Past<'a>>,
    config: &'a DwellConfig,
}

impl<'a> History<'a> {
    pub fn of(encoders: &'a Encoders<'a>, config: &'a DwellConfig) -> History<'a> {
        let past = encoders.joints.joint_rad.iter().map(|column| Past::of(column)).collect();
        History { encoders, past, config }
    }

    /// Direction from which each joint came to the readings `at_rad`; what lies before row `row` is its past.
    pub fn arrival(&self, row: usize, at_rad: &[f64]) -> Vec<Arrival> {
        let since = self.unbroken_since(row);
        let joints = self.past.iter().zip(at_rad).zip(&self.encoders.step_rad);
        joints
            .map(|((past, at_rad), step_rad)| {
                let away_rad = self
                    .config
                    .arrival_threshold_deg
                    .to_radians()
                    .max(self.config.arrival_threshold_counts * step_rad);
                past.arrival(since, row, *at_rad, away_rad)
            })
            .collect()
    }

    /// Turning points of each joint before row `row`, ending at `at_rad` [rad].
    pub fn path_memory(&self, row: usize, at_rad: &[f64]) -> Vec<Vec<f64>> {
        let past = self.unbroken_since(row)..row;
        let joints = self.encoders.joints.joint_rad.iter().zip(at_rad).zip(&self.encoders.step_rad);
        joints
            .map(|((column, at_rad), step_rad)| {
                path_memory(column[past.clone()].iter().copied(), *at_rad, self.deadband_rad(*step_rad))
            })
            .collect()
    }

    /// Turning points of the sum and of the difference of each joint from the second on and the one before it [rad].
    pub fn pair_memory(&self, row: usize, at_rad: &[f64]) -> Vec<[Vec<f64>; 2]> {
        (1..at_rad.len()).map(|joint| self.pair(joint, row, at_rad)).collect()
    }

    fn pair(&self, joint: usize, row: usize, at_rad: &[f64]) -> [Vec<f64>; 2] {
        let columns = [&self.encoders.joints.joint_rad[joint - 1], &self.encoders.joints.joint_rad[joint]];
        let past = self.unbroken_since(row)..row;
        let step_rad = self.encoders.step_rad[joint - 1] + self.encoders.step_rad[joint];
        [1.0, -1.0].map(|sense| {
            let together = past.clone().map(|row| columns[1][row] + sense * columns[0][row]);
            let rest_rad = at_rad[joint] + sense * at_rad[joint - 1];
            path_memory(together, rest_rad, self.deadband_rad(step_rad))
        })
    }

    /// Tremor and quantisation at rest are no turning points [rad].
    fn deadband_rad(&self, step_rad: f64) -> f64 {
        (0.1 * self.config.arrival_threshold_deg.to_radians())
            .max(self.config.arrival_threshold_counts * step_rad)
    }

    /// First row of the stretch without gaps that a row is in.
    fn unbroken_since(&self, row: usize) -> usize {
        self.encoders.stretches.iter().find(|s| s.contains(&row)).map_or(row, |s| s.start)
    }
}
