//! From dwells of both arms to a calibration: which dwells are joined -> where the other base is -> fit.

use super::ClosedChainSection;
use super::closure::ClosureKind;
use crate::error::Error;
use crate::pipeline::Pipeline;
use crate::setup::Inputs;
use crate::stages::past::Placed;
use crate::stages::perceive::Seen;
use crate::stages::{frames, observe};
use crate::story::Fitted;
use armcal_calibrate::{
    HoldoutConfig, align_frames, calibrate, expected_norm_m, fit_frames, position_covariance_m2,
};
use armcal_core::{FeatureId, Observation, Reference, Rejection, Role, Severity, Stage, Warning};
use armcal_model::Model;
use nalgebra::{Matrix3, Vector3};

/// Which dwells are joined and where the other base is depend on each other; so do fit and outliers.
const MAX_ROUNDS: usize = 5;
/// A calibrated closing error this many times what the noise explains is that of tips that are not joined,
const OPEN_FACTOR: f64 = 10.0;
/// if it is more than this share of what is allowed to nominal arms too: a joint's play puts tips millimetres apart that are
/// joined, and whoever left these dwells out would never see it.
const OPEN_SHARE: f64 = 0.1;
/// An arm none of whose joints moves by as much is not led through poses [rad]: 1 deg.
const LEAST_MOTION_RAD: f64 = 1.0 * std::f64::consts::PI / 180.0;

/// Tips that are spread over less than this share of their distance from the base are not led through poses: whatever is wrong with
/// the arms, they close.
const LEAST_SPREAD: f64 = 0.03;

/// Calibrates on the dwells in which the tips are joined, and on what a sensor saw in any.
///
/// # Errors
/// An arm that never moves, too few dwells that are joined, a calibration that cannot be made, parameters that each recording is
/// to have for itself.
pub fn fit_joined(
    inputs: &Inputs,
    closure: &ClosedChainSection,
    told: &mut dyn FnMut(usize),
) -> Result<Fitted, Error> {
    let Inputs { pipeline, chain, seen, changes, .. } = inputs;
    if seen.len() > 1 && !pipeline.pool.per_recording.is_empty() {
        let problem = "which dwells are joined is found with one base for all recordings, so that [pool] per_recording is for \
                       `armcal pool`: run each recording by itself, and pool the results";
        return Err(Error::TwoArms { problem: problem.to_owned() });
    }
    let mut geometry = frames::nominal_model(pipeline, chain, None, seen)?;
    frames::change_nominals(&mut geometry, changes)?;
    let search = Search::of(pipeline, closure, &geometry, seen);
    search.check_both_move(&geometry, &search.all)?;
    let near = search.near(&mut geometry)?;
    let effects = frames::effect_specs(pipeline, &geometry)?;
    let model = match effects.is_empty() {
        true => geometry.clone(),
        false => geometry.with_effects(&effects, &frames::session(pipeline, &search.with_seen(&near)))?,
    };
    search.settled(geometry, model, near, told)
}

/// Every dwell, as if its tips were joined: the second is the reference for the first.
fn joined(seen: &[Seen], closure: &ClosedChainSection, [feature, to]: [FeatureId; 2]) -> Vec<Observation> {
    let apart = closure.kind == ClosureKind::RigidLink;
    let covariance_m2 = Matrix3::identity() * (closure.sigma_mm * 1e-3).powi(2);
    let joined = |(dwell, load_kg)| Observation {
        feature,
        ..observe::observation(dwell, load_kg, Reference::Joined { to, apart }, covariance_m2)
    };
    let dwells = seen.iter().flat_map(|seen| seen.dwells.iter().map(|dwell| (dwell, seen.load_kg)));
    dwells.map(joined).collect()
}

/// The dwells, in some of which the tips are joined.
pub struct Search<'a> {
    pipeline: &'a Pipeline,
    closure: &'a ClosedChainSection,
    /// The two points.
    joins: [FeatureId; 2],
    all: Vec<Observation>,
    /// What a sensor saw beside.
    seen: Vec<Observation>,
}

