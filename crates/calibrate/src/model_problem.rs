//! The calibration of a model against observations, as a [`Problem`].
//!
//! The covariance of an observation is what was measured plus what the encoders add:
//! `Sigma = Sigma_measured + J_q diag(sigma_q^2) J_q'`, with J_q = d tip / d joint reading; to sigma_q^2 comes the slack of
//! joints that rest anywhere in their gaps. Cross-covariance between
//! position and orientation enters through the encoders only.

use crate::problem::{Known, Linearised, Problem};
use crate::{CalibrateError, FitConfig, Scene};
use armcal_core::{Observation, Parameter, Reference};
use armcal_model::{Model, ModelResidual};
use nalgebra::{DMatrix, DVector, Matrix3, Matrix3xX};
use std::ops::Range;

/// Step of the central difference that turns joint noise into orientation noise [rad]. It feeds a covariance, not
/// the fit.
const JOINT_STEP_RAD: f64 = 1e-6;

/// Covariance of measured minus predicted position of an observation at parameters `p` [m^2].
pub fn position_covariance_m2(model: &Model, p: &[f64], o: &Observation) -> Matrix3<f64> {
    let mut jacobian = model.joint_jacobian(p, o);
    for (mut column, sigma) in jacobian.column_iter_mut().zip(joint_sigma_rad(model, p, o)) {
        column *= sigma;
    }
    o.covariance_m2 + &jacobian * jacobian.transpose()
}

/// How well the readings tell where the links stand: their own noise and the slack of the joints [rad].
fn joint_sigma_rad(model: &Model, p: &[f64], o: &Observation) -> Vec<f64> {
    let mut sigma_rad = o.joint_sigma_rad.clone();
    for (joint, variance_rad2) in model.slack(p, o) {
        sigma_rad[joint] = sigma_rad[joint].hypot(variance_rad2.sqrt());
    }
    sigma_rad
}

/// A model (or a pool of them) and the observations it should explain.
pub struct ModelProblem<'a> {
    scene: Scene<'a>,
    observations: Vec<&'a Observation>,
    use_orientation: bool,
}

impl<'a> ModelProblem<'a> {
    /// Checks that every observation is complete and finite. Orientation rows are used where
    /// `config.use_orientation` is set and the observation has them with a standard error above zero.
    pub fn new(
        scene: impl Into<Scene<'a>>,
        observations: impl IntoIterator<Item = &'a Observation>,
        config: &FitConfig,
    ) -> Result<ModelProblem<'a>, CalibrateError> {
        let (scene, observations) = (scene.into(), observations.into_iter().collect::<Vec<&Observation>>());
        for o in &observations {
            scene.check(o)?;
            check_complete(o)?;
        }
        Ok(ModelProblem { scene, observations, use_orientation: config.use_orientation })
    }

    /// The observations, in the order of the blocks.
    pub fn observations(&self) -> &[&'a Observation] {
        &self.observations
    }

    pub(crate) fn scene(&self) -> Scene<'a> {
        self.scene
    }

    /// Covariance of measured minus predicted position of a block at parameters `p` [m^2].
    pub fn position_covariance_m2(&self, block: usize, p: &[f64]) -> Matrix3<f64> {
        let (model, p) = self.scene.seen(self.observations[block], p);
        position_covariance_m2(model, &p, self.observations[block])
    }

    fn rows(&self, block: usize) -> usize {
        match &self.observations[block].reference {
            Reference::Tracked { orientation: Some(_), orientation_sigma_rad, .. }
                if self.use_orientation && *orientation_sigma_rad > 0.0 =>
            {
                6
            }
            _ => 3,
        }
    }

    /// The rows that are used.
    fn used(&self, block: usize, (residual, jacobian): (ModelResidual, DMatrix<f64>)) -> Linearised {
        let rows = self.rows(block);
        let jacobian = if jacobian.nrows() == rows { jacobian } else { jacobian.rows(0, rows).into_owned() };
        (DVector::from_iterator(rows, residual.rows().take(rows)), jacobian)
    }

    /// d orientation of the tip in world axes / d joint reading, by central differences.
    fn turning_jacobian(&self, p: &[f64], o: &Observation) -> Matrix3xX<f64> {
        let (model, p) = self.scene.seen(o, p);
        let base = model.base_in_world(&p).rotation;
        let mut jacobian = Matrix3xX::zeros(o.joint_rad.len());
        for joint in 0..o.joint_rad.len() {
            let at = |step: f64| {
                let mut q = o.joint_rad.clone();
                q[joint] += step;
                base * model.tip_in_base(&p, &q).rotation
            };
            let turn = (at(JOINT_STEP_RAD) * at(-JOINT_STEP_RAD).inverse()).scaled_axis();
            jacobian.set_column(joint, &(turn / (2.0 * JOINT_STEP_RAD)));
        }
        jacobian
    }
}

