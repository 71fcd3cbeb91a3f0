//! A fitted model seen by its observations: every candidate as columns, every way in for the unknown, every dwell.
//!
//! All candidates enter one model at zero amplitude, so one linearisation gives every column. Families with a shape to
//! be searched would make thousands of columns; where a shape only switches a column on (an event at a dwell) or
//! modulates a joint (a periodic error), the columns are kept as products.

use crate::DiagnoseError;
use crate::problem::{Amplitude, Candidate, Columns, DwellRow, Part, Problem, per_turn};
use crate::robot::group::{one_frequency, with_groups};
use crate::robot::knowledge::Knowledge;
use armcal_calibrate::{FitConfig, LinearAxis, LinearPose, Linearisation, linearise, linearise_more};
use armcal_core::Observation;
use armcal_model::{EffectSpec, Model, PlacedEffect, Session, Since, Toggle};
use nalgebra::{DMatrix, Matrix3};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Share of what an effect does by which it may differ from its derivative at zero, and still count as proportional.
const PROPORTIONAL: f64 = 0.02;

/// A fitted model seen by its observations.
pub(crate) struct View<'a> {
    pub model: &'a Model,
    pub values: &'a [f64],
    pub observations: &'a [Observation],
    pub session: &'a Session,
    pub fit: &'a FitConfig,
    pub sizes: &'a BTreeMap<String, Option<f64>>,
    pub knowledge: &'a Knowledge,
    /// The place of each pose, where it has one.
    pub places: &'a [Option<String>],
    /// What turns one joint, as seen around another fit of the same arm and observations.
    pub products: &'a RefCell<BTreeMap<String, Candidate>>,
}

