//! The closed chain as a [`Problem`]: closing error, derivative, covariance, symmetry.

use super::{ClosedChain, ClosedObservation, Closure, is_of_base};
use crate::CalibrateError;
use crate::model_problem::check_joints;
use crate::problem::{Problem, Symmetry};
use armcal_core::{Observation, Parameter, Pose, Reference, Unit};
use nalgebra::{DMatrix, DVector, Matrix3, Matrix3xX, Vector3};

/// A closed chain and the dwells in which it was closed.
pub struct ClosedChainProblem<'a> {
    chain: &'a ClosedChain,
    observations: Vec<&'a ClosedObservation>,
}

impl<'a> ClosedChainProblem<'a> {
    /// Checks that both arms are read completely in every observation.
    pub fn new(
        chain: &'a ClosedChain,
        observations: impl IntoIterator<Item = &'a ClosedObservation>,
    ) -> Result<ClosedChainProblem<'a>, CalibrateError> {
        let observations: Vec<&ClosedObservation> = observations.into_iter().collect();
        for o in &observations {
            for (arm, o) in chain.arms().iter().zip(&o.arms) {
                let observation = format!("{} of the {} arm", o.dwell, arm.name);
                if o.joint_rad.len() != arm.model.joint_count() {
                    let (n, of) = (o.joint_rad.len(), arm.model.joint_count());
                    let why = format!("{n} joint readings for an arm of {of}: check the names of its joints");
                    return Err(CalibrateError::Mismatch { observation, why });
                }
                check_joints(o, &observation)?;
            }
        }
        Ok(ClosedChainProblem { chain, observations })
    }

    /// The error of closure in the world [m]: what would have to be added to the second tip for the chain to close. Of
    /// a link, it lies along the link.
    pub fn closing_error_m(&self, block: usize, p: &[f64]) -> Vector3<f64> {
        let gap = self.gap_m(block, p);
        match self.chain.link_length_m(p) {
            None => gap,
            Some(length_m) => along(&gap) * (gap.norm() - length_m),
        }
    }

    /// Covariance of [`ClosedChainProblem::closing_error_m`] [m^2].
    pub fn closing_covariance_m2(&self, block: usize, p: &[f64]) -> Matrix3<f64> {
        let covariance = self.gap_covariance_m2(block, p);
        match self.chain.closure() {
            Closure::SamePoint => covariance,
            Closure::RigidLink { .. } => {
                let u = along(&self.gap_m(block, p));
                u * u.transpose() * (u.transpose() * covariance * u)[0]
            }
        }
    }

    /// tip_1 - tip_2 in the world [m].
    fn gap_m(&self, block: usize, p: &[f64]) -> Vector3<f64> {
        let [first, second] = [0, 1].map(|arm| {
            let model = &self.chain.arms()[arm].model;
            model.predicted_tip_in_world(self.chain.of_arm(arm, p), &self.observations[block].arms[arm])
        });
        first - second
    }

    /// Derivative of the gap by every parameter.
    fn gap_jacobian(&self, block: usize, p: &[f64]) -> Matrix3xX<f64> {
        let mut jacobian = Matrix3xX::zeros(p.len());
        for (arm, sign) in [(0, -1.0), (1, 1.0)] {
            let model = &self.chain.arms()[arm].model;
            // Measured minus predicted, with a measured position that is fixed: the derivative is minus the tip's.
            let o = &tracked(&self.observations[block].arms[arm]);
            let (_, of_residual) = model.residual_with_jacobian(self.chain.of_arm(arm, p), o);
            let first = self.chain.first(arm);
            jacobian.columns_mut(first, of_residual.ncols()).copy_from(&(of_residual.rows(0, 3) * sign));
        }
        jacobian
    }

    fn gap_covariance_m2(&self, block: usize, p: &[f64]) -> Matrix3<f64> {
        let o = self.observations[block];
        let mut covariance = Matrix3::identity() * o.contact_sigma_m.powi(2);
        for (arm, o) in o.arms.iter().enumerate() {
            let mut spread = self.chain.arms()[arm].model.joint_jacobian(self.chain.of_arm(arm, p), o);
            for (mut column, sigma) in spread.column_iter_mut().zip(&o.joint_sigma_rad) {
                column *= *sigma;
            }
            covariance += &spread * spread.transpose();
        }
        covariance
    }
}

