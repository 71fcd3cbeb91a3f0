//! From dwells to observations: where each dwell was, and what it says about the tip.

use crate::RunError;
use crate::associated::{Asked, Associated};
use crate::seen::RecordingData;
use armcal_config::{BoardPose, Pipeline};
use armcal_core::{Dwell, DwellId, FeatureId, Observation, Reference, Rejection, TipMeasurement};
use armcal_dwell::TrackSample;
use armcal_model::Model;
use armcal_table::{Association, Board, BoardStart, DwellTip, Place};
use nalgebra::{Matrix3, Vector3};

/// Fewer dwells than parameters of a three-axis arm calibrate nothing.
const FEW: usize = 12;

/// The observations of all recordings, and the dwells that did not become one.
pub struct Observed {
    /// What the fit sees.
    pub observations: Vec<Observation>,
    /// Everything else, with the reason.
    pub rejections: Vec<Rejection>,
}

/// Associates the dwells of every recording to the board; `None` where there is no table.
///
/// `p` are the model's parameters that predict the tips; `boards_fitted` says whether they place the boards even where the
/// pipeline leaves that to be estimated. What is `known` is not made again.
pub fn associate_all(
    pipeline: &Pipeline,
    board: Option<&Board>,
    model: &Model,
    p: &[f64],
    boards_fitted: bool,
    (seen, known): (&[RecordingData], &Associated),
) -> Result<Vec<Option<Association>>, RunError> {
    let (Some(board), Some(table)) = (board, &pipeline.table) else {
        return Ok(seen.iter().map(|_| None).collect());
    };
    seen.iter()
        .enumerate()
        .map(|(recording, seen)| {
            let (alone, own) = model.in_recording(recording, p);
            let tips: Vec<DwellTip> = seen.dwells.iter().map(|d| dwell_tip(alone, &own, d)).collect();
            let placed = table.pose != BoardPose::Estimated || boards_fitted;
            let start = match model.board_in_world(p, recording) {
                Some(pose) if placed => BoardStart::Known(pose),
                _ => BoardStart::Unknown,
            };
            let in_recording = |source| RunError::Association { recording: seen.name.clone(), source };
            let asked = Asked { board: board.clone(), tips, start, config: table.association.clone() };
            known.of(recording, asked).map(Some).map_err(in_recording)
        })
        .collect()
}

/// Whether two rounds of association put every dwell in the same place.
pub fn same_places(a: &[Option<Association>], b: &[Option<Association>]) -> bool {
    let cavities = |all: &[Option<Association>]| -> Vec<(DwellId, Option<String>)> {
        let assignments = all.iter().flatten().flat_map(|a| &a.assignments);
        assignments.map(|a| (a.dwell, seated_in(&a.place).map(str::to_owned))).collect()
    };
    cavities(a) == cavities(b)
}

/// Turns every dwell into an observation or a rejection.
pub fn build_observations(
    pipeline: &Pipeline,
    board: Option<&Board>,
    seen: &[RecordingData],
    places: &[Option<Association>],
) -> Observed {
    let mut observed = Observed { observations: Vec::new(), rejections: Vec::new() };
    for (seen, association) in seen.iter().zip(places) {
        for (i, dwell) in seen.dwells.iter().enumerate() {
            let place = association.as_ref().and_then(|a| a.assignments.get(i)).map(|a| &a.place);
            let outcome = match (place.and_then(seated_in), board) {
                (Some(cavity), Some(board)) if pipeline.observations.seated => {
                    seated_reference(board, cavity)
                }
                (Some(_), _) => Err("seated dwells are switched off in [observations]".into()),
                (None, _) => tracked_reference(pipeline, dwell).map_err(|why| why_not(place, why)),
            };
            let markers = markers_of(pipeline, dwell);
            let seen_of_it = !markers.is_empty();
            match outcome {
                Ok(tip) => observed.observations.push(of_feature(seen, dwell, FeatureId::TIP, tip)),
                // Of a dwell without its tip, the markers are left.
                Err(_) if seen_of_it => {}
                Err(why) => observed.rejections.push(Rejection { dwell: dwell.id, why }),
            }
            observed.observations.extend(
                markers.into_iter().map(|(feature, marker)| of_feature(seen, dwell, feature, marker)),
            );
        }
    }
    observed
}

impl Observed {
    /// Refuses dwells of which none is an observation.
    ///
    /// # Errors
    /// Why the first is none.
    pub fn not_empty(self) -> Result<Observed, RunError> {
        if !self.observations.is_empty() {
            return Ok(self);
        }
        let hint = self.rejections.first().map_or(
            "no dwell was found: lower [dwell] thresholds or check the joints stream".to_owned(),
            |r| format!("the first was rejected because {}", r.why),
        );
        let dwells = self.rejections.len();
        let few = if (1..FEW).contains(&dwells) {
            "; so few dwells are too few for a calibration: were the recordings cut short?"
        } else {
            ""
        };
        Err(RunError::NoObservations { dwells, hint: hint + few })
    }
}

fn of_feature(
    seen: &RecordingData,
    dwell: &Dwell,
    feature: FeatureId,
    (reference, covariance_m2): Referenced,
) -> Observation {
    Observation { feature, ..dwell_observation(dwell, seen, reference, covariance_m2) }
}

