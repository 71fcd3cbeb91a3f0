//! What effects need to know about the whole set of observations.

use armcal_core::{Observation, gaps};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Standard gravity [m/s^2].
pub(crate) const STANDARD_GRAVITY_MPS2: f64 = 9.80665;

/// Summary of a set of observations, built once from them and then adjusted where more is known.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Session {
    /// Earliest observation [ns].
    pub start_ns: i64,
    /// Latest observation [ns].
    pub end_ns: i64,
    /// Number of recordings: one more than the largest index.
    pub recordings: usize,
    /// Mean temperature [degC], where any observation has one. Lengths are nominal at this temperature.
    pub reference_temperature_c: Option<f64>,
    /// Gravity in the world [m/s^2]. Standard gravity along -z unless something else is known.
    pub gravity_in_world_mps2: Vector3<f64>,
    /// Gravity in the robot's base [m/s^2], for a world whose vertical is not known; goes before the world's.
    pub gravity_in_base_mps2: Option<Vector3<f64>>,
    /// Mean of the tracked points in the world [m], where there are any.
    pub volume_centre_m: Option<Vector3<f64>>,
    /// Largest distance of a tracked point from their mean [m]; 0.3 without any.
    pub volume_half_extent_m: f64,
    /// Mean seated point of each recording that has any, in its board's frame [m].
    pub board_centres_m: BTreeMap<usize, Vector3<f64>>,
    /// Largest absolute effort of each joint [N m]; NaN, in JSON `null`, unless every observation has one.
    #[serde(default, deserialize_with = "gaps::deserialize")]
    pub largest_effort_nm: Option<Vec<f64>>,
    /// Whether any observation has a temperature.
    pub temperature: bool,
    /// Whether the load differs from zero anywhere.
    pub load: bool,
    /// Whether any observation was taken in motion.
    pub moving: bool,
    /// Whether it is known of any observation where the joints rested before.
    #[serde(default)]
    pub moved: bool,
    /// Names of the cavities the tip was seated in, sorted.
    pub cavities: Vec<String>,
}

impl Session {
    /// Whether the tip was held by a cavity in some dwells and by the arm alone in others.
    pub(crate) fn seated_and_tracked(&self) -> bool {
        !self.cavities.is_empty() && self.volume_centre_m.is_some()
    }

    /// Summarises observations; the order does not matter.
    pub fn of(observations: &[Observation]) -> Session {
        let times = || observations.iter().map(|o| o.time_ns);
        let tracked: Vec<Vector3<f64>> = observations.iter().filter_map(|o| o.seen_m().copied()).collect();
        let centre_m = mean(&tracked);
        let extent_m = centre_m.map_or(0.0, |c| tracked.iter().map(|p| (p - c).norm()).fold(0.0, f64::max));
        let temperatures: Vec<f64> = observations.iter().filter_map(|o| o.temperature_c).collect();
        let mut cavities: Vec<String> =
            observations.iter().filter_map(|o| o.cavity()).map(str::to_owned).collect();
        cavities.sort();
        cavities.dedup();
        Session {
            start_ns: times().min().unwrap_or(0),
            end_ns: times().max().unwrap_or(0),
            recordings: observations.iter().map(|o| o.dwell.recording + 1).max().unwrap_or(0),
            reference_temperature_c: (!temperatures.is_empty())
                .then(|| temperatures.iter().sum::<f64>() / temperatures.len() as f64),
            gravity_in_world_mps2: Vector3::new(0.0, 0.0, -STANDARD_GRAVITY_MPS2),
            gravity_in_base_mps2: None,
            volume_centre_m: centre_m,
            volume_half_extent_m: if extent_m > 0.0 { extent_m } else { 0.3 },
            board_centres_m: board_centres(observations),
            largest_effort_nm: largest_effort(observations),
            temperature: !temperatures.is_empty(),
            load: observations.iter().flat_map(|o| o.loads()).any(|load| load.kg != 0.0),
            moving: observations.iter().any(|o| o.joint_velocity_radps.is_some()),
            moved: observations.iter().any(|o| o.moved_rad.is_some()),
            cavities,
        }
    }

    /// Time from the first to the last observation [s].
    pub fn duration_s(&self) -> f64 {
        (self.end_ns - self.start_ns) as f64 * 1e-9
    }
}

fn mean(points: &[Vector3<f64>]) -> Option<Vector3<f64>> {
    (!points.is_empty()).then(|| points.iter().sum::<Vector3<f64>>() / points.len() as f64)
}

fn board_centres(observations: &[Observation]) -> BTreeMap<usize, Vector3<f64>> {
    let mut points: BTreeMap<usize, Vec<Vector3<f64>>> = BTreeMap::new();
    for o in observations {
        if let Some(in_board_m) = o.in_board_m() {
            points.entry(o.dwell.recording).or_default().push(*in_board_m);
        }
    }
    points.into_iter().filter_map(|(recording, points)| Some((recording, mean(&points)?))).collect()
}

fn largest_effort(observations: &[Observation]) -> Option<Vec<f64>> {
    let largest = |joint| {
        let mut sizes = observations.iter().map(|o| Some(o.effort_of(joint)?.abs()));
        sizes.try_fold(0.0, |largest: f64, size| Some(largest.max(size?))).unwrap_or(f64::NAN)
    };
    gaps::if_any_known((0..observations.first()?.joint_rad.len()).map(largest).collect())
}
