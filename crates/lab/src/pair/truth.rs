//! The sealed truth of a pair. Only assertions read it.

use super::motion::Motion;
use super::{Pair, PairConfig};
use crate::truth::{Deviation, PoseTruth, row_deviations};
use serde::{Deserialize, Serialize};

/// Everything that was true.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PairTruth {
    /// Format of this file: `armcal.pair-truth/1`.
    pub schema: String,
    /// The configuration, seed included.
    pub config: PairConfig,
    /// The arms.
    pub arms: [PairArmTruth; 2],
    /// Distance of the joined points; 0 for tips in one point [m].
    pub link_m: f64,
    /// The recordings.
    pub recordings: Vec<PairRecordingTruth>,
}

/// One arm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PairArmTruth {
    /// Its name.
    pub name: String,
    /// Its deviations from nominal, SI, under the model's parameter names (`right.joint2.theta`, [rad] and [m]).
    pub deviations: Vec<Deviation>,
    /// Its base in the world.
    pub world_from_base: PoseTruth,
}

/// One recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PairRecordingTruth {
    /// Its name.
    pub name: String,
    /// Its duration [s].
    pub duration_s: f64,
    /// Every rest, in order of time.
    pub dwells: Vec<PairDwellTruth>,
}

/// One rest of both arms.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PairDwellTruth {
    /// Start [ns].
    pub start_ns: i64,
    /// End [ns].
    pub end_ns: i64,
    /// Whether the tips were joined.
    pub joined: bool,
    /// Joint angles of both arms [rad].
    pub joint_rad: [Vec<f64>; 2],
}

impl PairTruth {
    pub(crate) fn of_pair(config: &PairConfig, pair: &Pair) -> PairTruth {
        let arms = [0, 1].map(|arm: usize| {
            let (drawn, built) = (&config.arms[arm], &pair.arms[arm]);
            let prefixed = |d: Deviation| Deviation { name: format!("{}.{}", drawn.name, d.name), ..d };
            PairArmTruth {
                name: drawn.name.clone(),
                deviations: row_deviations(&drawn.rows, &built.rows).into_iter().map(prefixed).collect(),
                world_from_base: (&built.world_from_base).into(),
            }
        });
        PairTruth {
            schema: "armcal.pair-truth/1".into(),
            config: config.clone(),
            arms,
            link_m: pair.link_m,
            recordings: Vec::new(),
        }
    }
}

impl PairRecordingTruth {
    pub(crate) fn of_motion(config: &PairConfig, motion: &Motion, recording: usize) -> PairRecordingTruth {
        let ns = |time_s: f64| config.start_ns(recording) + (time_s * 1e9) as i64;
        let dwells = motion.phases.iter().filter(|p| p.is_rest()).map(|p| PairDwellTruth {
            start_ns: ns(p.start_s),
            end_ns: ns(p.end_s),
            joined: p.is_joined_rest(),
            joint_rad: p.to_rad.clone(),
        });
        PairRecordingTruth {
            name: config.recordings[recording].clone(),
            duration_s: motion.duration_s(),
            dwells: dwells.collect(),
        }
    }
}