/// What the sensor saw of the moving tip, as an observation; `index` numbers it within its recording.
pub fn moving_observation(
    pipeline: &Pipeline,
    recording: usize,
    index: usize,
    seen: &RecordingData,
    m: &TrackSample,
) -> Observation {
    let sigma_m = pipeline.observations.sensor_sigma_mm * 1e-3;
    Observation {
        dwell: DwellId { recording, dwell: index },
        feature: FeatureId::TIP,
        time_ns: m.time_ns,
        joint_rad: m.joint_rad.clone(),
        joint_sigma_rad: vec![0.0; m.joint_rad.len()],
        arrival: m.arrival.clone(),
        path_memory_rad: Some(m.path_memory_rad.clone()),
        pair_memory_rad: Some(m.pair_memory_rad.clone()),
        moved_rad: None,
        joint_velocity_radps: Some(m.joint_velocity_radps.clone()),
        effort_nm: m.effort_nm.clone(),
        temperature_c: m.temperature_c,
        load_kg: seen.load_kg,
        more_loads: seen.more_loads.clone(),
        reference: Reference::Tracked {
            position_m: m.position_m,
            orientation: None,
            orientation_sigma_rad: f64::INFINITY,
        },
        covariance_m2: Matrix3::from_diagonal(&Vector3::from_element(sigma_m * sigma_m)),
    }
}

fn dwell_tip(model: &Model, p: &[f64], dwell: &Dwell) -> DwellTip {
    let tip = model.base_in_world(p) * model.tip_in_base(p, &dwell.joint_rad);
    DwellTip {
        dwell: dwell.id,
        start_ns: dwell.start_ns,
        end_ns: dwell.end_ns,
        predicted_m: tip.translation.vector,
        measured_m: dwell.tip.as_ref().map(|t| t.position_m),
    }
}

fn seated_in(place: &Place) -> Option<&str> {
    match place {
        Place::Seated { cavity, .. } => Some(cavity),
        _ => None,
    }
}

type Referenced = (Reference, Matrix3<f64>);

/// The tip is where the cavity is, as well as cavity and seat are made.
fn seated_reference(board: &Board, cavity: &str) -> Result<Referenced, String> {
    let found = board.cavity(cavity).ok_or_else(|| format!("cavity `{cavity}` is not on the board"))?;
    let reference = Reference::Seated { cavity: cavity.to_owned(), in_board_m: found.in_board_m };
    Ok((reference, board.seat_covariance_m2()))
}

/// The tip is where the sensor saw it.
fn tracked_reference(pipeline: &Pipeline, dwell: &Dwell) -> Result<Referenced, String> {
    let Some(tip) = dwell.tip.as_ref() else {
        let what = if pipeline.markers.is_empty() { "the tip" } else { "the tip or a marker" };
        return Err(format!("the sensor did not see {what} during it"));
    };
    if !pipeline.observations.tracked {
        return Err("tracked dwells are switched off in [observations]".into());
    }
    Ok(where_seen(pipeline, tip))
}

/// The markers that the sensor saw during a dwell, in the order of the model's features.
fn markers_of(pipeline: &Pipeline, dwell: &Dwell) -> Vec<(FeatureId, Referenced)> {
    if !pipeline.observations.tracked {
        return Vec::new();
    }
    let features = pipeline.markers.keys().zip(FeatureId::TIP.0 + 1..);
    let seen = features.filter_map(|(name, id)| Some((FeatureId(id), dwell.markers.get(name)?)));
    seen.map(|(feature, marker)| (feature, where_seen(pipeline, marker))).collect()
}

/// What the sensor saw, as well as it sees.
fn where_seen(pipeline: &Pipeline, tip: &TipMeasurement) -> Referenced {
    let settings = &pipeline.observations;
    let floor_m2 = (settings.sensor_sigma_mm * 1e-3).powi(2);
    let covariance_m2 = tip.covariance_m2 + Matrix3::from_diagonal(&Vector3::from_element(floor_m2));
    let orientation_sigma_rad = tip.orientation_sigma_rad.hypot(settings.sensor_sigma_deg.to_radians());
    let reference = Reference::Tracked {
        position_m: tip.position_m,
        orientation: tip.orientation,
        orientation_sigma_rad,
    };
    (reference, covariance_m2)
}

/// Why a dwell is neither in a cavity nor usable as a tracked pose.
fn why_not(place: Option<&Place>, untracked: String) -> String {
    match place {
        Some(Place::Hovering { height_m, above }) => {
            format!("the tip hovers {:.1} mm above `{above}` and {untracked}", height_m * 1e3)
        }
        Some(Place::FreeSpace) => format!("the tip is away from the board and {untracked}"),
        Some(Place::Ambiguous { cavities }) => {
            format!("more than one cavity explains it: {}", cavities.join(", "))
        }
        Some(Place::Unassigned { why }) => why.clone(),
        Some(Place::Seated { .. }) | None => untracked,
    }
}

/// A dwell of a recording as an observation of this reference.
pub fn dwell_observation(
    dwell: &Dwell,
    seen: &RecordingData,
    reference: Reference,
    covariance_m2: Matrix3<f64>,
) -> Observation {
    Observation {
        dwell: dwell.id,
        feature: FeatureId::TIP,
        time_ns: dwell.mid_ns(),
        joint_rad: dwell.joint_rad.clone(),
        joint_sigma_rad: dwell.joint_sigma_rad.clone(),
        arrival: dwell.arrival.clone(),
        path_memory_rad: Some(dwell.path_memory_rad.clone()),
        pair_memory_rad: Some(dwell.pair_memory_rad.clone()),
        moved_rad: dwell.moved_rad.clone(),
        joint_velocity_radps: None,
        effort_nm: dwell.effort_nm.clone(),
        temperature_c: dwell.temperature_c,
        load_kg: seen.load_kg,
        more_loads: seen.more_loads.clone(),
        reference,
        covariance_m2,
    }
}