impl View<'_> {
    pub fn problem(&self) -> Result<Problem, DiagnoseError> {
        let mut specs = self.model.candidates(self.session);
        specs.retain(|spec| self.tried(spec));
        let base = self.base()?;
        let channels = self.channels(&base);
        let (candidates, mut scans) = self.candidates_and_scans(&specs, &channels, &base)?;
        let mut problem = self.of(&base, candidates);
        problem.candidates = with_groups(problem.candidates);
        scans.extend(one_frequency(&scans, &problem.dwells, &base.residual));
        Ok(Problem { scans, channels, ..problem })
    }

    /// [`View::problem`] with nothing to weigh.
    pub fn problem_at(&self) -> Result<Problem, DiagnoseError> {
        Ok(self.of(&self.base()?, Vec::new()))
    }

    /// The rows of a linearised fit, with candidates.
    fn of(&self, base: &Linearisation, candidates: Vec<Candidate>) -> Problem {
        Problem {
            dwells: self.dwells(base),
            residual: base.residual.clone(),
            geometry: -&base.jacobian,
            geometry_offset: base.axes.iter().map(|a| a.offset).collect::<Vec<_>>().into(),
            geometry_precision: base.axes.iter().map(|a| a.precision).collect::<Vec<_>>().into(),
            candidates,
            scans: Vec::new(),
            channels: Vec::new(),
        }
    }

    /// Whether an effect may explain something: the model has it not yet, whatever a pipeline says of its parameters, and
    /// the user does not rule it out.
    pub(crate) fn tried(&self, spec: &EffectSpec) -> bool {
        let name = spec.to_string();
        let taken = self.model.effects().iter().any(|e| e.spec.to_string() == name);
        !taken && self.knowledge.tries(spec)
    }

    /// The model linearised at the fit.
    fn base(&self) -> Result<Linearisation, DiagnoseError> {
        Ok(linearise(self.model, self.observations, self.values, self.fit)?)
    }

    /// What effects do, each added to the model at zero.
    pub(crate) fn candidates(
        &self,
        specs: &[EffectSpec],
        base: &Linearisation,
    ) -> Result<Vec<Candidate>, DiagnoseError> {
        if specs.is_empty() {
            return Ok(Vec::new());
        }
        let model = self.model.with_effects(specs, self.session)?;
        let mut values = self.values.to_vec();
        let known = values.len();
        values.extend(&model.nominal()[known..]);
        let more = linearise_more(base, &model, self.observations, (&values, known), self.fit)?;
        let new = &model.effects()[self.model.effects().len()..];
        let mut all: Vec<Candidate> =
            new.iter().map(|effect| self.candidate(&model, effect, &more)).collect();
        for (candidate, effect) in all.iter_mut().zip(new) {
            if let Some(Some(size)) = self.sizes.get(&candidate.spec) {
                candidate.columns = Columns::Dense(Arc::new(self.secant(&effect.spec, *size)?));
            }
        }
        Ok(all)
    }

    /// Whether what an effect of one amplitude does at a size is more than its derivative at zero times that size.
    pub fn bends(&self, spec: &EffectSpec, size: f64) -> Result<bool, DiagnoseError> {
        let tangent = self.candidates(std::slice::from_ref(spec), &self.base()?)?;
        let Some(Candidate { columns: Columns::Dense(tangent), .. }) = tangent.first() else {
            return Ok(false);
        };
        let secant = self.secant(spec, size)?;
        Ok((&secant - tangent.as_ref()).norm() > PROPORTIONAL * tangent.norm())
    }

    /// What an effect of one amplitude does at a size, per typical size: a whitened column.
    fn secant(&self, spec: &EffectSpec, size: f64) -> Result<DMatrix<f64>, DiagnoseError> {
        let model = self.model.with_effects(std::slice::from_ref(spec), self.session)?;
        let mut values = self.values.to_vec();
        values.extend(&model.nominal()[values.len()..]);
        let amplitude = model.effects().last().map_or(0, |e| e.parameters.start);
        let without = linearise(&model, self.observations, &values, self.fit)?;
        values[amplitude] = size;
        let with = linearise(&model, self.observations, &values, self.fit)?;
        let typical = without.axes.iter().find(|a| a.index == amplitude).map_or(1.0, |a| a.scale);
        let change = (without.residual - with.residual) * (typical / size);
        Ok(DMatrix::from_column_slice(change.len(), 1, change.as_slice()))
    }

    fn candidate(
        &self,
        model: &Model,
        effect: &PlacedEffect,
        (axes, jacobian): &(Vec<LinearAxis>, DMatrix<f64>),
    ) -> Candidate {
        let amplitudes = effect.parameters.start..effect.parameters.start + effect.amplitudes;
        let own: Vec<usize> = (0..axes.len()).filter(|c| amplitudes.contains(&axes[*c].index)).collect();
        let prefix = format!("{}.", effect.spec);
        let amplitude = |column: &usize| {
            let axis = &axes[*column];
            let parameter = &model.parameters()[axis.index];
            let name = parameter.name.strip_prefix(&prefix).unwrap_or(&parameter.name).to_owned();
            let never_negative = effect.never_negative(&name);
            Amplitude { name, unit: parameter.unit, typical: axis.scale, never_negative }
        };
        Candidate {
            spec: effect.spec.to_string(),
            family: effect.spec.kind.clone(),
            target: self.target(&effect.spec),
            aliases: effect.kind.aliases.iter().map(|alias| (*alias).to_owned()).collect(),
            known: self.knowledge.acts(&effect.spec).map(str::to_owned),
            amplitudes: own.iter().map(amplitude).collect(),
            per_turn: per_turn(&effect.spec),
            toggle: toggle(effect),
            columns: Columns::Dense(Arc::new(-jacobian.select_columns(&own))),
        }
    }

    pub(crate) fn target(&self, spec: &EffectSpec) -> String {
        let joint = spec.target.and_then(|j| self.model.chain().joint_names().get(j).cloned());
        let at = spec.marker.as_ref().map(|name| format!("marker {name}")).or(joint);
        match (at, &spec.since) {
            (Some(at), None) => at,
            (Some(at), Some(since)) => format!("{at} {}", describe_since(since)),
            (None, Some(since)) => describe_since(since),
            (None, None) => {
                let number = spec.shape.iter().find(|(name, _)| name == "arm").map(|(_, number)| *number);
                let arms = self.model.chain().arms().iter().enumerate();
                let mut named = arms.filter(|(k, _)| Some((*k + 1) as f64) == number);
                named.next().map_or_else(|| "arm".to_owned(), |(_, arm)| arm.name.clone())
            }
        }
    }

    /// One observation of each pose: what it says of the arm holds of all of them.
    pub(crate) fn poses<'l>(&self, linear: &'l Linearisation) -> impl Iterator<Item = &'l Observation>
    where
        Self: 'l,
    {
        linear.poses.iter().map(|pose| &self.observations[pose.observations.start])
    }

    fn dwells(&self, linear: &Linearisation) -> Vec<DwellRow> {
        let of = |(pose, place): (&LinearPose, &Option<String>)| {
            let all = &self.observations[pose.observations.clone()];
            let o = &all[0];
            let drivers = self.model.drivers(self.session, o);
            DwellRow {
                id: o.dwell,
                first_row: pose.rows.start,
                rows: pose.rows.len(),
                parts: parts(linear, pose, all),
                time_s: drivers.time_s,
                joint_rad: o.joint_rad.clone(),
                arrival: drivers.arrival.clone(),
                torque_nm: drivers.torque().iter().map(|t| t.total_nm()).collect(),
                load_kg: o.all_loads_kg(),
                temperature_c: o.temperature_c,
                place: place.clone(),
                displaced: whitened_displacement(linear, pose, &Matrix3::identity(), |_| true),
                seat: self.seat(linear, pose),
            }
        };
        linear.poses.iter().zip(self.places).map(of).collect()
    }

    /// Whitened rows of a displacement by one declared standard deviation along each axis of the board, or of the world where
    /// nothing is held: of what a cavity holds, or of all that was seen.
    fn seat(&self, linear: &Linearisation, pose: &LinearPose) -> DMatrix<f64> {
        let all = &self.observations[pose.observations.clone()];
        let held = all.iter().any(|o| o.cavity().is_some());
        let of_place = |o: &Observation| o.cavity().is_some() == held;
        let board = if held { self.model.board_in_world(self.values, all[0].dwell.recording) } else { None };
        let axes = board.map_or(Matrix3::identity(), |board| *board.rotation.to_rotation_matrix().matrix());
        let variances_m2: Vec<f64> =
            all.iter().filter(|o| of_place(o)).map(|o| o.covariance_m2.trace()).collect();
        let sigma_m = (variances_m2.iter().sum::<f64>() / (3 * variances_m2.len()) as f64).sqrt();
        whitened_displacement(linear, pose, &axes, |i| of_place(&self.observations[i])) * sigma_m
    }
}

