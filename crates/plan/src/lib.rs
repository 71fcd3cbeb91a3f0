//! Which dwells to record next: what the rig could do, and the few of it that tell the explanations apart.
//!
//! `Known (model, fit, observations) + Rival explanations -> pool (pool, reach) -> greedy choice (choose, discrimination) -> Proposal`.

#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod advice;
mod choose;
mod discrimination;
mod pool;
mod reach;
mod rivals;

pub use choose::propose;
pub use pool::Place;
pub use rivals::{Standing, rivals_from_diagnosis, rivals_from_names};

use armcal_calibrate::FitConfig;
use armcal_core::{Arrival, Observation};
use armcal_model::{Model, Session};
use armcal_table::Board;
use nalgebra::Matrix3;
use serde::Serialize;

/// What is known before the next dwell.
#[derive(Debug, Clone)]
pub struct Known<'a> {
    /// The model that was calibrated.
    pub model: &'a Model,
    /// Its parameters as fitted.
    pub values: Vec<f64>,
    /// What the fit saw.
    pub observations: &'a [Observation],
    /// Their summary.
    pub session: &'a Session,
    /// Objective and loss.
    pub fit: &'a FitConfig,
    /// The calibration table, if there is one.
    pub board: Option<&'a Board>,
    /// How well a sensor sees the tip away from the board, if there is one.
    pub tracked: Option<Tracking>,
    /// Names of the recordings.
    pub recordings: Vec<String>,
}

/// How well a sensor sees the tip in a dwell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tracking {
    /// Covariance of the mean position [m^2].
    pub covariance_m2: Matrix3<f64>,
    /// Standard error of the orientation per axis [rad], where the stream has one.
    pub orientation_sigma_rad: Option<f64>,
}

/// What the user allows.
#[derive(Debug, Clone, PartialEq)]
pub struct Allowed {
    /// Most dwells to propose.
    pub dwells: usize,
    /// Loads at hand [kg], beside those recorded.
    pub loads_kg: Vec<f64>,
    /// How far free poses may go beyond the recorded range of a joint [deg].
    pub margin_deg: f64,
    /// Ranges of single joints (index from 0) instead of that [deg].
    pub ranges_deg: Vec<(usize, [f64; 2])>,
}

/// What to record next and what it will tell.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Proposal {
    /// The explanations to be told apart, and why these.
    pub explanations: Vec<String>,
    /// Why these.
    pub why: String,
    /// The dwells, the most telling first.
    pub dwells: Vec<Proposed>,
    /// How far each pair is apart.
    pub pairs: Vec<Pair>,
    /// What will be settled.
    pub sentence: String,
    /// What was taken for granted.
    pub assumptions: Vec<String>,
    /// Range of each joint within which poses were looked for [deg].
    pub range_deg: Vec<[f64; 2]>,
    /// Dwells that were weighed.
    pub pool: usize,
}

/// One dwell to record.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Proposed {
    /// Where.
    #[serde(flatten)]
    pub place: Place,
    /// Joint readings there [deg].
    pub joint_deg: Vec<f64>,
    /// From which side each joint is to arrive.
    pub arrival: Vec<Arrival>,
    /// Load at the tip [kg].
    pub load_kg: f64,
    /// Smallest Delta over all pairs that motion can tell apart, after this dwell.
    pub delta: f64,
}

/// A pair of explanations, before and after the proposed dwells.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Pair {
    /// The explanations.
    pub names: [String; 2],
    /// Delta of the data at hand: twice the log-likelihood ratio to expect for the true one.
    pub delta_before: f64,
    /// The same with the proposed dwells.
    pub delta_after: f64,
    /// What tells them apart where no motion does.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sensor: Option<String>,
}
