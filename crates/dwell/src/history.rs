//! What each joint went through before a moment: from which side it came, and the turning points a gap remembers.

use crate::DwellConfig;
use crate::arrival::arrival_direction;
use crate::memory::path_memory;
use crate::motion_history::Past;
use crate::pauses::Encoders;
use armcal_core::Arrival;

/// The encoder stream, prepared for questions about its past.
pub(crate) struct History<'a> {
    encoders: &'a Encoders<'a>,
    past: Vec<Past<'a>>,
    /// Sum and difference of each joint from the second on and the one before it.
    pairs: Vec<[Past<'a>; 2]>,
    config: &'a DwellConfig,
}

impl<'a> History<'a> {
    pub fn of(encoders: &'a Encoders<'a>, config: &'a DwellConfig) -> History<'a> {
        let columns = &encoders.joints.joint_rad;
        let past = columns.iter().map(|column| Past::of(column)).collect();
        let pair = |pair: &'a [Vec<f64>]| [1.0, -1.0].map(|sense| Past::of_pair(&pair[1], &pair[0], sense));
        History { encoders, past, pairs: columns.windows(2).map(pair).collect(), config }
    }

    /// Direction from which each joint came to the readings `at_rad`; what lies before row `row` is its past.
    pub fn arrival(&self, row: usize, at_rad: &[f64]) -> Vec<Arrival> {
        let rows = self.unbroken_since(row)..row;
        let joints = self.past.iter().zip(at_rad).zip(&self.encoders.step_rad);
        joints
            .map(|((past, at_rad), step_rad)| {
                let away_rad = self
                    .config
                    .arrival_threshold_deg
                    .to_radians()
                    .max(self.config.arrival_threshold_counts * step_rad);
                arrival_direction(past, rows.clone(), *at_rad, away_rad)
            })
            .collect()
    }

    /// Turning points of each joint before row `row`, ending at `at_rad` [rad].
    pub fn path_memory(&self, row: usize, at_rad: &[f64]) -> Vec<Vec<f64>> {
        let rows = self.unbroken_since(row)..row;
        let joints = self.past.iter().zip(at_rad).zip(&self.encoders.step_rad);
        joints
            .map(|((past, at_rad), step_rad)| {
                path_memory(past, rows.clone(), *at_rad, self.deadband_rad(*step_rad))
            })
            .collect()
    }

    /// Turning points of the sum and of the difference of each joint from the second on and the one before it [rad].
    pub fn pair_memory(&self, row: usize, at_rad: &[f64]) -> Vec<[Vec<f64>; 2]> {
        let rows = self.unbroken_since(row)..row;
        let pairs = self.pairs.iter().zip(at_rad.windows(2)).zip(self.encoders.step_rad.windows(2));
        pairs
            .map(|((pasts, at_rad), step_rad)| {
                let deadband_rad = self.deadband_rad(step_rad[0] + step_rad[1]);
                let [sum, difference] = pasts;
                [(sum, 1.0), (difference, -1.0)].map(|(past, sense)| {
                    path_memory(past, rows.clone(), at_rad[1] + sense * at_rad[0], deadband_rad)
                })
            })
            .collect()
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