impl Problem for ModelProblem<'_> {
    fn parameters(&self) -> &[Parameter] {
        self.scene.parameters()
    }

    fn blocks(&self) -> usize {
        self.observations.len()
    }

    fn name(&self, block: usize) -> String {
        describe(self.observations[block])
    }

    fn joint_rad(&self, block: usize) -> &[f64] {
        &self.observations[block].joint_rad
    }

    fn residual(&self, block: usize, p: &[f64]) -> DVector<f64> {
        let (model, p) = self.scene.seen(self.observations[block], p);
        let residual = model.residual(&p, self.observations[block]);
        DVector::from_iterator(self.rows(block), residual.rows().take(self.rows(block)))
    }

    fn linearised(&self, block: usize, p: &[f64]) -> Linearised {
        let (model, p) = self.scene.seen(self.observations[block], p);
        self.used(block, model.residual_with_jacobian(&p, self.observations[block]))
    }

    fn linearised_each(&self, blocks: Range<usize>, p: &[f64]) -> Vec<Linearised> {
        let runs = self.scene.alike(&self.observations[blocks.clone()]);
        let linearised = runs.flat_map(|run| {
            let (model, p) = self.scene.seen(run[0], p);
            model.residuals_with_jacobians(&p, run)
        });
        let mut all = Vec::with_capacity(blocks.len());
        all.extend(blocks.zip(linearised).map(|(block, linearised)| self.used(block, linearised)));
        all
    }

    fn covariance(&self, block: usize, p: &[f64]) -> DMatrix<f64> {
        let o = self.observations[block];
        let rows = self.rows(block);
        let mut covariance = DMatrix::zeros(rows, rows);
        let Reference::Tracked { orientation_sigma_rad, .. } = o.reference else {
            covariance.copy_from(&self.position_covariance_m2(block, p));
            return covariance;
        };
        let mut spread = DMatrix::zeros(rows, o.joint_rad.len());
        let (model, own) = self.scene.seen(o, p);
        spread.rows_mut(0, 3).copy_from(&model.joint_jacobian(&own, o));
        covariance.view_mut((0, 0), (3, 3)).copy_from(&o.covariance_m2);
        if rows == 6 {
            spread.rows_mut(3, 3).copy_from(&self.turning_jacobian(p, o));
            (3..6).for_each(|k| covariance[(k, k)] = orientation_sigma_rad.powi(2));
        }
        for (mut column, sigma) in spread.column_iter_mut().zip(joint_sigma_rad(model, &own, o)) {
            column *= sigma;
        }
        covariance + &spread * spread.transpose()
    }

    fn noise_depends(&self) -> bool {
        self.scene.model().has_gaps()
    }

    fn known(&self) -> Vec<Known> {
        self.scene.known(&self.observations)
    }
}

/// `recording 0 dwell 12 (cavity circle03)`.
pub(crate) fn describe(o: &Observation) -> String {
    match o.cavity() {
        Some(cavity) => format!("{} (cavity {cavity})", o.dwell),
        None => o.dwell.to_string(),
    }
}

fn check_complete(o: &Observation) -> Result<(), CalibrateError> {
    let observation = describe(o);
    check_joints(o, &observation)?;
    let (what, values): (&'static str, Vec<f64>) = match &o.reference {
        Reference::Seated { in_board_m, .. } => {
            ("the position of the cavity", in_board_m.iter().copied().collect())
        }
        Reference::Tracked { position_m, .. } => {
            ("the measured position", position_m.iter().copied().collect())
        }
    };
    if !values.iter().all(|v| v.is_finite()) {
        return Err(not_finite(o, &observation, what));
    }
    if !o.covariance_m2.iter().all(|v| v.is_finite()) {
        return Err(CalibrateError::BadCovariance { observation });
    }
    Ok(())
}

/// One finite reading with a standard error for each joint.
pub(crate) fn check_joints(o: &Observation, observation: &str) -> Result<(), CalibrateError> {
    if o.joint_sigma_rad.len() != o.joint_rad.len() {
        let why = format!(
            "{} joint readings but {} standard errors of them: give one for each joint (0 when negligible)",
            o.joint_rad.len(),
            o.joint_sigma_rad.len()
        );
        return Err(CalibrateError::Mismatch { observation: observation.to_owned(), why });
    }
    if !o.joint_rad.iter().all(|v| v.is_finite()) {
        return Err(not_finite(o, observation, "a joint reading"));
    }
    if !o.joint_sigma_rad.iter().all(|v| v.is_finite() && *v >= 0.0) {
        return Err(not_finite(o, observation, "the standard error of a joint reading"));
    }
    Ok(())
}

fn not_finite(o: &Observation, observation: &str, what: &'static str) -> CalibrateError {
    let joint_rad = o.joint_rad.clone();
    CalibrateError::NotFinite {
        observation: observation.to_owned(),
        what,
        parameter: String::new(),
        joint_rad,
    }
}