impl Problem for ClosedChainProblem<'_> {
    fn parameters(&self) -> &[Parameter] {
        self.chain.parameters()
    }

    fn blocks(&self) -> usize {
        self.observations.len()
    }

    fn name(&self, block: usize) -> String {
        self.observations[block].dwell().to_string()
    }

    fn joint_rad(&self, block: usize) -> &[f64] {
        &self.observations[block].arms[0].joint_rad
    }

    fn residual(&self, block: usize, p: &[f64]) -> DVector<f64> {
        let gap = self.gap_m(block, p);
        match self.chain.link_length_m(p) {
            None => DVector::from_column_slice(gap.as_slice()),
            Some(length_m) => DVector::from_element(1, gap.norm() - length_m),
        }
    }

    fn linearised(&self, block: usize, p: &[f64]) -> (DVector<f64>, DMatrix<f64>) {
        let jacobian = self.gap_jacobian(block, p);
        let rows = match self.chain.closure() {
            Closure::SamePoint => DMatrix::from_fn(3, p.len(), |r, c| jacobian[(r, c)]),
            Closure::RigidLink { .. } => {
                let u = along(&self.gap_m(block, p));
                let mut row = DMatrix::from_fn(1, p.len(), |_, c| u.dot(&jacobian.column(c)));
                row[(0, p.len() - 1)] = -1.0;
                row
            }
        };
        (self.residual(block, p), rows)
    }

    fn covariance(&self, block: usize, p: &[f64]) -> DMatrix<f64> {
        let covariance = self.gap_covariance_m2(block, p);
        match self.chain.closure() {
            Closure::SamePoint => DMatrix::from_column_slice(3, 3, covariance.as_slice()),
            Closure::RigidLink { .. } => {
                let u = along(&self.gap_m(block, p));
                DMatrix::from_element(1, 1, (u.transpose() * covariance * u)[0])
            }
        }
    }

    /// All lengths growing by one factor about the base that is fixed: joint angles alone give shapes, not sizes.
    fn symmetries(&self, p: &[f64]) -> Vec<Symmetry> {
        let arms = self.chain.arms();
        let base_m = |arm: usize| -> Vector3<f64> {
            let pose: Pose = arms[arm].model.base_in_world(self.chain.of_arm(arm, p));
            pose.translation.vector
        };
        let is_fixed = |arm: &usize| !arms[*arm].model.parameters().iter().any(|p| p.free && is_of_base(p));
        let centre_m = base_m([0, 1].into_iter().find(is_fixed).unwrap_or(0));
        let mut direction = Vec::with_capacity(p.len());
        for (arm, own) in arms.iter().enumerate() {
            let from_centre = base_m(arm) - centre_m;
            for (parameter, value) in own.model.parameters().iter().zip(self.chain.of_arm(arm, p)) {
                direction.push(match parameter.name.as_str() {
                    "base.x" => from_centre.x,
                    "base.y" => from_centre.y,
                    "base.z" => from_centre.z,
                    _ if parameter.unit == Unit::Metre => *value,
                    _ => 0.0,
                });
            }
        }
        direction.extend(self.chain.link_length_m(p));
        let [a, b] = [&arms[0].name, &arms[1].name];
        let text = format!(
            "scale (every length of {a}, of {b} and between their bases, in proportion): growing together changes no joint \
             angle, and no length is known; measure one, such as a rigid link between the tips"
        );
        vec![Symmetry { direction, text }]
    }
}

/// Unit vector of a gap; any axis for none.
fn along(gap: &Vector3<f64>) -> Vector3<f64> {
    gap.try_normalize(0.0).unwrap_or_else(Vector3::x)
}

/// The same joints, seen by a sensor at the origin: the model's residual is minus its tip then.
fn tracked(o: &Observation) -> Observation {
    let position_m = Vector3::zeros();
    let reference = Reference::Tracked { position_m, orientation: None, orientation_sigma_rad: 0.0 };
    Observation { reference, ..o.clone() }
}
