//! Where a residual may come from: what each dwell says about each joint, about all lengths together, about the tip.
//!
//! An implied error is linear in the residual, so each dwell has one sensitivity for each channel. They are worked out once, at
//! the run's own fit, and serve every refit: geometry that differs by some millimetres does not move them.

use crate::analysis::moves_tip;
use crate::run::Run;
use armcal_calibrate::{BLURRED, PositionNoise, implied_joint_errors};
use armcal_core::robust::median;
use armcal_core::{Observation, Unit};
use armcal_diagnose::EntersAt;
use nalgebra::Vector3;
use serde::Serialize;

/// One place where an error may enter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Channel {
    /// Name for programs: `joint1`, `lengths`, `world.x`.
    pub key: EntersAt,
    /// Name for people.
    pub label: String,
    /// Unit of its errors.
    pub unit: &'static str,
    /// The joint, if it is one.
    pub joint: Option<usize>,
}

/// What one dwell says about one channel, by the residual.
#[derive(Debug, Clone, Copy)]
struct Sensitivity {
    /// Implied error = this . residual [m], in the channel's unit.
    gain: Vector3<f64>,
    /// Displacement of the tip [m] by one unit of the channel.
    column_m: Vector3<f64>,
    /// Standard deviation of the implied error, in the channel's unit.
    sigma: f64,
}

/// The channels of a run, and the sensitivity of each dwell on each.
pub struct Sensitivities {
    /// Joints first, then `lengths`, then the world's axes.
    pub channels: Vec<Channel>,
    /// `[channel][observation]`.
    sensitivity: Vec<Vec<Option<Sensitivity>>>,
}

impl Sensitivities {
    /// At the run's fit.
    pub fn of(run: &Run) -> Sensitivities {
        let channels = channels(run);
        let joints = run.model.joint_count();
        let mut sensitivity = vec![Vec::with_capacity(run.observations.len()); channels.len()];
        let values = run.calibration.fit.values();
        for o in &run.observations {
            let row =
                joint_sensitivities(run, &values, o).into_iter().chain([length_sensitivity(run, &values, o)]);
            for (sensitivity, all) in
                row.chain((0..3).map(|axis| Some(axis_sensitivity(axis, o)))).zip(&mut sensitivity)
            {
                all.push(sensitivity);
            }
        }
        sensitivity.iter_mut().take(joints + 1).for_each(|all| drop_uncertain(all));
        Sensitivities { channels, sensitivity }
    }

    /// What these residuals [m] say about a channel, in its unit.
    pub fn implied(&self, channel: usize, residuals_m: &[Vector3<f64>]) -> Vec<Option<f64>> {
        let each = self.sensitivity[channel].iter().zip(residuals_m);
        each.map(|(sensitivity, r)| sensitivity.map(|l| l.gain.dot(r))).collect()
    }

    /// Whether each channel is drawn, by what the run's own calibration leaves: all but joints that do not move the tip.
    pub fn drawn(&self, run: &Run) -> Vec<bool> {
        let residuals_m: Vec<_> = run.calibration.residuals.iter().map(|r| r.fitted_m).collect();
        let implied = |channel| self.implied(channel, &residuals_m).into_iter().flatten();
        let each = self.channels.iter().enumerate();
        each.map(|(k, c)| c.joint.is_none() || moves_tip(c.unit, implied(k))).collect()
    }

    /// Which share of these displacements [m] a channel alone can stand for, squared, 0 to 1.
    pub fn share(&self, channel: usize, displacements_m: &[Vector3<f64>]) -> f64 {
        let (mut left, mut all) = (0.0, 0.0);
        for (sensitivity, d) in self.sensitivity[channel].iter().zip(displacements_m) {
            let stands_for = sensitivity.map_or_else(Vector3::zeros, |l| l.column_m * l.gain.dot(d));
            left += (d - stands_for).norm_squared();
            all += d.norm_squared();
        }
        if all > 0.0 { (1.0 - left / all).max(0.0) } else { 0.0 }
    }
}

