//! Seeded randomness: one independent stream for each purpose and recording.
//!
//! Streams of one ChaCha8 key never overlap, so adding a source of noise, or a recording, leaves
//! every other draw as it was.

use nalgebra::Vector3;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};

/// What a stream of random numbers is for. The numbers are part of the file format of a seed: never
/// renumber, only append.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// Deviations of the arm's geometry.
    Geometry = 1,
    /// Positions of the cavities, placement of the board, tilt actually reached.
    Board = 2,
    /// Order of visits, pauses, free poses.
    Task = 3,
    /// Tremor and hunting of the guiding hand.
    Hand = 4,
    /// Clearance of the tip in a cavity.
    Seat = 5,
    /// Encoder noise.
    Encoder = 6,
    /// Stamps and transport of joint messages.
    JointTransport = 7,
    /// Offset and drift of the sensor's clock.
    Clock = 8,
    /// Position noise of the tip subject.
    ViconTip = 9,
    /// Position noise of the table subject.
    ViconTable = 10,
    /// Position noise of the base subject.
    ViconBase = 11,
    /// Occlusions of the tip subject.
    OcclusionTip = 12,
    /// Occlusions of the table subject.
    OcclusionTable = 13,
    /// Occlusions of the base subject.
    OcclusionBase = 14,
    /// Stamps and transport of the tip subject.
    TransportTip = 15,
    /// Stamps and transport of the table subject.
    TransportTable = 16,
    /// Stamps and transport of the base subject.
    TransportBase = 17,
    /// Temperature noise and transport.
    Temperature = 18,
    /// How the marker plates sit on base and board.
    Mounting = 19,
    /// Lengths and heights of the hand's movements and pauses.
    Pauses = 20,
    /// Masses of links and tool.
    Masses = 21,
    /// Heavy tails of noise.
    Tails = 22,
    /// Swaps of markers.
    Swaps = 23,
    /// Readings of the quick path.
    Quick = 24,
    /// What a scenario is made of.
    Scenario = 25,
    /// Position noise of the markers on the arm.
    ViconMarker = 26,
    /// Occlusions of the markers on the arm.
    OcclusionMarker = 27,
    /// Stamps and transport of the markers on the arm.
    TransportMarker = 28,
    /// Readings of the markers on the quick path.
    QuickMarker = 29,
    /// Turns of a torso that carries two arms.
    Torso = 30,
    /// Where instruments stand, and their noise.
    Gauge = 31,
}

/// One stream of random numbers.
#[derive(Debug, Clone)]
pub struct Stream(ChaCha8Rng);

impl Stream {
    /// The stream for `purpose` in recording `recording` (0 for what the whole rig shares).
    pub fn new(seed: u64, purpose: Purpose, recording: usize) -> Stream {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(((purpose as u64) << 32) | recording as u64);
        Stream(rng)
    }

    /// A standard normal number.
    pub fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    /// Three independent standard normal numbers.
    pub fn normal3(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.normal())
    }

    /// Uniform between two bounds; the lower one where they coincide.
    pub fn uniform(&mut self, [low, high]: [f64; 2]) -> f64 {
        low + (high - low) * self.0.random::<f64>()
    }

    /// Exponential with the given mean.
    pub fn exponential(&mut self, mean: f64) -> f64 {
        -mean * (1.0 - self.0.random::<f64>()).ln()
    }

    /// Factor that turns a normal number into one of Student's t with `degrees` degrees of freedom, scaled to the
    /// same variance: `sqrt((n - 2) / chi^2_n)`.
    pub fn tail(&mut self, degrees: f64) -> f64 {
        let chi = rand_distr::ChiSquared::new(degrees).map_or(degrees, |chi| chi.sample(&mut self.0));
        ((degrees - 2.0) / chi).sqrt()
    }

    /// True with probability `p`.
    pub fn chance(&mut self, p: f64) -> bool {
        self.0.random::<f64>() < p
    }

    /// A random order of `items` (Fisher-Yates).
    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for last in (1..items.len()).rev() {
            items.swap(last, self.0.random_range(0..=last));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_are_independent_and_repeatable() {
        let draw = |seed, purpose, recording| {
            let mut s = Stream::new(seed, purpose, recording);
            (0..2000).map(|_| s.normal()).collect::<Vec<_>>()
        };
        let a = draw(1, Purpose::Geometry, 0);
        assert_eq!(a, draw(1, Purpose::Geometry, 0));
        for b in [draw(2, Purpose::Geometry, 0), draw(1, Purpose::Board, 0), draw(1, Purpose::Geometry, 1)] {
            let correlation: f64 = a.iter().zip(&b).map(|(x, y)| x * y).sum::<f64>() / a.len() as f64;
            assert!(correlation.abs() < 0.1, "{correlation}");
        }
        let variance = a.iter().map(|x| x * x).sum::<f64>() / a.len() as f64;
        assert!((variance - 1.0).abs() < 0.12, "{variance}");
    }
}
