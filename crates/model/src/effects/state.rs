//! Who holds the arm in a dwell: a servo, or the cavity that the tip is seated in and the hand that led it there.
//!
//! A servo carries gravity through its gears and lets the link lag behind; a hand carries the arm itself, and the link
//! it leads pulls the encoder after it, from the other flank. Which of them acts in the cavities no recording says, so
//! that the data do: every effect of which that decides is tried with the shares of it that may act there. Only where a
//! session has dwells of both kinds.
//!
//! Nor does anything say where in its gap a joint rests that nothing presses onto a flank. Where the errors show that it
//! rests there, how much of the gap it takes is part of the model, and of its noise.

use super::drivers::Drivers;
use super::kind::{EffectContext, Shape};
use super::physics::{AnyPhysics, Deformation};
use super::spec::EffectSpec;
use armcal_core::{Observation, Parameter, Unit};
use nalgebra::Vector3;
use num_dual::Dual64;
use std::ops::{MulAssign, Range};
use std::sync::Arc;

/// How much of what gravity does acts while a cavity holds the tip.
pub(crate) const SEATED: Shape = Shape {
    name: "seated",
    unit: Unit::One,
    default: Some(1.0),
    lower: -2.0,
    upper: 2.0,
    meaning: "share of it that acts while a cavity holds the tip: 0 where the hand carries what a servo carries elsewhere",
    parameter: true,
    values: Some(carried_shares),
};

/// How much of a lost motion does.
pub(super) const LED: Shape = Shape {
    meaning: "share of it that acts while a cavity holds the tip: negative where a hand leads the link, which lags elsewhere",
    values: Some(led_shares),
    ..SEATED
};

/// How much of a gap a joint may rest in, whoever holds the arm.
pub(super) const REST: Shape = Shape {
    name: "rest",
    unit: Unit::One,
    default: Some(0.0),
    lower: 0.0,
    upper: 1.0,
    meaning: "part of its gap in which a joint rests anywhere: 0 on its flank, 1 from flank to flank",
    parameter: true,
    values: None,
};

/// In a cavity a joint may rest within its play: less than all of it.
fn led_shares(context: &EffectContext<'_>, _observations: &[Observation]) -> Vec<f64> {
    worth_trying(context, &[-1.0, -0.75, -0.5, 0.0, 0.5])
}

fn carried_shares(context: &EffectContext<'_>, _observations: &[Observation]) -> Vec<f64> {
    worth_trying(context, &[0.0])
}

fn worth_trying(context: &EffectContext<'_>, shares: &[f64]) -> Vec<f64> {
    if context.session.seated_and_tracked() { shares.to_vec() } else { Vec::new() }
}

/// Whether a shape has a say: who holds the tip matters only where both do, or where somebody says that it does; where a
/// joint rests, only where somebody says it.
pub(super) fn is_shape_relevant(shape: &Shape, context: &EffectContext<'_>) -> bool {
    let said = context.spec.shape.iter().any(|(name, _)| name == shape.name);
    match shape.name {
        name if name == SEATED.name => said || context.session.seated_and_tracked(),
        name if name == REST.name => said,
        _ => true,
    }
}

/// The physics with its shapes [`SEATED`] and [`REST`], where it has them among its `parameters`.
pub(super) fn in_state(
    physics: Arc<dyn AnyPhysics>,
    amplitudes: usize,
    parameters: &[Parameter],
) -> Arc<dyn AnyPhysics> {
    let at = |shape: &Shape| parameters.iter().position(|p| p.name == shape.name);
    match (at(&SEATED), at(&REST)) {
        (None, None) => physics,
        (share, rest) => Arc::new(InState { physics, amplitudes, share, rest }),
    }
}

/// Whether a spec says that what acts in cavities is another share of what acts elsewhere: then a servo holds the arm there.
pub(super) fn servo_elsewhere(spec: &EffectSpec) -> bool {
    spec.shape.iter().any(|(name, share)| name == SEATED.name && *share != 1.0)
}

fn is_seated(x: &Drivers<'_>) -> bool {
    x.observation.cavity().is_some()
}

/// Amplitudes that count in part while a cavity holds the tip, and a gap in which a joint rests.
#[derive(Debug)]
struct InState {
    physics: Arc<dyn AnyPhysics>,
    amplitudes: usize,
    /// Where [`SEATED`] and [`REST`] stand among the parameters.
    share: Option<usize>,
    rest: Option<usize>,
}

impl InState {
    /// The parameters with their amplitudes times the one that stands at `share`.
    fn in_part<T: Copy + MulAssign>(&self, theta: &[T], share: usize) -> Vec<T> {
        let mut own = theta.to_vec();
        own[..self.amplitudes].iter_mut().for_each(|a| *a *= theta[share]);
        own
    }

    /// Where the share of the amplitudes stands that acts in an observation, if not all of them do.
    fn share_in(&self, x: &Drivers<'_>) -> Option<usize> {
        self.share.filter(|_| is_seated(x))
    }
}

impl AnyPhysics for InState {
    fn predict(&self, theta: &[f64], x: &Drivers<'_>, change: &mut Deformation<f64>) {
        match self.share_in(x).filter(|share| theta[*share] != 1.0) {
            Some(share) => self.physics.predict(&self.in_part(theta, share), x, change),
            None => self.physics.predict(theta, x, change),
        }
    }

    fn differentiate(&self, theta: &[Dual64], x: &Drivers<'_>, change: &mut Deformation<Dual64>) {
        match self.share_in(x) {
            Some(share) => self.physics.differentiate(&self.in_part(theta, share), x, change),
            None => self.physics.differentiate(theta, x, change),
        }
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

    fn slack(&self, theta: &[f64], seated: bool) -> Option<(usize, f64)> {
        let (joint, width) = self.physics.gap_of(theta)?;
        let held = self.share.filter(|_| seated).map_or(0.0, |share| (1.0 - theta[share].powi(2)).max(0.0));
        let free = held + self.rest.map_or(0.0, |rest| theta[rest].powi(2));
        (free > 0.0).then(|| (joint, (0.5 * width).powi(2) * free.min(1.0) / 3.0))
    }

    fn touched_entries(&self, x: &Drivers<'_>, count: usize) -> Range<usize> {
        self.physics.touched_entries(x, count)
    }
}
