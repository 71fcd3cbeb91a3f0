//! Who holds the arm in a dwell: a servo, or the cavity that the tip is seated in and the hand that led it there.
//!
//! A servo carries gravity through its gears and lets the link lag behind; a hand carries the arm itself, and the link
//! it leads pulls the encoder after it, from the other flank. Which of them acts in the cavities no recording says, so
//! that the data do: every effect of which that decides is tried with the shares of it that may act there. Only where a
//! session has dwells of both kinds.

use super::drivers::Drivers;
use super::kind::Shape;
use super::physics::{AnyPhysics, Deformation};
use super::placing::Placing;
use armcal_core::{Observation, Unit};
use nalgebra::Vector3;
use num_dual::Dual64;
use std::ops::{MulAssign, Range};
use std::sync::Arc;

/// How much of what gravity does acts while a cavity holds the tip.
pub(super) const SEATED: Shape = Shape {
    name: "seated",
    unit: Unit::One,
    default: Some(1.0),
    lower: -2.0,
    upper: 2.0,
    meaning: "share of it that acts while a cavity holds the tip: 0 where the hand carries what a servo carries elsewhere",
    parameter: true,
    values: Some(carried),
};

/// How much of a lost motion does.
pub(super) const LED: Shape = Shape {
    meaning: "share of it that acts while a cavity holds the tip: negative where a hand leads the link, which lags elsewhere",
    values: Some(led),
    ..SEATED
};

/// In a cavity a joint may rest within its play: less than all of it.
fn led(placing: &Placing<'_>, _observations: &[Observation]) -> Vec<f64> {
    worth_trying(placing, &[-1.0, -0.75, -0.5, 0.0, 0.5])
}

fn carried(placing: &Placing<'_>, _observations: &[Observation]) -> Vec<f64> {
    worth_trying(placing, &[0.0])
}

fn worth_trying(placing: &Placing<'_>, shares: &[f64]) -> Vec<f64> {
    if placing.session.seated_and_tracked() { shares.to_vec() } else { Vec::new() }
}

/// Whether a shape has a say: who holds the tip matters only where both do, or where somebody says that it does.
pub(super) fn matters(shape: &Shape, placing: &Placing<'_>) -> bool {
    let said = placing.spec.shape.iter().any(|(name, _)| name == shape.name);
    shape.name != SEATED.name || said || placing.session.seated_and_tracked()
}

/// The placement with its amplitudes times the shape [`SEATED`], which stands at `share` of its parameters.
pub(super) fn shared(physics: Arc<dyn AnyPhysics>, amplitudes: usize, share: usize) -> Arc<dyn AnyPhysics> {
    Arc::new(Shared { physics, amplitudes, share })
}

fn seated(x: &Drivers<'_>) -> bool {
    x.observation.cavity().is_some()
}

/// Amplitudes that count in part while a cavity holds the tip.
#[derive(Debug)]
struct Shared {
    physics: Arc<dyn AnyPhysics>,
    amplitudes: usize,
    share: usize,
}

impl Shared {
    /// The parameters with their amplitudes as they count there.
    fn in_part<T: Copy + MulAssign>(&self, theta: &[T]) -> Vec<T> {
        let mut own = theta.to_vec();
        own[..self.amplitudes].iter_mut().for_each(|a| *a *= theta[self.share]);
        own
    }
}

impl AnyPhysics for Shared {
    fn predict(&self, theta: &[f64], x: &Drivers<'_>, change: &mut Deformation<f64>) {
        if !seated(x) || theta[self.share] == 1.0 {
            return self.physics.predict(theta, x, change);
        }
        self.physics.predict(&self.in_part(theta), x, change);
    }

    fn differentiate(&self, theta: &[Dual64], x: &Drivers<'_>, change: &mut Deformation<Dual64>) {
        if !seated(x) {
            return self.physics.differentiate(theta, x, change);
        }
        self.physics.differentiate(&self.in_part(theta), x, change);
    }

    fn predict_seen(&self, theta: &[f64], point_m: &Vector3<f64>) -> Vector3<f64> {
        self.physics.predict_seen(theta, point_m)
    }

    fn differentiate_seen(&self, theta: &[Dual64], point_m: &Vector3<Dual64>) -> Vector3<Dual64> {
        self.physics.differentiate_seen(theta, point_m)
    }

    fn gap_of(&self, theta: &[f64]) -> Option<(usize, f64)> {
        self.physics.gap_of(theta)
    }

    fn slack(&self, theta: &[f64]) -> Option<(usize, f64)> {
        let (joint, width) = self.physics.gap_of(theta)?;
        let free = 1.0 - theta[self.share].powi(2);
        (free > 0.0).then(|| (joint, (0.5 * width).powi(2) * free / 3.0))
    }

    fn touched_entries(&self, x: &Drivers<'_>, count: usize) -> Range<usize> {
        self.physics.touched_entries(x, count)
    }
}
