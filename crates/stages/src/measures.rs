//! Which dwells were measured against places of the model: fixed points and planes, or another tip.
//!
//! An instrument says it by reading something. Without one, dwells whose nominal tips are near belong, of several points to the
//! nearest, and the calibration shows which of them were not measured after all.

use crate::RunError;
use crate::joined_tips;
use crate::observe::{Observed, dwell_observation};
use crate::placed::Placed;
use crate::seen::RecordingData;
use armcal_calibrate::{Calibration, align_frames, expected_norm_m, fit_frames, position_covariance_m2};
use armcal_config::{Measure, MeasureKind, Pipeline};
use armcal_core::{
    Against, Code, Dwell, DwellId, FeatureId, Observation, Reference, Rejection, Severity, Stage, Warning,
};
use armcal_model::Model;
use nalgebra::Matrix3;
use std::collections::{BTreeMap, BTreeSet};

/// What is near and where the places are depend on each other.
const MAX_ROUNDS: usize = 5;
/// A calibrated error this many times what the noise explains is that of a tip that was not there,
const OPEN_FACTOR: f64 = 10.0;
/// if it is more than this share of what is allowed to the nominal arm too: a joint's play puts tips millimetres off that were
/// there, and whoever left these dwells out would never see it.
const OPEN_SHARE: f64 = 0.1;

/// What dwells of joined tips are held to.
type Check = fn(&Model, [FeatureId; 2], &[Observation]) -> Result<(), RunError>;

/// Every measurement that each dwell may be.
pub struct Measures<'a> {
    pipeline: &'a Pipeline,
    measures: Vec<Measure>,
    all: Vec<Candidate>,
}

/// A dwell as one measurement.
struct Candidate {
    measure: usize,
    observation: Observation,
}

