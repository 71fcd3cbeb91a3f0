//! Which dwells were measured against places of the model: fixed points and planes, or the tip of the other arm.
//!
//! An instrument says it by reading something. Without one, dwells whose nominal tips are near belong, of several points to the
//! nearest, and the calibration shows which of them were not measured after all.

use crate::error::Error;
use crate::pipeline::{Measure, MeasureKind};
use crate::setup::Inputs;
use crate::stages::observe::{Observed, observation};
use crate::two_arms;
use armcal_calibrate::{Calibration, align_frames, expected_norm_m, fit_frames, position_covariance_m2};
use armcal_core::{Against, Dwell, DwellId, Observation, Reference, Rejection};
use armcal_model::Model;
use nalgebra::Matrix3;
use std::collections::BTreeMap;

/// What is near and where the places are depend on each other.
const MAX_ROUNDS: usize = 5;
/// A calibrated error this many times what the noise explains is that of a tip that was not there,
const OPEN_FACTOR: f64 = 10.0;
/// if it is more than this share of what is allowed to the nominal arm too: a joint's play puts tips millimetres off that were
/// there, and whoever left these dwells out would never see it.
const OPEN_SHARE: f64 = 0.1;

/// Every measurement that each dwell may be.
pub struct Measures<'a> {
    inputs: &'a Inputs,
    measures: Vec<Measure>,
    all: Vec<Candidate>,
}

/// A dwell as one measurement.
struct Candidate {
    measure: usize,
    observation: Observation,
}

