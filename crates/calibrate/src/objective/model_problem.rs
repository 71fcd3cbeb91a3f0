//! The calibration of a model against observations, as a [`Problem`].
//!
//! The covariance of an observation is what was measured plus what the encoders add:
//! `Sigma = Sigma_measured + J_q diag(sigma_q^2) J_q'`, with J_q = d tip / d joint reading; to sigma_q^2 comes the slack of
//! joints that rest anywhere in their gaps. Cross-covariance between position and orientation, and between the features that
//! were measured in one dwell, enters through the encoders only: a block is all that was measured in a dwell.

use crate::objective::joined::scale_symmetry;
use crate::objective::poses::measured_together;
use crate::objective::problem::{Known, Linearised, Problem, Symmetry, Told};
use crate::{CalibrateError, FitConfig, Objective};
use armcal_core::{Observation, Parameter};
use armcal_model::{Asked, Model, ModelResidual};
use nalgebra::{Cholesky, Const, DMatrix, DVector, Matrix3, Matrix3xX, Vector3};
use std::borrow::Cow;
use std::ops::Range;

/// Step of the central difference that turns joint noise into orientation noise [rad]. It feeds a covariance, not
/// the fit.
const JOINT_STEP_RAD: f64 = 1e-6;

/// Covariance of measured minus predicted position of an observation at parameters `p` [m^2]; where only a distance is known,
/// of what lies along it.
pub fn position_covariance_m2(model: &Model, p: &[f64], o: &Observation) -> Matrix3<f64> {
    let mut jacobian = model.joint_jacobian(p, o);
    for (mut column, sigma) in jacobian.column_iter_mut().zip(joint_sigma_rad(model, p, o)) {
        column *= sigma;
    }
    let covariance = o.covariance_m2 + &jacobian * jacobian.transpose();
    match distance_direction(model, p, o) {
        Some(along) => along * along.transpose() * along.dot(&(covariance * along)),
        None => covariance,
    }
}

/// What displacements of an observation weigh against its noise.
pub enum PositionNoise {
    /// All three coordinates are known.
    Full(Cholesky<f64, Const<3>>),
    /// Only what lies along a unit vector is, with this variance [m^2].
    Along(Vector3<f64>, f64),
}

impl PositionNoise {
    /// Of an observation at parameters `p`; `None` where its covariance is none.
    pub fn of(model: &Model, p: &[f64], o: &Observation) -> Option<PositionNoise> {
        let covariance_m2 = position_covariance_m2(model, p, o);
        match distance_direction(model, p, o) {
            Some(along) => Some(PositionNoise::Along(along, along.dot(&(covariance_m2 * along)))),
            None => covariance_m2.cholesky().map(PositionNoise::Full),
        }
    }

    /// A displacement [m] by the inverse of the covariance [1/m].
    pub fn weigh(&self, displacement_m: &Vector3<f64>) -> Vector3<f64> {
        match self {
            PositionNoise::Full(covariance) => covariance.solve(displacement_m),
            PositionNoise::Along(along, variance_m2) => along * (along.dot(displacement_m) / variance_m2),
        }
    }
}

/// Where only the distance of an observation is known, the unit vector along it.
fn distance_direction(model: &Model, p: &[f64], o: &Observation) -> Option<Vector3<f64>> {
    // Of all others it is known without following the arm.
    if !o.is_scalar() {
        return None;
    }
    model.residual(p, o).along
}

/// The position part of a residual in units of its standard deviations, one a row and zero in rows that it does not have;
/// `None` where its covariance is none.
pub(crate) fn whiten_position(
    residual: &ModelResidual,
    covariance_m2: &Matrix3<f64>,
) -> Option<Vector3<f64>> {
    if let Some(along) = residual.along {
        let variance_m2 = along.dot(&(covariance_m2 * along));
        let white = along.dot(&residual.position_m) / variance_m2.sqrt();
        return (variance_m2 > 0.0).then(|| Vector3::new(white, 0.0, 0.0));
    }
    covariance_m2.cholesky().and_then(|c| c.l().solve_lower_triangular(&residual.position_m))
}

