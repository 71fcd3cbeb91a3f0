//! Two arms in one recording, their tips joined by hand and led from pose to pose.
//!
//! `PairConfig -> Pair (both arms built, bases placed) -> Motion (where the joined tips are, when) -> Log -> recording and
//! truth`. The geometry is the lab's own: axis lines ([`crate::arm`]), turned until both tips are where the hand is.
//!
//! [`observe`] goes the same way without streams: one mean reading of both arms a dwell.

mod config;
mod drives;
mod motion;
mod recorded;
mod truth;

pub use config::{JoinConfig, PairArmConfig, PairConfig, PairTaskConfig, TipsSeenConfig, TorsoConfig};
pub use truth::{PairArmTruth, PairDwellTruth, PairRecordingTruth, PairTruth};

use crate::arm::{AxisArm, DhRow};
use crate::checks::value_error;
use crate::quick::mean_encoder_readings;
use crate::random::{Purpose, Stream};
use crate::rig::{build_rows, small_motion};
use crate::truth::write_json;
use crate::{LabError, Simulated};
use armcal_core::{DwellId, Observation, Pose, Reference};
use motion::{Motion, Phase};
use nalgebra::Vector3;
use std::path::Path;

/// The pair of one seed, as built.
#[derive(Debug, Clone)]
pub(crate) struct Pair {
    pub arms: [BuiltArm; 2],
    /// What carries both, where something does: their world is the frame at its tip.
    pub torso: Option<BuiltArm>,
    /// Distance of the joined points; 0 for tips in one point [m].
    pub link_m: f64,
}

/// One arm as built and placed.
#[derive(Debug, Clone)]
pub(crate) struct BuiltArm {
    pub arm: AxisArm,
    pub rows: Vec<DhRow>,
    pub world_from_base: Pose,
}

/// What the pipeline would make of the recordings of a pair.
#[derive(Debug, Clone, PartialEq)]
pub struct ObservedPair {
    /// Both arms in every dwell with the tips joined. There is no reference: each arm is the other's.
    pub dwells: Vec<[Observation; 2]>,
    /// What was true.
    pub truth: PairTruth,
}

/// Simulates a pair and writes `<recording>.mcap` and `truth.json` into `out_dir`, made if need be.
pub fn simulate(config: &PairConfig, out_dir: &Path) -> Result<Simulated<PairTruth>, LabError> {
    config.check()?;
    let truth_path = out_dir.join(crate::TRUTH);
    crate::may_write(config.recordings.iter().map(String::as_str), out_dir, &truth_path)?;
    let pair = Pair::build(config);
    crate::make_folder(out_dir)?;
    let mut truth = PairTruth::of_pair(config, &pair);
    let mut recordings = Vec::new();
    for (recording, name) in config.recordings.iter().enumerate() {
        let motion = Motion::perform(config, &pair, recording)?;
        let log = recorded::pair_log(config, &pair, &motion, recording)?;
        let path = out_dir.join(crate::recording_file(name));
        crate::record::write(&path, &config.name, name, &log)?;
        truth.recordings.push(PairRecordingTruth::of_motion(config, &motion, recording));
        recordings.push(path);
    }
    write_json(&truth, &truth_path)?;
    Ok(Simulated { recordings, truth: truth_path, facts: truth })
}

/// Observes a pair without recording it.
pub fn observe(config: &PairConfig) -> Result<ObservedPair, LabError> {
    config.check()?;
    if config.carriers().iter().any(|arm| !arm.mechanisms.is_empty()) {
        let why = "what is in the drives depends on the way to a rest: simulate a recording".to_owned();
        return Err(value_error("arms.mechanisms", why));
    }
    let pair = Pair::build(config);
    let mut truth = PairTruth::of_pair(config, &pair);
    let mut dwells = Vec::new();
    for recording in 0..config.recordings.len() {
        let motion = Motion::perform(config, &pair, recording)?;
        let rests: Vec<&Phase> = motion.phases.iter().filter(|p| p.is_joined_rest()).collect();
        let mut draw = Stream::new(config.seed, Purpose::Quick, recording);
        for (dwell, rest) in rests.into_iter().enumerate() {
            let id = DwellId { recording, dwell };
            let time_ns = config.start_ns(recording) + (rest.mid_s() * 1e9) as i64;
            dwells.push([0, 1].map(|arm: usize| {
                let joints = &config.arms[arm].joints;
                let readings = (rest.end_s - rest.start_s) * joints.rate_hz;
                joined_observation(
                    id,
                    time_ns,
                    mean_encoder_readings(joints, &rest.to_rad[arm], readings, &mut draw),
                )
            }));
        }
        truth.recordings.push(PairRecordingTruth::of_motion(config, &motion, recording));
    }
    Ok(ObservedPair { dwells, truth })
}

impl Pair {
    /// Builds both arms of the configured seed and places them.
    pub fn build(config: &PairConfig) -> Pair {
        let built = |which: usize, arm: &PairArmConfig| {
            let mut geometry = Stream::new(config.seed, Purpose::Geometry, which);
            let rows = build_rows(&arm.rows, &arm.deviation, &mut geometry);
            let mut placing = Stream::new(config.seed, Purpose::Mounting, which);
            let off = small_motion(&mut placing, [arm.placement_sigma_mm, arm.placement_sigma_deg]);
            BuiltArm { arm: AxisArm::from_rows(&rows), rows, world_from_base: Pose::from(arm.base) * off }
        };
        let mut making = Stream::new(config.seed, Purpose::Board, 0);
        let joined = &config.joined;
        let link_m = match joined.length_mm {
            None => 0.0,
            Some(length_mm) => (length_mm + joined.length_sigma_mm * making.normal()) * 1e-3,
        };
        let arms = [0, 1].map(|which: usize| built(which, &config.arms[which]));
        Pair { arms, torso: config.torso.as_ref().map(|torso| built(2, &torso.arm)), link_m }
    }

    /// The arms, then the torso.
    pub fn carriers(&self) -> Vec<&BuiltArm> {
        self.arms.iter().chain(&self.torso).collect()
    }
}

impl BuiltArm {
    /// The frame at the tip of an arm of one joint, in the world.
    pub fn tip_frame(&self, joint_rad: f64) -> Pose {
        self.world_from_base * self.arm.tip_pose(&[joint_rad])
    }

    /// The tip in the world [m].
    pub fn tip_in_world(&self, joint_rad: &[f64]) -> Vector3<f64> {
        (self.world_from_base * nalgebra::Point3::from(self.arm.tip(joint_rad))).coords
    }

    /// Joint angles that put the tip on a point of the world, near `start_rad`; the distance left [m] where it cannot.
    pub fn reach(&self, target_m: &Vector3<f64>, start_rad: &[f64]) -> Result<Vec<f64>, f64> {
        let in_base = self.world_from_base.inverse() * nalgebra::Point3::from(*target_m);
        self.arm.solve(&in_base.coords, start_rad).map_err(|out| out.short_by_m)
    }
}

fn joined_observation(
    dwell: DwellId,
    time_ns: i64,
    [joint_rad, joint_sigma_rad]: [Vec<f64>; 2],
) -> Observation {
    let bare = Observation::bare(dwell, joint_rad, Reference::position(Vector3::zeros()));
    Observation { time_ns, joint_sigma_rad, ..bare }
}

#[cfg(test)]
mod tests;