impl<'a> Measures<'a> {
    /// Of the dwells of all recordings.
    pub fn of(pipeline: &'a Pipeline, seen: &[RecordingData]) -> Measures<'a> {
        let measures = pipeline.measures();
        let mut all = Vec::new();
        for (recording, seen) in seen.iter().enumerate() {
            for dwell in &seen.dwells {
                for (measure, m) in measures.iter().enumerate().filter(|(_, m)| m.is_in(recording)) {
                    let Some((reference, sigma_m)) = dwell_reference(m, dwell) else { continue };
                    let covariance_m2 = Matrix3::identity() * sigma_m.powi(2);
                    let of_tip = dwell_observation(dwell, seen, reference, covariance_m2);
                    let observation = Observation { feature: m.feature, ..of_tip };
                    all.push(Candidate { measure, observation });
                }
            }
        }
        Measures { pipeline, measures, all }
    }

    /// Whether nothing is measured against a place.
    pub fn is_empty(&self) -> bool {
        self.measures.is_empty()
    }

    /// The candidates that the nominal arm may be near enough to, with the bases of two arms placed: both together, because a
    /// dwell that does not belong would pull a frame away. `sure` are observations by sensor and table.
    ///
    /// # Errors
    /// A measurement that no dwell is near to; joined tips that do not move, or too few dwells of them; parameters that each
    /// recording is to have for itself.
    pub fn near(&self, geometry: &mut Model, sure: &[Observation]) -> Result<Vec<bool>, RunError> {
        let fit = &self.pipeline.fit;
        if self.pipeline.recordings.len() > 1 && !self.pipeline.pool.per_recording.is_empty() {
            let problem = "which dwells are joined, or at a place, is found with one base for all recordings, so that [pool] \
                           per_recording is for `armcal pool`: run each recording by itself, and pool the results";
            return Err(RunError::TwoArms { problem: problem.to_owned() });
        }
        self.check_joined(geometry, &vec![true; self.all.len()], joined_tips::both_move)?;
        let mut near = self.at_first(geometry, sure)?;
        for _ in 0..MAX_ROUNDS {
            let used = self.enough(geometry, &near, sure)?;
            joined_tips::place_bases(geometry, &align_frames(geometry, &used, fit)?);
            // A length must not pull the base: the frames alone are fitted before a dwell is judged.
            let start = fit_frames(geometry, &used, fit)?;
            let again = self.nearest(geometry, &start, &|_| true);
            if again == near {
                break;
            }
            near = again;
        }
        self.enough(geometry, &near, sure)?;
        self.check_joined(geometry, &near, joined_tips::both_move)?;
        self.check_joined(geometry, &near, joined_tips::check_spread)?;
        Ok(near)
    }

    /// Before any of it is fitted: a dwell may be at a place where the start of that says so, once what a sensor saw has placed the
    /// arm. How joined tips stand to each other is not known yet.
    fn at_first(&self, geometry: &Model, sure: &[Observation]) -> Result<Vec<bool>, RunError> {
        let start = match sure.is_empty() {
            true => geometry.nominal(),
            false => fit_frames(geometry, sure, &self.pipeline.fit)?,
        };
        Ok(self.nearest(geometry, &start, &|m| matches!(m.against, Against::Fixed(_))))
    }

    /// Candidates within what is allowed, of those in points the nearest of their dwell; all where `judged` has no say.
    fn nearest(&self, model: &Model, p: &[f64], judged: &dyn Fn(&Measure) -> bool) -> Vec<bool> {
        let error_m: Vec<f64> = self.all.iter().map(|c| error_m(model, p, &c.observation)).collect();
        let mut least: BTreeMap<DwellId, f64> = BTreeMap::new();
        let in_points = |c: &Candidate| self.measures[c.measure].kind == MeasureKind::Coincide;
        for (c, error_m) in self.all.iter().zip(&error_m).filter(|(c, _)| in_points(c)) {
            let own = least.entry(c.observation.dwell).or_insert(f64::INFINITY);
            *own = own.min(*error_m);
        }
        let is_near = |(c, error_m): (&Candidate, &f64)| {
            let m = &self.measures[c.measure];
            let beside = in_points(c) && least.get(&c.observation.dwell).is_some_and(|least| error_m > least);
            m.reading_m.is_some() || !judged(m) || (*error_m <= m.max_gap_m && !beside)
        };
        self.all.iter().zip(&error_m).map(is_near).collect()
    }

    /// Of the candidates that are near, those that the calibrated model closes.
    pub fn closing(&self, model: &Model, calibration: &Calibration, near: &[bool]) -> Vec<bool> {
        let (p, scale) = (calibration.fit.values(), calibration.fit.sigma_scale.max(1.0));
        self.all.iter().zip(near).map(|(c, near)| *near && self.closes(model, &p, scale, c)).collect()
    }

    /// Whether a calibrated model has a tip where it was measured, as far as noise and a joint's play let it.
    fn closes(&self, model: &Model, p: &[f64], scale: f64, c: &Candidate) -> bool {
        let allowed_m = OPEN_SHARE * self.measures[c.measure].max_gap_m;
        let o = &c.observation;
        error_m(model, p, o) <= allowed_m.max(OPEN_FACTOR * expected_m(model, p, o) * scale)
    }

    /// The dwells that a calibrated model shows to be measured, with those of sensor and table; frames that nobody knows are
    /// fitted to them. And what was fitted, and left out.
    ///
    /// # Errors
    /// A measurement that no dwell is near to, too few dwells of joined tips.
    pub fn judged(
        &self,
        placed: &mut Placed,
        sure: &[Observation],
    ) -> Result<(Vec<Observation>, Vec<Warning>), RunError> {
        let mut which =
            self.nearest(&placed.model, &placed.calibrated, &|m| matches!(m.against, Against::Fixed(_)));
        let mut round = 1;
        loop {
            let known = self.enough(&placed.model, &which, sure)?;
            let mut said = placed.fit_frames(self.pipeline, &known)?;
            let (model, p) = (&placed.model, &placed.calibrated);
            // What does not belong may still pull the frames at first.
            let again: Vec<bool> = match round {
                1 => self.nearest(model, p, &|_| true),
                _ => self.all.iter().map(|c| self.closes(model, p, 1.0, c)).collect(),
            };
            if (again != which || round == 1) && round < MAX_ROUNDS {
                (which, round) = (again, round + 1);
                continue;
            }
            said.extend(self.left_out(model, p, &which));
            return Ok((known, said));
        }
    }

    /// What a verification says of dwells that it does not judge: of joined tips, which could have been closed in any.
    fn left_out(&self, model: &Model, p: &[f64], which: &[bool]) -> Option<Warning> {
        let joined = |c: &Candidate| matches!(self.measures[c.measure].against, Against::Feature(_));
        let open = self.all.iter().zip(which).filter(|(c, chosen)| joined(c) && !**chosen);
        let least_m =
            open.clone().map(|(c, _)| error_m(model, p, &c.observation)).fold(f64::INFINITY, f64::min);
        let count = open.count();
        let message = format!(
            "{count} of {} dwells are not judged as joined: by the calibrated model their tips are {:.1} mm from closing or more",
            self.all.iter().filter(|c| joined(c)).count(),
            least_m * 1e3
        );
        let notice =
            || Warning::new(Severity::Notice, Stage::Calibrate, Code::TipsOpen, "closed_chain", message);
        (count > 0).then(notice)
    }

    /// Adds what was chosen to the observations by sensor and table, dwell by dwell.
    ///
    /// # Errors
    /// Too few dwells of joined tips.
    pub fn add(&self, observed: &mut Observed, which: &[bool]) -> Result<(), RunError> {
        if self.is_empty() {
            return Ok(());
        }
        self.enough_joined(which)?;
        observed.observations.extend(self.chosen(which, |_| true));
        observed.observations.sort_by_key(|o| o.dwell);
        let used: BTreeSet<DwellId> = observed.observations.iter().map(|o| o.dwell).collect();
        observed.rejections.retain(|r| !used.contains(&r.dwell));
        Ok(())
    }

    /// Why the dwells that were not chosen were not, as the calibrated model has them.
    pub fn explain(&self, rejections: &mut [Rejection], model: &Model, calibration: &Calibration) {
        let (p, scale) = (calibration.fit.values(), calibration.fit.sigma_scale.max(1.0));
        for rejection in rejections {
            let own = self.all.iter().filter(|c| c.observation.dwell == rejection.dwell);
            let off = own.map(|c| (c, error_m(model, &p, &c.observation)));
            let Some((c, off_m)) = off.min_by(|a, b| a.1.total_cmp(&b.1)) else { continue };
            let noise_mm = expected_m(model, &p, &c.observation) * scale * 1e3;
            rejection.why = match self.measures[c.measure].against {
                Against::Feature(_) => format!(
                    "the tips are not joined: the calibrated arms are {:.1} mm from closing, the noise explains {noise_mm:.2} mm",
                    off_m * 1e3
                ),
                Against::Fixed(_) => format!(
                    "it is no measurement: the calibrated arm is {:.1} mm from `{}`, the nearest, and the noise explains \
                     {noise_mm:.2} mm",
                    off_m * 1e3,
                    self.measures[c.measure].name
                ),
            };
        }
    }

    /// Those of the measurements that `wanted` accepts, by their places among all.
    fn chosen(&self, which: &[bool], wanted: impl Fn(usize) -> bool) -> Vec<Observation> {
        let chosen = self.all.iter().zip(which).filter(|(c, chosen)| **chosen && wanted(c.measure));
        chosen.map(|(c, _)| c.observation.clone()).collect()
    }

    /// Holds the chosen dwells of joined tips to a check, where there are any.
    fn check_joined(&self, model: &Model, which: &[bool], check: Check) -> Result<(), RunError> {
        let Some((at, joins)) = self.joins() else { return Ok(()) };
        check(model, joins, &self.chosen(which, |measure| measure == at))
    }

    /// The measurement of joined tips, and these.
    fn joins(&self) -> Option<(usize, [FeatureId; 2])> {
        let joins = |(at, m): (usize, &Measure)| match m.against {
            Against::Feature(to) => Some((at, [m.feature, to])),
            Against::Fixed(_) => None,
        };
        self.measures.iter().enumerate().find_map(joins)
    }

    /// Refuses joined tips that too few of the chosen dwells show.
    fn enough_joined(&self, which: &[bool]) -> Result<(), RunError> {
        let Some(((at, _), closure)) = self.joins().zip(self.pipeline.closed_chain.as_ref()) else {
            return Ok(());
        };
        let dwells = self.all.iter().filter(|c| c.measure == at).count();
        let joined = self.chosen(which, |measure| measure == at);
        joined_tips::check_pose_count(closure, &joined, (dwells, self.pipeline.two_arms.is_some()))
    }

    /// What the frames are placed by, if every measurement was made.
    fn enough(
        &self,
        model: &Model,
        near: &[bool],
        sure: &[Observation],
    ) -> Result<Vec<Observation>, RunError> {
        self.enough_joined(near)?;
        let p = model.nominal();
        for (at, m) in self.measures.iter().enumerate() {
            let own = || self.all.iter().zip(near).filter(|(c, _)| c.measure == at);
            if !own().any(|(_, near)| *near) {
                let off = own().map(|(c, _)| error_m(model, &p, &c.observation));
                return Err(never_made(m, off.fold(f64::INFINITY, f64::min)));
            }
        }
        let mut all = sure.to_vec();
        all.extend(self.chosen(near, |_| true));
        all.sort_by_key(|o| o.dwell);
        Ok(all)
    }
}

/// What a dwell is as a measurement, and its standard error [m]; none where its instrument reads nothing.
fn dwell_reference(measure: &Measure, dwell: &Dwell) -> Option<(Reference, f64)> {
    let (reading_m, own_m) = match measure.reading_m {
        None => (0.0, 0.0),
        Some([low_m, high_m]) => {
            let read = dwell.gauges.get(&measure.name)?;
            (low_m..=high_m).contains(&read.mean_m).then_some((read.mean_m, read.sigma_m))?
        }
    };
    let (to, length) = (measure.against, measure.length);
    let reference = match measure.kind {
        MeasureKind::Coincide => Reference::Joined { to },
        MeasureKind::Number(kind) => Reference::Number { kind: kind.name.into(), to, length, reading_m },
    };
    Some((reference, measure.sigma_m.hypot(own_m)))
}

/// The error of a measurement that no dwell is, the nearest being this far off [m].
fn never_made(measure: &Measure, least_m: f64) -> RunError {
    let problem = match least_m.is_finite() {
        true => format!(
            "the nominal arm is nowhere nearer to it than {:.0} mm, and {:.0} mm are allowed: say where it is (`at`), or raise \
             max_gap_mm",
            least_m * 1e3,
            measure.max_gap_m * 1e3
        ),
        false => {
            "its instrument reads nothing in any dwell: check `reading`, `range_mm` and `recordings`".into()
        }
    };
    RunError::Measure { name: measure.name.clone(), problem }
}

/// How far a dwell is from what was measured [m].
fn error_m(model: &Model, p: &[f64], o: &Observation) -> f64 {
    let (model, p) = model.in_recording(o.dwell.recording, p);
    model.residual(&p, o).position_m.norm()
}

/// How far noise puts it [m].
fn expected_m(model: &Model, p: &[f64], o: &Observation) -> f64 {
    let (model, p) = model.in_recording(o.dwell.recording, p);
    expected_norm_m(&position_covariance_m2(model, &p, o))
}