/// How well the readings tell where the links stand: their own noise and the slack of the joints [rad].
fn joint_sigma_rad(model: &Model, p: &[f64], o: &Observation) -> Vec<f64> {
    let mut sigma_rad = o.joint_sigma_rad.clone();
    for (joint, variance_rad2) in model.slack(p, o) {
        sigma_rad[joint] = sigma_rad[joint].hypot(variance_rad2.sqrt());
    }
    sigma_rad
}

/// A model and the observations it should explain.
pub struct ModelProblem<'a> {
    model: &'a Model,
    observations: Vec<&'a Observation>,
    /// The observations of each block: those of one dwell that stand behind each other, each of another feature.
    blocks: Vec<Range<usize>>,
    use_orientation: bool,
}

impl<'a> ModelProblem<'a> {
    /// Checks that every observation is complete and finite. Orientation rows are used where
    /// `config.use_orientation` is set and the observation has them with a standard error above zero.
    pub fn new(
        model: &'a Model,
        observations: impl IntoIterator<Item = &'a Observation>,
        config: &FitConfig,
    ) -> Result<ModelProblem<'a>, CalibrateError> {
        let observations: Vec<&Observation> = observations.into_iter().collect();
        for o in &observations {
            model.check(std::slice::from_ref(o))?;
            check_complete(o)?;
            if config.objective == Objective::Paper && model.known_in(o.dwell.recording).is_some() {
                return Err(not_recording_by_recording());
            }
        }
        // The paper's objective counts distances, one by one.
        let blocks = match config.objective {
            Objective::Paper => (0..observations.len()).map(|i| i..i + 1).collect(),
            _ => measured_together(&observations),
        };
        Ok(ModelProblem { model, observations, blocks, use_orientation: config.use_orientation })
    }

    /// The observations, in the order of the blocks.
    pub fn observations(&self) -> &[&'a Observation] {
        &self.observations
    }

    pub(crate) fn model(&self) -> &'a Model {
        self.model
    }

    /// The rows of an observation that are used.
    fn rows(&self, o: &Observation) -> usize {
        let is_known = |(_, sigma_rad): (_, f64)| self.use_orientation && sigma_rad > 0.0;
        if o.seen_orientation().is_some_and(is_known) { 6 } else { o.position_rows() }
    }

    /// The rows of each observation among those of all, in the order given.
    pub(crate) fn rows_of_each(&self) -> Vec<Range<usize>> {
        let mut end = 0;
        let rows = self.observations.iter().map(|o| {
            let first = end;
            end += self.rows(o);
            first..end
        });
        rows.collect()
    }

    /// What the rows of an observation are in the world: 3 x its rows, times them the displacement [m] that its feature is off.
    /// A displacement moves what is predicted of the rows by the transpose of it.
    pub(crate) fn to_metres(&self, observation: usize, p: &[f64]) -> Matrix3xX<f64> {
        let o = self.observations[observation];
        let (model, p) = self.model.in_recording(o.dwell.recording, p);
        match distance_direction(model, &p, o) {
            Some(along) => Matrix3xX::from_columns(&[along]),
            None => Matrix3xX::identity(self.rows(o)),
        }
    }

    /// The runs of observations that are one block each.
    pub(crate) fn runs(&self) -> &[Range<usize>] {
        &self.blocks
    }

    /// The rows that are used.
    fn used(&self, o: &Observation, (residual, jacobian): (ModelResidual, DMatrix<f64>)) -> Linearised {
        let rows = self.rows(o);
        let jacobian = if jacobian.nrows() == rows { jacobian } else { jacobian.rows(0, rows).into_owned() };
        (DVector::from_iterator(rows, residual.rows().take(rows)), jacobian)
    }

    /// Columns of the readings' standard errors: what they do to the rows of an observation.
    fn spread(&self, o: &Observation, p: &[f64]) -> DMatrix<f64> {
        let (rows, (model, p)) = (self.rows(o), self.model.in_recording(o.dwell.recording, p));
        let mut spread = DMatrix::zeros(rows, o.joint_rad.len());
        let moved = model.joint_jacobian(&p, o);
        match distance_direction(model, &p, o) {
            Some(along) => spread.row_mut(0).copy_from(&(along.transpose() * moved)),
            None => spread.rows_mut(0, 3).copy_from(&moved),
        }
        if rows == 6 {
            spread.rows_mut(3, 3).copy_from(&turning_jacobian(model, &p, o));
        }
        for (mut column, sigma) in spread.column_iter_mut().zip(joint_sigma_rad(model, &p, o)) {
            column *= sigma;
        }
        spread
    }

    /// Covariance of what was measured of an observation, without what the encoders add.
    fn measured(&self, o: &Observation, p: &[f64]) -> DMatrix<f64> {
        let (rows, (model, p)) = (self.rows(o), self.model.in_recording(o.dwell.recording, p));
        if let Some(along) = distance_direction(model, &p, o) {
            return DMatrix::from_element(1, 1, along.dot(&(o.covariance_m2 * along)));
        }
        let mut covariance = DMatrix::zeros(rows, rows);
        covariance.view_mut((0, 0), (3, 3)).copy_from(&o.covariance_m2);
        if let Some((_, sigma_rad)) = o.seen_orientation() {
            (3..rows).for_each(|k| covariance[(k, k)] = sigma_rad.powi(2));
        }
        covariance
    }

    fn of_block(&self, block: usize) -> &[&'a Observation] {
        &self.observations[self.blocks[block].clone()]
    }

    /// The observations of neighbouring blocks; none of no blocks.
    fn of_blocks(&self, blocks: &Range<usize>) -> Option<&[&'a Observation]> {
        let (first, last) = (self.blocks.get(blocks.start)?, self.blocks.get(blocks.end.checked_sub(1)?)?);
        self.observations.get(first.start..last.end)
    }
}