/// Whitened rows of a pose when those of its observations are displaced by 1 m along each of three axes.
fn whitened_displacement(
    linear: &Linearisation,
    pose: &LinearPose,
    axes: &Matrix3<f64>,
    those: impl Fn(usize) -> bool,
) -> DMatrix<f64> {
    let mut raw = DMatrix::zeros(pose.rows.len(), 3);
    for i in pose.observations.clone().filter(|i| those(*i)) {
        let at = linear.rows[i].start - pose.rows.start;
        raw.rows_mut(at, linear.rows[i].len()).copy_from(&linear.to_metres[i].tr_mul(axes));
    }
    &pose.whitener * raw
}

/// What was measured in a pose, and what its whitened rows are in metres.
fn parts(linear: &Linearisation, pose: &LinearPose, observations: &[Observation]) -> Vec<Part> {
    let raw = pose.whitener.clone().try_inverse();
    let raw = raw.unwrap_or_else(|| DMatrix::zeros(pose.rows.len(), pose.rows.len()));
    let part = |(i, o): (usize, &Observation)| {
        let rows = &linear.rows[i];
        Part {
            what: o.what(),
            rows: rows.len(),
            tracked: o.is_tracked(),
            metres: &linear.to_metres[i] * raw.rows(rows.start - pose.rows.start, rows.len()),
        }
    };
    pose.observations.clone().zip(observations).map(part).collect()
}

fn describe_since(since: &Since) -> String {
    match since {
        Since::Recording(recording) => format!("in recording {recording}"),
        Since::Dwell(dwell) => format!("from {dwell} on"),
        Since::Dwells { first, last } => format!("from {first} to dwell {last}"),
    }
}

fn toggle(effect: &PlacedEffect) -> Toggle {
    match effect.spec.since {
        Some(Since::Dwell(_) | Since::Dwells { .. }) => Toggle::Time,
        Some(Since::Recording(_)) => Toggle::Recording,
        None => effect.kind.toggle,
    }
}
