//! The quick path: the same plan, the same motion history and mechanisms, but one reading a dwell and no streams.
//!
//! What comes out is what the pipeline makes of a recording of the same session: observations, and the frames
//! and the nominal arm a model starts from. Movements are followed at a few positions each, so hysteresis is in
//! the state it would be in; noise is that of the mean over a dwell.

mod motion_history;
mod nominal;
mod reading;

pub use nominal::{Nominal, NominalBoard};
pub(crate) use reading::mean_encoder_readings;

use crate::config::LabConfig;
use crate::engine::Pace;
use crate::mechanism::Body;
use crate::random::{Purpose, Stream};
use crate::rig::Rig;
use crate::sensors::SensorClock;
use crate::session::Session;
use crate::trace::{Rest, RestKind};
use crate::{LabError, RecordingTruth, Truth, hidden_in};
use armcal_core::{DwellId, FeatureId, Observation, Reference};
use nalgebra::Matrix3;
use reading::{Camera, MOST_READINGS};
use std::path::Path;

/// Shortest pause that is taken for a dwell [s].
const SHORTEST_S: f64 = 0.4;

/// What the pipeline would have made of a session, and what was true.
#[derive(Debug, Clone, PartialEq)]
pub struct Observed {
    /// Every dwell, in order of time.
    pub observations: Vec<Observation>,
    /// The model before calibration.
    pub nominal: Nominal,
    /// What was true.
    pub truth: Truth,
}

impl Observed {
    /// The same readings, with the noise of sensor, seats and encoders declared so many times as large.
    pub fn declaring(mut self, times: f64) -> Observed {
        for o in &mut self.observations {
            o.covariance_m2 *= times * times;
            o.joint_sigma_rad.iter_mut().for_each(|sigma| *sigma *= times);
            if let Reference::Tracked { orientation_sigma_rad, .. } = &mut o.reference {
                *orientation_sigma_rad *= times;
            }
        }
        self
    }
}

/// Observes a session without recording it. A board file is looked for where the program runs.
pub fn observe(config: &LabConfig) -> Result<Observed, LabError> {
    observe_from(config, Path::new(""))
}

/// The same with relative paths of the configuration starting at `base_dir`.
pub fn observe_from(config: &LabConfig, base_dir: &Path) -> Result<Observed, LabError> {
    config.check()?;
    let rig = Rig::build(config, base_dir)?;
    let (mut truth, mut observations, mut frames) = (Truth::of_rig(config, &rig), Vec::new(), Vec::new());
    for recording in 0..config.recordings.len() {
        let mechanisms = hidden_in(config).collect();
        let session = Session::perform(config, &rig, recording, mechanisms, Pace::Quick)?;
        observations.extend(observe_dwells(config, &rig, recording, &session));
        frames.push([Body::Base, Body::Table].map(|body| nominal::mean_pose(&session.trace, body)));
        let clock = SensorClock::draw(config, recording);
        truth.recordings.push(RecordingTruth::of_session(
            config,
            &rig,
            recording,
            &session,
            clock,
            Vec::new(),
        ));
    }
    Ok(Observed { observations, nominal: Nominal::new(config, &frames), truth })
}

/// The part of a rest that is taken for the dwell [s].
fn dwell_s(session: &Session, rest: &Rest) -> [f64; 2] {
    let began_s = session.trace.time_s[rest.first.saturating_sub(1)];
    [began_s + 0.05, session.trace.time_s[rest.last]]
}

fn observe_dwells(config: &LabConfig, rig: &Rig, recording: usize, session: &Session) -> Vec<Observation> {
    let mut draw = Stream::new(config.seed, Purpose::Quick, 2 * recording);
    let duration_s = session.trace.duration_s();
    let mut camera = Camera::new(config, recording, duration_s);
    let markers = 0..config.vicon.markers.len();
    let mut on_links: Vec<Camera<'_>> =
        markers.map(|marker| Camera::of_marker(config, recording, marker)).collect();
    let (mut observations, mut dwell): (Vec<Observation>, usize) = (Vec::new(), 0);
    for rest in &session.rests {
        let span_s = dwell_s(session, rest);
        if span_s[1] - span_s[0] < SHORTEST_S {
            continue;
        }
        let readings = ((span_s[1] - span_s[0]) * config.joints.rate_hz).min(MOST_READINGS);
        let read_rad = &session.trace.reading_rad[rest.last];
        let [joint_rad, joint_sigma_rad] =
            mean_encoder_readings(&config.joints, read_rad, readings, &mut draw);
        let seen = camera.tip(&session.trace.seen_tip[rest.last], span_s);
        let (reference, covariance_m2) = match (rest.kind, rest.cavity) {
            (RestKind::Seated, Some(cavity)) => {
                let cavity = &rig.board.cavities[cavity];
                let seated = Reference::Seated { cavity: cavity.name.clone(), in_board_m: cavity.drawn_m };
                let variance = rig.board.declared_sigma_m.powi(2) + rig.board.seat_sigma_m.powi(2);
                (seated, Matrix3::identity() * variance)
            }
            _ => seen,
        };
        let since = &session.trace.reading_rad[..rest.first];
        let mid_s = (span_s[0] + span_s[1]) / 2.0;
        let temperature = session.trace.temperature_c[rest.last];
        let first = observations.len();
        observations.push(Observation {
            feature: FeatureId::TIP,
            dwell: DwellId { recording, dwell },
            time_ns: config.start_ns(recording) + (mid_s * 1e9).round() as i64,
            arrival: motion_history::arrival_directions(since, &joint_rad, config.joints.count_rad()),
            path_memory_rad: Some(motion_history::path_memories(
                since,
                &joint_rad,
                config.joints.count_rad(),
            )),
            pair_memory_rad: Some(motion_history::pair_memories(
                since,
                &joint_rad,
                config.joints.count_rad(),
            )),
            moved_rad: observations
                .last()
                .map(|before| motion_history::joint_moves_rad(&before.joint_rad, &joint_rad)),
            joint_velocity_radps: None,
            joint_rad,
            joint_sigma_rad,
            effort_nm: None,
            temperature_c: config.temperature.published.then(|| camera.thermometer(temperature)),
            load_kg: config.recordings[recording].load_kg,
            more_loads: Vec::new(),
            reference,
            covariance_m2,
        });
        dwell += 1;
        for (marker, camera) in on_links.iter_mut().enumerate() {
            let (reference, covariance_m2) =
                camera.tip(&session.trace.seen(Body::Marker(marker))[rest.last], span_s);
            let feature = FeatureId(marker + 1);
            observations.push(Observation {
                feature,
                reference,
                covariance_m2,
                ..observations[first].clone()
            });
        }
    }
    observations
}

#[cfg(test)]
mod tests;