/// d orientation of a feature in world axes / d joint reading, by central differences.
fn turning_jacobian(model: &Model, p: &[f64], o: &Observation) -> Matrix3xX<f64> {
    let base = model.base_in_world(p).rotation;
    let mut jacobian = Matrix3xX::zeros(o.joint_rad.len());
    for joint in 0..o.joint_rad.len() {
        let at = |step: f64| {
            let mut q = o.joint_rad.clone();
            q[joint] += step;
            base * model.feature_in_base(p, o.feature, &q).rotation
        };
        let turn = (at(JOINT_STEP_RAD) * at(-JOINT_STEP_RAD).inverse()).scaled_axis();
        jacobian.set_column(joint, &(turn / (2.0 * JOINT_STEP_RAD)));
    }
    jacobian
}

/// Linearised rows one below the other.
fn stack_rows(mut parts: Vec<Linearised>) -> Linearised {
    if parts.len() == 1 {
        return parts.swap_remove(0);
    }
    let rows = parts.iter().map(|(residual, _)| residual.len()).sum();
    let columns = parts.first().map_or(0, |(_, jacobian)| jacobian.ncols());
    let (mut residual, mut jacobian) = (DVector::zeros(rows), DMatrix::zeros(rows, columns));
    let mut at = 0;
    for (part, of_part) in parts {
        residual.rows_mut(at, part.len()).copy_from(&part);
        jacobian.rows_mut(at, part.len()).copy_from(&of_part);
        at += part.len();
    }
    (residual, jacobian)
}