fn channels(run: &Run) -> Vec<Channel> {
    let chain = run.model.chain();
    let joint = |(index, (name, unit)): (usize, (&String, armcal_core::Unit))| Channel {
        key: EntersAt::Joint(index),
        label: name.clone(),
        unit: unit.display_symbol(),
        joint: Some(index),
    };
    let joints = chain.joint_names().iter().zip(joint_units(run)).enumerate().map(joint);
    let whole = |key, label, unit| Channel { key, label, unit, joint: None };
    let lengths = whole(EntersAt::Lengths, "all lengths of the arm".into(), "ppm");
    let world =
        ['x', 'y', 'z'].map(|a| whole(EntersAt::WorldAxis(a), format!("tip along {a} of the world"), "mm"));
    joints.chain([lengths]).chain(world).collect()
}

/// Degrees (millimetres of a slide) of each joint.
fn joint_sensitivities(run: &Run, values: &[f64], o: &Observation) -> Vec<Option<Sensitivity>> {
    let unit = |axis: usize| implied_joint_errors(&run.model, values, o, &Vector3::ith(axis, 1.0));
    let (x, y, z) = (unit(0), unit(1), unit(2));
    let columns = run.model.joint_jacobian(values, o);
    let shown: Vec<f64> = joint_units(run).iter().map(|u| u.to_display(1.0)).collect();
    let one = |j: usize| {
        let gain = Vector3::new(x[j]?.error, y[j]?.error, z[j]?.error) * shown[j];
        Some(Sensitivity { gain, column_m: columns.column(j) / shown[j], sigma: x[j]?.sigma * shown[j] })
    };
    (0..x.len()).map(one).collect()
}

/// Parts per million of all lengths.
fn length_sensitivity(run: &Run, values: &[f64], o: &Observation) -> Option<Sensitivity> {
    let (model, p) = run.model.in_recording(o.dwell.recording, values);
    // The jacobian is that of measured minus predicted; of a distance it has one row, along it.
    let (residual, jacobian) = model.residual_with_jacobian(&p, o);
    let moved = |k: usize| match residual.along {
        Some(along) => along * jacobian[(0, k)],
        None => jacobian.fixed_view::<3, 1>(0, k).into_owned(),
    };
    let grown = |(k, length_m): (usize, f64)| -moved(k) * length_m;
    let column_m = run.model.lengths_m().into_iter().map(grown).sum::<Vector3<f64>>() * 1e-6;
    let weighed = PositionNoise::of(&run.model, values, o)?.weigh(&column_m);
    let information = weighed.dot(&column_m);
    let sensitivity =
        Sensitivity { gain: weighed / information, column_m, sigma: information.sqrt().recip() };
    sensitivity.gain.iter().all(|g| g.is_finite()).then_some(sensitivity)
}

/// Millimetres along an axis of the world.
fn axis_sensitivity(axis: usize, o: &Observation) -> Sensitivity {
    let unit = Vector3::ith(axis, 1.0);
    let sigma = o.covariance_m2[(axis, axis)].sqrt() * 1e3;
    Sensitivity { gain: unit * 1e3, column_m: unit * 1e-3, sigma }
}

fn drop_uncertain(sensitivity: &mut [Option<Sensitivity>]) {
    let sigmas: Vec<f64> = sensitivity.iter().flatten().map(|l| l.sigma).collect();
    let usual = median(&sigmas);
    for sensitivity in sensitivity {
        if sensitivity.is_some_and(|l| l.sigma > BLURRED * usual) {
            *sensitivity = None;
        }
    }
}

/// Unit of every joint's reading.
pub(crate) fn joint_units(run: &Run) -> Vec<Unit> {
    (0..run.model.joint_count()).map(|j| run.model.chain().joint_unit(j)).collect()
}
