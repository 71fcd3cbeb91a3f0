//! What is wrong with camera poses for seconds at a time: stretches of worse noise, swapped markers.

use crate::config::{LabConfig, ViconConfig};
use crate::random::{Purpose, Stream};
use nalgebra::Vector3;

/// Size of the noise, one factor a stretch of time: normal noise of a random size is Student's t.
#[derive(Debug)]
pub struct Tails {
    draw: Stream,
    degrees: f64,
    stretch_s: f64,
    factors: Vec<f64>,
}

impl Tails {
    /// The tails of one recording.
    pub fn new(vicon: &ViconConfig, seed: u64, recording: usize) -> Tails {
        Tails {
            draw: Stream::new(seed, Purpose::Tails, 2 * recording + 1),
            degrees: vicon.tail_degrees,
            stretch_s: vicon.tail_s,
            factors: Vec::new(),
        }
    }

    /// Factor on the noise at `time_s`.
    pub fn at(&mut self, time_s: f64) -> f64 {
        if self.degrees == 0.0 {
            return 1.0;
        }
        let stretch = (time_s / self.stretch_s).max(0.0) as usize;
        while self.factors.len() <= stretch {
            self.factors.push(self.draw.tail(self.degrees));
        }
        self.factors[stretch]
    }
}

/// A time in which markers of the tip are taken for each other.
#[derive(Debug, Clone, PartialEq)]
pub struct Swap {
    /// Start and end [s].
    pub span_s: [f64; 2],
    /// Displacement of the tip [m].
    pub offset_m: Vector3<f64>,
}

/// The swaps of one recording.
pub fn draw_swaps(config: &LabConfig, recording: usize, duration_s: f64) -> Vec<Swap> {
    let (vicon, mut swaps, mut time_s) = (&config.vicon, Vec::new(), 0.0);
    let mut draw = Stream::new(config.seed, Purpose::Swaps, recording);
    if vicon.swaps_per_minute == 0.0 {
        return swaps;
    }
    loop {
        time_s += draw.exponential(60.0 / vicon.swaps_per_minute);
        let length_s = draw.exponential(vicon.swap_s);
        let offset_m = draw.normal3() * (vicon.swap_mm * 1e-3);
        if time_s >= duration_s {
            return swaps;
        }
        swaps.push(Swap { span_s: [time_s, time_s + length_s], offset_m });
        time_s += length_s;
    }
}

/// Displacement at `time_s` [m].
pub fn swapped_m(swaps: &[Swap], time_s: f64) -> Vector3<f64> {
    let active = |swap: &&Swap| (swap.span_s[0]..swap.span_s[1]).contains(&time_s);
    swaps.iter().find(active).map_or_else(Vector3::zeros, |swap| swap.offset_m)
}