impl Problem for ModelProblem<'_> {
    fn parameters(&self) -> &[Parameter] {
        self.model.parameters()
    }

    fn blocks(&self) -> usize {
        self.blocks.len()
    }

    fn observations_of(&self, block: usize) -> usize {
        self.blocks[block].len()
    }

    fn name(&self, block: usize) -> String {
        describe_observation(self.of_block(block)[0])
    }

    fn joint_rad(&self, block: usize) -> &[f64] {
        &self.of_block(block)[0].joint_rad
    }

    fn residual(&self, block: usize, p: &[f64]) -> DVector<f64> {
        let mut residual = Vec::new();
        self.residual_each(block..block + 1, p, &mut |_, rows| residual.extend_from_slice(rows));
        DVector::from_vec(residual)
    }

    fn residual_each(&self, blocks: Range<usize>, p: &[f64], each: &mut dyn FnMut(usize, &[f64])) {
        let Some(of_blocks) = self.of_blocks(&blocks) else { return };
        let (mut block, mut seen, mut rows) = (blocks.start, 0, Vec::new());
        let mut of = |o: &Observation, residual: ModelResidual| {
            rows.extend(residual.rows().take(self.rows(o)));
            seen += 1;
            if seen == self.blocks[block].len() {
                each(block, &rows);
                rows.clear();
                (block, seen) = (block + 1, 0);
            }
        };
        self.model.residuals(p, of_blocks, self.use_orientation, &mut of);
    }

    fn linearised(&self, block: usize, p: &[f64]) -> Linearised {
        let of = |o: &&Observation| {
            let (model, p) = self.model.in_recording(o.dwell.recording, p);
            self.used(o, model.residual_with_jacobian(&p, o))
        };
        stack_rows(self.of_block(block).iter().map(of).collect())
    }

    fn linearised_each(&self, blocks: Range<usize>, p: &[f64], asked: &Asked<'_>, each: &mut Told<'_>) {
        let Some(of_blocks) = self.of_blocks(&blocks) else { return };
        let (mut block, mut parts) = (blocks.start, Vec::new());
        let mut of = |o: &Observation, residual: ModelResidual, jacobian: DMatrix<f64>| {
            parts.push(self.used(o, (residual, jacobian)));
            if parts.len() == self.blocks[block].len() {
                each(block, Cow::Owned(stack_rows(std::mem::take(&mut parts))));
                block += 1;
            }
        };
        for run in self.model.alike(of_blocks) {
            let (model, p) = self.model.in_recording(run[0].dwell.recording, p);
            model.residuals_with_jacobians(&p, run, (asked, self.use_orientation), &mut of);
        }
    }

    fn covariance(&self, block: usize, p: &[f64]) -> DMatrix<f64> {
        let all = self.of_block(block);
        let spreads: Vec<DMatrix<f64>> = all.iter().map(|o| self.spread(o, p)).collect();
        let rows = spreads.iter().map(DMatrix::nrows).sum();
        let mut covariance = DMatrix::zeros(rows, rows);
        let mut at = 0;
        for (o, spread) in all.iter().zip(&spreads) {
            let own = self.measured(o, p) + spread * spread.transpose();
            covariance.view_mut((at, at), own.shape()).copy_from(&own);
            let mut before = 0;
            for other in spreads.iter().take_while(|other| !std::ptr::eq(*other, spread)) {
                let shared = spread * other.transpose();
                covariance
                    .view_mut((before, at), (shared.ncols(), shared.nrows()))
                    .copy_from(&shared.transpose());
                covariance.view_mut((at, before), shared.shape()).copy_from(&shared);
                before += other.nrows();
            }
            at += own.nrows();
        }
        covariance
    }

    fn noise_depends(&self) -> bool {
        self.model.has_gaps()
    }

    fn symmetries(&self, p: &[f64]) -> Vec<Symmetry> {
        if self.observations.iter().any(|o| o.against().is_none()) {
            return Vec::new();
        }
        vec![scale_symmetry(self.model, p)]
    }

    fn known(&self) -> Vec<Known> {
        let (mut known, mut end) = (Vec::new(), 0);
        // The blocks of a recording hold its observations, and no others.
        let block = |observation: usize| self.blocks.partition_point(|run| run.start < observation);
        for run in self.model.alike(&self.observations) {
            let blocks = block(end)..block(end + run.len());
            end += run.len();
            let parameters = run.first().and_then(|o| self.model.known_in(o.dwell.recording));
            known.extend(parameters.map(|parameters| Known { blocks, parameters: parameters.to_vec() }));
        }
        known
    }
}

/// `recording 0 dwell 12 (cavity circle03)`.
pub(crate) fn describe_observation(o: &Observation) -> String {
    match o.cavity() {
        Some(cavity) => format!("{} (cavity {cavity})", o.dwell),
        None => o.dwell.to_string(),
    }
}

fn check_complete(o: &Observation) -> Result<(), CalibrateError> {
    let observation = describe_observation(o);
    check_joints(o, &observation)?;
    let (what, values) = o.measured_values();
    if !values.iter().all(|v| v.is_finite()) {
        return Err(not_finite(o, &observation, what));
    }
    if !o.covariance_m2.iter().all(|v| v.is_finite()) {
        return Err(CalibrateError::BadCovariance { observation });
    }
    Ok(())
}

fn not_recording_by_recording() -> CalibrateError {
    CalibrateError::BadConfig {
        key: "fit.objective",
        value: "\"paper\"".into(),
        why:
            "the sum of distances is not solved recording by recording; give \"robust\" or \"least-squares\""
                .into(),
    }
}

/// One finite reading with a standard error for each joint.
fn check_joints(o: &Observation, observation: &str) -> Result<(), CalibrateError> {
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
