//! What tells one dwell, or one row of a stream, from every other.

use serde::{Deserialize, Serialize};

/// What tells a dwell from every other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct DwellMark {
    /// Middle of the dwell [ns], robot clock.
    pub time_ns: i64,
    /// Hash of this time and of the joints' mean readings.
    pub reading: u32,
}

impl DwellMark {
    /// Of a dwell at this time with these readings.
    pub fn of(time_ns: i64, joint_rad: &[f64]) -> DwellMark {
        let hash = hash_of(time_ns, joint_rad.iter().copied());
        DwellMark { time_ns, reading: (hash >> 32) as u32 }
    }
}

/// A hash of a stamp and the values at it, the same on every machine.
pub fn hash_of(time_ns: i64, values: impl Iterator<Item = f64>) -> u64 {
    // Zero has two signs, which are one reading.
    values.fold(mix_bits(time_ns.cast_unsigned()), |hash, value| mix_bits(hash ^ (value + 0.0).to_bits()))
}

/// Finaliser of SplitMix64 (Steele, Lea and Flood 2014).
fn mix_bits(seed: u64) -> u64 {
    let mut z = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
