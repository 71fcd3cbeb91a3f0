//! How far the nominal arm may be off: what the clocks have to be found in spite of.

use armcal_config::{FramePose, Pipeline};
use armcal_core::{FeatureId, Parameter};
use armcal_dwell::{NominalArm, PlacedArm};
use armcal_model::{CarriedPoint, Model};
use nalgebra::Vector3;

/// Share of the half width of its bounds that a parameter without a prior may be off, 1 sigma.
const BOUNDS_TO_SIGMA: f64 = 0.8;

/// The nominal arm, and what of it is in doubt.
#[derive(Clone)]
pub struct Doubts<'a> {
    model: &'a Model,
    nominal: Vec<f64>,
    /// What the sensor saw that the clocks are aligned by.
    leading: FeatureId,
    /// Index and standard deviation of every parameter in doubt.
    parameters: Vec<(usize, f64)>,
    /// How far the tracked point may be from the tip of the chain, per axis [m]; 0 where that is given.
    marker_m: f64,
    /// Factor on all lengths.
    lengths: f64,
}

impl<'a> Doubts<'a> {
    /// What a pipeline says of the arm, as far as it moves what the sensor saw.
    pub fn of(pipeline: &Pipeline, model: &'a Model, leading: FeatureId) -> Doubts<'a> {
        let sigma =
            |p: &Parameter| p.prior_sigma.unwrap_or(BOUNDS_TO_SIGMA * 0.5 * (p.upper - p.lower)).max(0.0);
        let parameters = model.parameters().iter().enumerate().filter(|(_, p)| p.free);
        let parameters =
            parameters.map(|(k, p)| (k, sigma(p))).filter(|(_, sigma)| sigma.is_finite()).collect();
        let name = model.features().find(|(feature, _)| *feature == leading).map_or("", |(_, name)| name);
        let tip = match pipeline.markers.get(name) {
            Some(marker) if !leading.is_tip() => marker.frame(),
            _ => pipeline.frames.tip.clone(),
        };
        let association = pipeline.table.as_ref().map(|t| t.association.clone()).unwrap_or_default();
        let away_m = Vector3::from(tip.at.xyz_m).norm();
        let given = tip.pose == FramePose::Given && away_m == 0.0;
        let marker_m = if given { 0.0 } else { away_m + 1e-3 * association.marker_offset_sigma_mm };
        Doubts { model, nominal: model.nominal(), leading, parameters, marker_m, lengths: 1.0 }
    }

    /// The same arm with all lengths so many times as long.
    pub fn scaled(&self, lengths: f64) -> Doubts<'a> {
        Doubts { lengths, ..self.clone() }
    }
}

impl NominalArm for Doubts<'_> {
    fn uncertain(&self) -> usize {
        self.parameters.len() + if self.marker_m > 0.0 { 3 } else { 0 }
    }

    fn with(&self, off: &[f64]) -> Box<dyn PlacedArm + '_> {
        let mut p = self.nominal.clone();
        let mut slots = vec![None; p.len()];
        for (slot, ((k, sigma), off)) in self.parameters.iter().zip(off).enumerate() {
            p[*k] += sigma * off;
            slots[*k] = Some((slot, *sigma));
        }
        let marker = off.get(self.parameters.len()..).filter(|axes| axes.len() == 3);
        let marker_m =
            marker.map_or_else(Vector3::zeros, |axes| self.marker_m * Vector3::from_column_slice(axes));
        let asked = |k: usize| slots.get(k).is_some_and(Option::is_some);
        let tip = self.model.carried_point(&p, self.leading, marker_m, &asked);
        Box::new(Off { doubts: self, tip, slots })
    }
}

/// The arm with everything in doubt off by so much.
struct Off<'a> {
    doubts: &'a Doubts<'a>,
    tip: CarriedPoint<'a>,
    /// By parameter of the model: which one in doubt it is, and its standard deviation.
    slots: Vec<Option<(usize, f64)>>,
}

impl PlacedArm for Off<'_> {
    fn tip_m(&self, joint_rad: &[f64]) -> Vector3<f64> {
        self.doubts.lengths * self.tip.at_m(joint_rad)
    }

    fn motions_m(&self, joint_rad: &[f64], moved_m: &mut [Vector3<f64>]) -> Vector3<f64> {
        let Doubts { parameters, marker_m, lengths, .. } = self.doubts;
        let found = self.tip.motions(joint_rad);
        moved_m.fill(Vector3::zeros());
        for (index, by_m) in found.parameters {
            if let Some((slot, sigma)) = self.slots[index] {
                moved_m[slot] += *lengths * sigma * by_m;
            }
        }
        for (moved_m, axis) in moved_m[parameters.len()..].iter_mut().zip(found.axes.column_iter()) {
            *moved_m = *lengths * *marker_m * axis;
        }
        *lengths * found.at_m
    }
}
