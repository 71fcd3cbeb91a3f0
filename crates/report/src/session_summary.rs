//! The session in `summary.json`: what the fitted effects refer to, so that they mean the same on other recordings.

use armcal_model::Session;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A [`Session`] as plain numbers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SessionSummary {
    start_ns: i64,
    end_ns: i64,
    recordings: usize,
    reference_temperature_c: Option<f64>,
    gravity_in_world_mps2: [f64; 3],
    gravity_in_base_mps2: Option<[f64; 3]>,
    volume_centre_m: Option<[f64; 3]>,
    volume_half_extent_m: f64,
    board_centres_m: BTreeMap<usize, [f64; 3]>,
    largest_effort_nm: Option<Vec<f64>>,
    temperature: bool,
    load: bool,
    moving: bool,
    cavities: Vec<String>,
}

impl From<&Session> for SessionSummary {
    fn from(s: &Session) -> SessionSummary {
        let plain = |v: Vector3<f64>| [v.x, v.y, v.z];
        SessionSummary {
            start_ns: s.start_ns,
            end_ns: s.end_ns,
            recordings: s.recordings,
            reference_temperature_c: s.reference_temperature_c,
            gravity_in_world_mps2: plain(s.gravity_in_world_mps2),
            gravity_in_base_mps2: s.gravity_in_base_mps2.map(plain),
            volume_centre_m: s.volume_centre_m.map(plain),
            volume_half_extent_m: s.volume_half_extent_m,
            board_centres_m: s.board_centres_m.iter().map(|(r, v)| (*r, plain(*v))).collect(),
            largest_effort_nm: s.largest_effort_nm.clone(),
            temperature: s.temperature,
            load: s.load,
            moving: s.moving,
            cavities: s.cavities.clone(),
        }
    }
}

impl From<SessionSummary> for Session {
    fn from(s: SessionSummary) -> Session {
        Session {
            start_ns: s.start_ns,
            end_ns: s.end_ns,
            recordings: s.recordings,
            reference_temperature_c: s.reference_temperature_c,
            gravity_in_world_mps2: s.gravity_in_world_mps2.into(),
            gravity_in_base_mps2: s.gravity_in_base_mps2.map(Vector3::from),
            volume_centre_m: s.volume_centre_m.map(Vector3::from),
            volume_half_extent_m: s.volume_half_extent_m,
            board_centres_m: s.board_centres_m.into_iter().map(|(r, v)| (r, v.into())).collect(),
            largest_effort_nm: s.largest_effort_nm,
            temperature: s.temperature,
            load: s.load,
            moving: s.moving,
            cavities: s.cavities,
        }
    }
}