impl<'a> Search<'a> {
    /// Of all dwells.
    pub fn of(
        pipeline: &'a Pipeline,
        closure: &'a ClosedChainSection,
        model: &Model,
        seen: &[Seen],
    ) -> Search<'a> {
        let joins = closure.joins(model);
        let all = joined(seen, closure, joins);
        Search { pipeline, closure, joins, all, seen: observe::seen_by_sensor(pipeline, seen) }
    }

    /// The dwells that a calibrated model shows to be joined, with what a sensor saw; frames that nobody knows are fitted to them.
    /// And what was fitted, and left out.
    pub fn judged(&self, placed: &mut Placed) -> Result<(Vec<Observation>, Vec<Warning>), Error> {
        let (mut is_joined, mut said) = (vec![true; self.all.len()], Vec::new());
        for round in 0..MAX_ROUNDS {
            self.enough(&self.chosen(&is_joined))?;
            said = placed.fit_frames(self.pipeline, &self.with_seen(&is_joined))?;
            let (model, p) = (&placed.model, &placed.calibrated);
            let closes = |o: &Observation| match round {
                // Open dwells may still pull the frames.
                0 => closing_error_m(model, p, o) <= self.limit_m(),
                _ => self.closes(model, p, 1.0, o),
            };
            let again: Vec<bool> = self.all.iter().map(closes).collect();
            let settled = round > 0 && again == is_joined;
            is_joined = again;
            if settled {
                break;
            }
        }
        said.extend(self.told_open(placed, &is_joined));
        Ok((self.with_seen(&is_joined), said))
    }

    /// How many dwells are not judged, and why.
    fn told_open(&self, placed: &Placed, is_joined: &[bool]) -> Option<Warning> {
        let open = self.all.iter().zip(is_joined).filter(|(_, joined)| !**joined);
        let apart_m: Vec<f64> =
            open.map(|(o, _)| closing_error_m(&placed.model, &placed.calibrated, o)).collect();
        let least_m = apart_m.iter().copied().reduce(f64::min)?;
        let message = format!(
            "{} of {} dwells are not judged as joined: by the calibrated model their tips are {:.1} mm from closing or more",
            apart_m.len(),
            self.all.len(),
            least_m * 1e3
        );
        Some(Warning::new(Severity::Notice, Stage::Calibrate, "tips-open", "closed_chain", message))
    }

    /// Whether a calibrated model brings the tips together, as far as noise and a joint's play let it.
    fn closes(&self, model: &Model, p: &[f64], scale: f64, o: &Observation) -> bool {
        let noise_m = expected_norm_m(&position_covariance_m2(model, p, o)) * scale;
        closing_error_m(model, p, o) <= (OPEN_SHARE * self.limit_m()).max(OPEN_FACTOR * noise_m)
    }

    /// Places the base that nobody knows, and finds the dwells that the nominal arms may have closed: both together, because
    /// an open dwell would pull the base away.
    fn near(&self, geometry: &mut Model) -> Result<Vec<bool>, Error> {
        let (fit, limit_m) = (&self.pipeline.fit, self.limit_m());
        let mut near = vec![true; self.all.len()];
        for _ in 0..MAX_ROUNDS {
            self.enough(&self.chosen(&near))?;
            let known = self.with_seen(&near);
            place_bases(geometry, &align_frames(geometry, &known, fit)?);
            // A link's length must not pull the base: the frames alone are fitted before a dwell is judged.
            let start = fit_frames(geometry, &known, fit)?;
            let again: Vec<bool> =
                self.all.iter().map(|o| closing_error_m(geometry, &start, o) <= limit_m).collect();
            if again == near {
                break;
            }
            near = again;
        }
        let joined = self.chosen(&near);
        self.enough(&joined)?;
        self.check_both_move(geometry, &joined)?;
        self.check_spread(geometry, &joined)?;
        Ok(near)
    }

    /// Calibrates, and leaves out what turns out not to have been joined, until every dwell stays where it is.
    fn settled(
        &self,
        geometry: Model,
        model: Model,
        near: Vec<bool>,
        told: &mut dyn FnMut(usize),
    ) -> Result<Fitted, Error> {
        let pipeline = self.pipeline;
        let mut is_joined = near.clone();
        let mut rounds = 0;
        loop {
            rounds += 1;
            told(rounds);
            self.enough(&self.chosen(&is_joined))?;
            let known = self.with_seen(&is_joined);
            // Only the last fit is judged; those on the way to it need no hold-out.
            let search = calibrate(&model, &known, &pipeline.fit, &HoldoutConfig::None)?;
            let (p, scale) = (search.fit.values(), search.fit.sigma_scale.max(1.0));
            let expected_m =
                |o: &Observation| expected_norm_m(&position_covariance_m2(&model, &p, o)) * scale;
            let closes = |o: &Observation| self.closes(&model, &p, scale, o);
            let again: Vec<bool> = self.all.iter().zip(&near).map(|(o, near)| *near && closes(o)).collect();
            if again != is_joined && rounds < MAX_ROUNDS {
                is_joined = again;
                continue;
            }
            let open = |(o, joined): (&Observation, &bool)| {
                let why = format!(
                    "the tips are not joined: the calibrated arms are {:.1} mm from closing, the noise explains {:.2} mm",
                    closing_error_m(&model, &p, o) * 1e3,
                    expected_m(o) * 1e3
                );
                let is_seen = self.seen.iter().any(|seen| seen.dwell == o.dwell);
                // A dwell that a sensor saw is used all the same.
                (!joined && !is_seen).then_some(Rejection { dwell: o.dwell, why })
            };
            let rejections = self.all.iter().zip(&is_joined).filter_map(open).collect();
            let calibration = calibrate(&model, &known, &pipeline.fit, &pipeline.holdout)?;
            let places = vec![None; pipeline.recordings.len()];
            // What is looked at here has settled, whatever the rounds.
            let rounds = 1;
            return Ok(Fitted {
                geometry,
                model,
                observations: known,
                calibration,
                places,
                rejections,
                rounds,
            });
        }
    }

    fn limit_m(&self) -> f64 {
        self.closure.max_gap_mm * 1e-3
    }

    fn chosen(&self, which: &[bool]) -> Vec<Observation> {
        self.all.iter().zip(which).filter(|(_, chosen)| **chosen).map(|(o, _)| o.clone()).collect()
    }

    /// The chosen dwells with what a sensor saw, dwell by dwell.
    fn with_seen(&self, which: &[bool]) -> Vec<Observation> {
        let mut all = self.chosen(which);
        all.extend(self.seen.iter().cloned());
        all.sort_by_key(|o| o.dwell);
        all
    }

    /// What is at one of the points: an arm, or a branch.
    fn name(&self, geometry: &Model, end: usize) -> String {
        let arm = geometry.chain().arms().get(end).map(|arm| format!("the {} arm", arm.name));
        arm.unwrap_or_else(|| format!("what carries {}", geometry.feature_name(self.joins[end])))
    }

    /// Refuses joints at one end that are held in one pose throughout: nothing can be learnt of them.
    fn check_both_move(&self, geometry: &Model, dwells: &[Observation]) -> Result<(), Error> {
        for end in 0..2 {
            let [own, other] = [end, 1 - end].map(|k| geometry.joints_to(self.joins[k]));
            let range = |joint: &usize| {
                let of = dwells.iter().map(|o| o.joint_rad[*joint]);
                of.clone().fold(f64::NEG_INFINITY, f64::max) - of.fold(f64::INFINITY, f64::min)
            };
            let own = own.iter().filter(|joint| !other.contains(joint));
            let widest_rad = own.map(range).fold(0.0, f64::max);
            if dwells.len() < 2 || widest_rad >= LEAST_MOTION_RAD {
                continue;
            }
            let problem = format!(
                "{} never moves: over {} dwells none of its joints changes by more than {:.3} deg; lead both through many poses, \
                 or check its topic and joint names",
                self.name(geometry, end),
                dwells.len(),
                widest_rad.to_degrees()
            );
            return Err(Error::TwoArms { problem });
        }
        Ok(())
    }

    /// Refuses tips that hardly move: readings in another unit close as well as any.
    fn check_spread(&self, geometry: &Model, joined: &[Observation]) -> Result<(), Error> {
        let p = geometry.nominal();
        for end in 0..2 {
            let tip_m = |o: &Observation| {
                geometry.feature_in_base(&p, self.joins[end], &o.joint_rad).translation.vector
            };
            let tips_m: Vec<Vector3<f64>> = joined.iter().map(tip_m).collect();
            let mean_m = tips_m.iter().sum::<Vector3<f64>>() / tips_m.len() as f64;
            let square =
                tips_m.iter().map(|m| (m - mean_m).norm_squared()).sum::<f64>() / tips_m.len() as f64;
            let reach_m = tips_m.iter().map(|m| m.norm()).fold(0.0, f64::max);
            if square.sqrt() < LEAST_SPREAD * reach_m {
                let problem = format!(
                    "the tip of {} is within {:.1} mm of one point in all joined dwells, {:.0} mm from its base: lead both through \
                     poses that differ more, or check the unit of its readings",
                    self.name(geometry, end),
                    square.sqrt() * 1e3,
                    reach_m * 1e3
                );
                return Err(Error::TwoArms { problem });
            }
        }
        Ok(())
    }

    /// Three points place a base, six distances do; twice as many also show which dwells do not belong. A pose held twice
    /// counts once.
    fn enough(&self, joined: &[Observation]) -> Result<(), Error> {
        let least = match self.closure.kind {
            ClosureKind::SamePoint => 6,
            ClosureKind::RigidLink => 12,
        };
        let poses = different_poses(joined);
        if poses >= least {
            return Ok(());
        }
        let problem = format!(
            "{} of {} dwells of both arms have their tips within {:.0} mm of closing, in {poses} different poses; {least} are \
             the least that place one arm against the other and show which dwells do not belong: record more poses with the \
             tips joined, or check joint names, signs and units, {}closed_chain.length_mm and closed_chain.max_gap_mm",
            joined.len(),
            self.all.len(),
            self.limit_m() * 1e3,
            if self.pipeline.two_arms.is_some() { "arms.base, " } else { "" },
        );
        Err(Error::TwoArms { problem })
    }
}

/// How far the joined tips are from where each arm puts the other [m].
fn closing_error_m(model: &Model, p: &[f64], o: &Observation) -> f64 {
    model.residual(p, o).position_m.norm()
}

/// Lets every estimated base start where it was aligned.
pub fn place_bases(geometry: &mut Model, aligned: &[f64]) {
    for arm in 0..geometry.chain().bases() {
        let own = &geometry.parameters()[geometry.base_parameters(arm)];
        if own.iter().any(|p| p.free && p.role == Role::EstimatedFrame) {
            let base = geometry.arm_base_in_world(aligned, arm);
            geometry.set_arm_base_start(arm, base);
        }
    }
}

/// Poses that differ from all earlier ones by [`LEAST_MOTION_RAD`] in some joint.
fn different_poses(joined: &[Observation]) -> usize {
    let mut poses: Vec<&[f64]> = Vec::new();
    for q in joined.iter().map(|o| o.joint_rad.as_slice()) {
        let same = |pose: &&[f64]| pose.iter().zip(q).all(|(a, b)| (a - b).abs() < LEAST_MOTION_RAD);
        if !poses.iter().any(same) {
            poses.push(q);
        }
    }
    poses.len()
}
