//! Where the unknown may enter a fitted model, as whitened columns: a joint, a length of the chain, the twist between two axes, a
//! base that tilts, a belt, a displacement.

use crate::enters::EntersAt;
use crate::problem::Channel;
use crate::robot::view::View;
use armcal_calibrate::Linearisation;
use armcal_core::{Against, Observation, Unit};
use nalgebra::{DMatrix, DVector, Vector3};
use std::ops::Range;
use std::sync::Arc;

/// A length of the nominal arm below this is not a way for the unknown to enter [m].
const SHORTEST_M: f64 = 0.02;

impl View<'_> {
    /// Where the unknown may enter: a joint, a length of the chain, the twist between two axes, a displacement.
    pub(crate) fn channels(&self, linear: &Linearisation) -> Vec<Channel> {
        // One linearisation an observation serves all joints, one all lengths and twists. They are of measured - predicted.
        let turns = self.each(|o| self.model.residual_with_joint_jacobian(self.values, o).1);
        // Of the recording's own length or angle where it has one: its column is that of the shared one.
        let moves = self.each(|o| {
            let (model, p) = self.model.in_recording(o.dwell.recording, self.values);
            model.residual_with_jacobian(&p, o).1
        });
        let column =
            |of: &DMatrix<f64>, i: usize, c: usize| -of.view((0, c), (linear.rows[i].len(), 1)).column(0);
        let joint = |j: usize| Channel {
            enters: EntersAt::Joint(j),
            unit: Unit::Radian,
            axes: vec![format!("q{}", j + 1)],
            columns: whiten_columns(linear, 1, |i, _| column(&turns[i], i, j)),
        };
        let joints: Vec<Channel> = (0..self.model.joint_count()).map(joint).collect();
        let chain = self.model.chain().parameters().iter().enumerate().filter(|(_, p)| {
            let length = p.unit == Unit::Metre && p.nominal.abs() > SHORTEST_M;
            length || p.name.ends_with(".alpha")
        });
        let parameters = chain.map(|(index, p)| Channel {
            enters: EntersAt::Part(p.name.clone()),
            axes: vec![p.name.clone()],
            unit: p.unit,
            columns: whiten_columns(linear, 1, |i, _| column(&moves[i], i, index)),
        });
        let parameters: Vec<Channel> = parameters.collect();
        let lengths_m = self.model.lengths_m();
        let grown = |i: usize, _| {
            let none = DVector::zeros(linear.rows[i].len());
            lengths_m.iter().fold(none, |sum, (k, m)| sum + column(&moves[i], i, *k) * *m)
        };
        let lengths = Channel {
            enters: EntersAt::Lengths,
            axes: vec!["lengths".to_owned()],
            unit: Unit::One,
            columns: whiten_columns(linear, 1, grown),
        };
        let world = Channel {
            enters: EntersAt::World,
            axes: ["world.x", "world.y", "world.z"].map(str::to_owned).to_vec(),
            unit: Unit::Metre,
            columns: whiten_columns(linear, 3, |i, axis| {
                displacement_rows(linear, i, &Vector3::ith(axis, 1.0))
            }),
        };
        let tilts = self.tilts(linear);
        let belts = self.belts(&joints);
        joints
            .into_iter()
            .chain(belts)
            .chain(parameters)
            .chain([lengths])
            .chain(tilts)
            .chain([world])
            .collect()
    }

    /// A base that gives rocks about its horizontal axes.
    fn tilts(&self, linear: &Linearisation) -> Vec<Channel> {
        let arms = self.model.chain().arms();
        let tilt = |arm: usize| {
            let centre = self.model.arm_base_in_world(self.values, arm).translation.vector;
            let rocked = |i: usize, axis: usize| {
                let (o, about) = (&self.observations[i], Vector3::ith(axis, 1.0));
                let moved = match o.against() {
                    // Both rock with it.
                    Some(Against::Feature(to)) if self.model.arm_of(to) == self.model.arm_of(o.feature) => {
                        Vector3::zeros()
                    }
                    // The other tip is that of this arm: it moves away from where it was.
                    Some(Against::Feature(to)) if self.model.arm_of(to) == arm => {
                        about.cross(&(centre - self.model.measured_tip_in_world(self.values, o)))
                    }
                    _ if self.model.arm_of(o.feature) == arm => {
                        about.cross(&(self.model.predicted_tip_in_world(self.values, o) - centre))
                    }
                    _ => Vector3::zeros(),
                };
                let mut rows = displacement_rows(linear, i, &moved);
                if rows.len() == 6 {
                    rows.rows_mut(3, 3).copy_from(&about);
                }
                rows
            };
            let of = arms.get(arm).map_or_else(String::new, |arm| format!(" of {}", arm.name));
            Channel {
                enters: EntersAt::Part(format!("tilt of the base{of}")),
                axes: Vec::new(),
                unit: Unit::Radian,
                columns: whiten_columns(linear, 2, rocked),
            }
        };
        (0..arms.len().max(1)).map(tilt).collect()
    }

    /// A belt from the base keeps the forearm's direction.
    fn belts(&self, joints: &[Channel]) -> Vec<Channel> {
        let arms = self.model.chain().arms();
        let mut all: Vec<Range<usize>> = arms.iter().map(|arm| arm.joints.clone()).collect();
        if all.is_empty() {
            all.push(0..joints.len());
        }
        let belt = |own: &Range<usize>| {
            let (upper, fore) = (own.start + 1, own.start + 2);
            Channel {
                enters: EntersAt::Part(format!(
                    "joint{} with the direction of joint{} kept",
                    upper + 1,
                    fore + 1
                )),
                axes: Vec::new(),
                unit: Unit::Radian,
                columns: Arc::new(joints[upper].columns.as_ref() - joints[fore].columns.as_ref()),
            }
        };
        all.iter().filter(|own| own.len() > 2).map(belt).collect()
    }

    fn each<T>(&self, of: impl Fn(&Observation) -> T) -> Vec<T> {
        self.observations.iter().map(of).collect()
    }
}

/// Whitened columns from what they do to the rows of each observation.
fn whiten_columns(
    linear: &Linearisation,
    axes: usize,
    raw: impl Fn(usize, usize) -> DVector<f64>,
) -> Arc<DMatrix<f64>> {
    let mut columns = DMatrix::zeros(linear.residual.len(), axes);
    for pose in &linear.poses {
        for axis in 0..axes {
            let mut own = DVector::zeros(pose.rows.len());
            for i in pose.observations.clone() {
                let rows = &linear.rows[i];
                own.rows_mut(rows.start - pose.rows.start, rows.len()).copy_from(&raw(i, axis));
            }
            columns
                .view_mut((pose.rows.start, axis), (pose.rows.len(), 1))
                .copy_from(&(&pose.whitener * own));
        }
    }
    Arc::new(columns)
}

/// What a displacement in the world [m] of what an observation measured does to its rows; it turns nothing.
fn displacement_rows(linear: &Linearisation, observation: usize, by_m: &Vector3<f64>) -> DVector<f64> {
    linear.to_metres[observation].tr_mul(by_m)
}