impl Measures<'_> {
    /// Of the dwells of all recordings.
    pub fn of(inputs: &Inputs) -> Measures<'_> {
        let measures = inputs.pipeline.measures();
        let mut all = Vec::new();
        for (recording, seen) in inputs.seen.iter().enumerate() {
            for dwell in &seen.dwells {
                for (measure, m) in measures.iter().enumerate().filter(|(_, m)| m.is_in(recording)) {
                    let Some((reference, sigma_m)) = m.reference(dwell) else { continue };
                    let covariance_m2 = Matrix3::identity() * sigma_m.powi(2);
                    let of_tip = observation(dwell, seen, reference, covariance_m2);
                    let observation = Observation { feature: m.feature, ..of_tip };
                    all.push(Candidate { measure, observation });
                }
            }
        }
        Measures { inputs, measures, all }
    }

    /// Whether nothing is measured against a place.
    pub fn is_empty(&self) -> bool {
        self.measures.is_empty()
    }

    /// The candidates that the nominal arm may be near enough to, with the bases of two arms placed: both together, because a
    /// dwell that does not belong would pull a frame away. `sure` are observations by sensor and table.
    ///
    /// # Errors
    /// A measurement that no dwell is near to; arms that do not move, or too few dwells of them.
    pub fn near(&self, geometry: &mut Model, sure: &[Observation]) -> Result<Vec<bool>, Error> {
        if self.is_empty() {
            return Ok(Vec::new());
        }
        let fit = &self.inputs.pipeline.fit;
        two_arms::check::both_move(geometry, &self.chosen(&vec![true; self.all.len()]))?;
        let mut near = self.at_first(geometry, sure)?;
        for _ in 0..MAX_ROUNDS {
            let used = self.enough(geometry, &near, sure)?;
            two_arms::check::place_bases(geometry, &align_frames(geometry, &used, fit)?);
            // A length must not pull the base: the frames alone are fitted before a dwell is judged.
            let start = fit_frames(geometry, &used, fit)?;
            let again = self.nearest(geometry, &start, &|_| true);
            if again == near {
                break;
            }
            near = again;
        }
        let used = self.enough(geometry, &near, sure)?;
        two_arms::check::both_move(geometry, &self.chosen(&near))?;
        two_arms::check::spread(geometry, &used)?;
        Ok(near)
    }

    /// Before any of it is fitted: a dwell may be at a place where the start of that says so, once what a sensor saw has placed the
    /// arm. How two arms stand to each other is not known yet.
    fn at_first(&self, geometry: &Model, sure: &[Observation]) -> Result<Vec<bool>, Error> {
        let start = match sure.is_empty() {
            true => geometry.nominal(),
            false => fit_frames(geometry, sure, &self.inputs.pipeline.fit)?,
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
        let closes = |c: &Candidate| {
            let allowed_m = OPEN_SHARE * self.measures[c.measure].max_gap_m;
            let o = &c.observation;
            error_m(model, &p, o) <= allowed_m.max(OPEN_FACTOR * expected_m(model, &p, o) * scale)
        };
        self.all.iter().zip(near).map(|(c, near)| *near && closes(c)).collect()
    }

    /// Adds what was chosen to the observations by sensor and table, dwell by dwell.
    pub fn add(&self, observed: &mut Observed, which: &[bool]) {
        if self.is_empty() {
            return;
        }
        observed.observations.extend(self.chosen(which));
        observed.observations.sort_by_key(|o| o.dwell);
        let used: std::collections::BTreeSet<DwellId> =
            observed.observations.iter().map(|o| o.dwell).collect();
        observed.rejections.retain(|r| !used.contains(&r.dwell));
    }

    /// Why the dwells that were not chosen were not, as the calibrated model has them.
    pub fn explain(&self, observed: &mut Vec<Rejection>, model: &Model, calibration: &Calibration) {
        let (p, scale) = (calibration.fit.values(), calibration.fit.sigma_scale.max(1.0));
        for rejection in observed {
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

    fn chosen(&self, which: &[bool]) -> Vec<Observation> {
        self.all
            .iter()
            .zip(which)
            .filter(|(_, chosen)| **chosen)
            .map(|(c, _)| c.observation.clone())
            .collect()
    }

    /// What the frames are placed by, if every measurement was made.
    fn enough(
        &self,
        geometry: &Model,
        near: &[bool],
        sure: &[Observation],
    ) -> Result<Vec<Observation>, Error> {
        let joined = self.chosen(near);
        if let Some(arms) = &self.inputs.pipeline.two_arms {
            two_arms::check::enough(&arms.closure, &joined, self.all.len())?;
        }
        let p = geometry.nominal();
        for (at, m) in self.measures.iter().enumerate() {
            let mut own = self.all.iter().zip(near).filter(|(c, _)| c.measure == at);
            if own.clone().any(|(_, near)| *near) {
                continue;
            }
            let least_m =
                own.clone().map(|(c, _)| error_m(geometry, &p, &c.observation)).fold(f64::INFINITY, f64::min);
            let problem = match own.next() {
                Some(_) => format!(
                    "the nominal arm is nowhere nearer to it than {:.0} mm, and {:.0} mm are allowed: say where it is (`at`), or \
                     raise max_gap_mm",
                    least_m * 1e3,
                    m.max_gap_m * 1e3
                ),
                None => {
                    "its instrument reads nothing in any dwell: check `reading`, `range_mm` and `recordings`"
                        .into()
                }
            };
            return Err(Error::Measure { name: m.name.clone(), problem });
        }
        let mut all = sure.to_vec();
        all.extend(joined);
        all.sort_by_key(|o| o.dwell);
        Ok(all)
    }
}

impl Measure {
    fn is_in(&self, recording: usize) -> bool {
        self.recordings.as_ref().is_none_or(|own| own.contains(&recording))
    }

    /// What a dwell is as this measurement, and its standard error [m]; none where its instrument reads nothing.
    fn reference(&self, dwell: &Dwell) -> Option<(Reference, f64)> {
        let (reading_m, own_m) = match self.reading_m {
            None => (0.0, 0.0),
            Some([low_m, high_m]) => {
                let read = dwell.gauges.get(&self.name)?;
                (low_m..=high_m).contains(&read.mean_m).then_some((read.mean_m, read.sigma_m))?
            }
        };
        let reference = match (self.kind, self.against) {
            (MeasureKind::Coincide, to) => Reference::Joined { to },
            (MeasureKind::Distance, from) => Reference::Apart { from, length: self.length, reading_m },
            (MeasureKind::Plane, Against::Fixed(plane)) => Reference::Above { plane, reading_m },
            (MeasureKind::Plane, Against::Feature(_)) => return None,
        };
        Some((reference, self.sigma_m.hypot(own_m)))
    }
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
