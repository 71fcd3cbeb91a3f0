//! Who holds the arm in a dwell: a servo, or the cavity that the tip is seated in and the hand that led it there.
//!
//! A servo carries gravity through its gears and lets the link lag behind; a hand carries the arm itself, and the link
//! it leads pulls the encoder after it, from the other flank. Which of them acts in the cavities no recording says,
//! so that the data do: lost motion has a size of its own there ([`apart`]), and what gravity bends is tried with and
//! without it ([`SEATED`]). Only where a session has dwells of both kinds.

use super::drivers::Drivers;
use super::kind::{Placement, Shape};
use super::physics::{AnyPhysics, Deformation};
use super::placing::Placing;
use armcal_core::{Observation, Unit};
use nalgebra::Vector3;
use num_dual::Dual64;
use std::ops::Range;
use std::sync::Arc;

/// How much of an effect acts while a cavity holds the tip.
pub(super) const SEATED: Shape = Shape {
    name: "seated",
    unit: Unit::One,
    default: Some(1.0),
    lower: -1.0,
    upper: 1.0,
    meaning: "share of it that acts while a cavity holds the tip: 0 where the hand carries what a servo carries elsewhere",
    parameter: true,
    values: Some(carried),
};

fn carried(placing: &Placing<'_>, _observations: &[Observation]) -> Vec<f64> {
    if placing.session.seated_and_tracked() { vec![0.0] } else { Vec::new() }
}

/// The placement with amplitudes of their own for dwells in which a cavity holds the tip.
pub(super) fn apart(placing: &Placing<'_>, placement: Placement) -> Placement {
    if !placing.session.seated_and_tracked() {
        return placement;
    }
    let mut amplitudes = placement.amplitudes;
    let count = amplitudes.len();
    for k in 0..count {
        let mut own = amplitudes[k].clone();
        own.name = format!("{}_seated", own.name);
        own.meaning = format!("{} while a cavity holds the tip (negative: a hand led the link)", own.meaning);
        amplitudes.push(own);
    }
    Placement { amplitudes, physics: Arc::new(Apart { physics: placement.physics, count }), ..placement }
}

/// The placement with its amplitudes times the shape [`SEATED`], which stands at `share` of its parameters.
pub(super) fn shared(physics: Arc<dyn AnyPhysics>, amplitudes: usize, share: usize) -> Arc<dyn AnyPhysics> {
    Arc::new(Shared { physics, amplitudes, share })
}

fn seated(x: &Drivers<'_>) -> bool {
    x.observation.cavity().is_some()
}

/// `count` amplitudes for a tracked tip, as many for a seated one, then the shapes.
#[derive(Debug)]
struct Apart {
    physics: Arc<dyn AnyPhysics>,
    count: usize,
}

impl Apart {
    fn own<T: Copy>(&self, theta: &[T], x: &Drivers<'_>) -> Vec<T> {
        let first = if seated(x) { self.count } else { 0 };
        let (own, shapes) = (&theta[first..first + self.count], &theta[2 * self.count..]);
        own.iter().chain(shapes).copied().collect()
    }
}

impl AnyPhysics for Apart {
    fn predict(&self, theta: &[f64], x: &Drivers<'_>, change: &mut Deformation<f64>) {
        self.physics.predict(&self.own(theta, x), x, change);
    }

    fn differentiate(&self, theta: &[Dual64], x: &Drivers<'_>, change: &mut Deformation<Dual64>) {
        self.physics.differentiate(&self.own(theta, x), x, change);
    }

    fn predict_seen(&self, _theta: &[f64], _point_m: &Vector3<f64>) -> Vector3<f64> {
        Vector3::zeros()
    }

    fn differentiate_seen(&self, _theta: &[Dual64], _point_m: &Vector3<Dual64>) -> Vector3<Dual64> {
        Vector3::repeat(Dual64::from(0.0))
    }

    fn touched_entries(&self, _x: &Drivers<'_>, count: usize) -> Range<usize> {
        0..count
    }
}

/// Amplitudes that count in part while a cavity holds the tip.
#[derive(Debug)]
struct Shared {
    physics: Arc<dyn AnyPhysics>,
    amplitudes: usize,
    share: usize,
}

impl AnyPhysics for Shared {
    fn predict(&self, theta: &[f64], x: &Drivers<'_>, change: &mut Deformation<f64>) {
        if !seated(x) || theta[self.share] == 1.0 {
            return self.physics.predict(theta, x, change);
        }
        let mut own = theta.to_vec();
        own[..self.amplitudes].iter_mut().for_each(|a| *a *= theta[self.share]);
        self.physics.predict(&own, x, change);
    }

    fn differentiate(&self, theta: &[Dual64], x: &Drivers<'_>, change: &mut Deformation<Dual64>) {
        if !seated(x) {
            return self.physics.differentiate(theta, x, change);
        }
        let mut own = theta.to_vec();
        own[..self.amplitudes].iter_mut().for_each(|a| *a *= theta[self.share]);
        self.physics.differentiate(&own, x, change);
    }

    fn predict_seen(&self, theta: &[f64], point_m: &Vector3<f64>) -> Vector3<f64> {
        self.physics.predict_seen(theta, point_m)
    }

    fn differentiate_seen(&self, theta: &[Dual64], point_m: &Vector3<Dual64>) -> Vector3<Dual64> {
        self.physics.differentiate_seen(theta, point_m)
    }

    fn touched_entries(&self, x: &Drivers<'_>, count: usize) -> Range<usize> {
        self.physics.touched_entries(x, count)
    }
}
