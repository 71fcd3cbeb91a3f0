//! Physical effects that may be hidden in the six-axis arm.

use crate::Draw;
use std::f64::consts::TAU;

const JOINTS: usize = 6;

/// A physical effect between encoders and links.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Hidden {
    /// An encoder disc off its centre: `a sin(q + phase)` at a joint.
    OffCentre(usize, f64, f64),
    /// Shoulder and elbow sag with the torque of gravity, that of a link being the cosine of its elevation [rad].
    Sag(f64, f64),
    /// Play in a gear: half of it against the last move of a joint.
    Play(usize, f64),
}

impl Hidden {
    /// One of a realistic size.
    pub fn draw(draw: &mut Draw) -> Hidden {
        let (which, joint) = (draw.pick(3), draw.pick(JOINTS));
        match which {
            0 => Hidden::OffCentre(joint, draw.uniform(0.02, 0.1).to_radians(), draw.uniform(0.0, TAU)),
            1 => Hidden::Sag(draw.uniform(0.02, 0.08).to_radians(), draw.uniform(0.01, 0.05).to_radians()),
            _ => Hidden::Play(joint, draw.uniform(0.03, 0.12).to_radians()),
        }
    }

    /// Its name.
    pub fn word(self) -> &'static str {
        match self {
            Hidden::OffCentre(..) => "encoder off centre",
            Hidden::Sag(..) => "sag",
            Hidden::Play(..) => "play",
        }
    }

    /// Adds it to the joints, which came to where they are from `before`.
    pub(super) fn act(self, q: &mut [f64; 6], before: &[f64; 6]) {
        match self {
            Hidden::OffCentre(joint, size, phase) => q[joint] += size * (q[joint] + phase).sin(),
            Hidden::Sag(shoulder, elbow) => {
                let (upper, fore) = (q[1].cos(), (q[1] + q[2]).cos());
                q[1] += shoulder * (0.6 * upper + 0.4 * fore);
                q[2] += elbow * fore;
            }
            Hidden::Play(joint, width) => q[joint] -= 0.5 * width * (q[joint] - before[joint]).signum(),
        }
    }
}
