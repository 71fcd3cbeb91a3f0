//! What a case draws: numbers of its own, whatever other cases there are.

use armcal_lab::random::{Purpose, Stream};
use nalgebra::{UnitQuaternion, Vector3};

/// Numbers for one case.
#[derive(Debug, Clone)]
pub struct Draw(Stream);

impl Draw {
    /// The numbers of the case `name` on `rig`.
    pub fn new(seed: u64, name: &str, rig: &str) -> Draw {
        Draw(Stream::new(case_seed(seed, name, rig), Purpose::Scenario, 1))
    }

    /// Uniform between two bounds.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        self.0.uniform([low, high])
    }

    /// The same, with either sign.
    pub fn signed(&mut self, low: f64, high: f64) -> f64 {
        self.sign() * self.uniform(low, high)
    }

    /// 1 or -1.
    pub fn sign(&mut self) -> f64 {
        if self.0.chance(0.5) { 1.0 } else { -1.0 }
    }

    /// A standard normal number.
    pub fn normal(&mut self) -> f64 {
        self.0.normal()
    }

    /// True with probability `p`.
    pub fn chance(&mut self, p: f64) -> bool {
        self.0.chance(p)
    }

    /// One of `0..n`.
    pub fn pick(&mut self, n: usize) -> usize {
        ((self.uniform(0.0, 1.0) * n as f64) as usize).min(n.saturating_sub(1))
    }

    /// A random order.
    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        self.0.shuffle(items);
    }

    /// A direction in space.
    pub fn direction(&mut self) -> Vector3<f64> {
        self.0.normal3().try_normalize(1e-9).unwrap_or_else(Vector3::x)
    }

    /// A turn by an angle within two bounds [deg] about any axis.
    pub fn turn_deg(&mut self, low: f64, high: f64) -> UnitQuaternion<f64> {
        let angle = self.uniform(low, high).to_radians();
        UnitQuaternion::from_scaled_axis(self.direction() * angle)
    }
}

/// A seed of the case's own (FNV-1a over its name), so that another list of cases leaves it as it is.
pub fn case_seed(seed: u64, name: &str, rig: &str) -> u64 {
    let bytes = seed.to_le_bytes().into_iter().chain(rig.bytes()).chain(name.bytes());
    let hash = bytes
        .fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3));
    // Below 2^53, so that a seed is the same number in JSON.
    hash >> 11
}
