//! `observations.json`: what a fit saw, so that it can be seen again together with other recordings.
//!
//! [`observations_json`] of a run, [`StoredObservations::open`] from its results. Every number comes back as it was.

use crate::files::{ObservedFile, sha256};
use crate::run::{RecordingRun, Run, VERSION};
use crate::stored::stored_text;
use crate::{DwellMark, ResultError, StoredResultError};
use armcal_core::{Observation, Parameter, Pose, Role, Severity};
use armcal_model::Session;
use armcal_table::Board;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Format of the file.
const SCHEMA: &str = "armcal.observations/1";
/// Its name in the folder of results.
pub const OBSERVATIONS_FILE: &str = "observations.json";

/// What an earlier fit saw.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StoredObservations {
    schema: String,
    version: String,
    /// Name of the pipeline.
    pub pipeline: String,
    /// SHA-256 of the text of the nominal arm's file.
    pub model_sha256: String,
    /// The board, where there is one.
    pub board: Option<BoardFacts>,
    /// `[observations]` of the pipeline, as written.
    pub settings: toml::Table,
    /// What effects knew of all observations.
    pub session: Session,
    /// The recordings, in the order of the pipeline.
    pub recordings: Vec<ObservedRecording>,
}

/// So many losses of a recording are handed on in words.
const LOSSES: usize = 5;

/// One recording and its observations.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ObservedRecording {
    /// Its name in the pipeline.
    pub name: String,
    /// Its files.
    pub files: Vec<ObservedFile>,
    /// Dwells found.
    pub dwells: usize,
    /// Dwells that did not become an observation.
    pub rejected: usize,
    /// Where the base started: as measured, where it was.
    pub base: StartFrame,
    /// Where its board started: as measured, or found by the association, tilt included.
    pub board: Option<StartFrame>,
    /// What of its data was lost, in words; the first few.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lost: Vec<String>,
    /// What the fit saw, and what was held out of it.
    pub observations: Vec<Observation>,
}

/// A frame before the fit, and what was known about it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StartFrame {
    xyz_m: [f64; 3],
    quaternion_xyzw: [f64; 4],
    /// Whether nobody knew its pose.
    pub estimated: bool,
    /// Standard deviation of each coordinate before the fit [m]; `None` where it was taken as exact.
    pub sigma_m: Option<f64>,
    /// The same about each axis [rad].
    pub sigma_rad: Option<f64>,
}

/// What makes a board the same board.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BoardFacts {
    name: String,
    cavity_sigma_m: f64,
    seat_sigma_m: f64,
    cavities: Vec<CavityFacts>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct CavityFacts {
    name: String,
    in_board_m: [f64; 3],
}

/// The text of `observations.json` of a run.
///
/// # Errors
/// None but for numbers that JSON cannot hold.
pub fn observations_json(run: &Run) -> Result<String, ResultError> {
    let pipeline = run.pipeline_text.parse::<toml::Table>().unwrap_or_default();
    let settings = pipeline.get("observations").and_then(toml::Value::as_table).cloned().unwrap_or_default();
    let past = StoredObservations {
        schema: SCHEMA.into(),
        version: VERSION.into(),
        pipeline: run.pipeline_name.clone(),
        model_sha256: sha256(&run.model_texts.concat()),
        board: run.board.as_ref().map(BoardFacts::of),
        settings,
        session: run.session.clone(),
        recordings: run.recordings.iter().enumerate().map(|(i, r)| observed_recording(run, i, r)).collect(),
    };
    Ok(serde_json::to_string(&past).map_err(ResultError::Json)? + "\n")
}

impl StoredObservations {
    /// Reads the `observations.json` at `path`.
    ///
    /// # Errors
    /// A file that cannot be read, is of another format, or contradicts itself.
    pub fn open(path: &Path) -> Result<StoredObservations, StoredResultError> {
        let bad = |why: String| StoredResultError::BadObservations { path: path.to_owned(), why };
        let text = stored_text(path, bad)?;
        let past: StoredObservations = serde_json::from_str(&text).map_err(|e| bad(e.to_string()))?;
        if past.schema != SCHEMA {
            return Err(bad(format!("its schema is `{}`, not `{SCHEMA}`", past.schema)));
        }
        for (index, recording) in past.recordings.iter().enumerate() {
            for o in &recording.observations {
                check_observation(o, index)
                    .map_err(|why| bad(format!("{} of `{}`: {why}", o.dwell, recording.name)))?;
            }
        }
        Ok(past)
    }
}

impl ObservedRecording {
    /// What its observed dwells are recognised by.
    pub fn marks(&self) -> Vec<DwellMark> {
        self.observations.iter().map(|o| DwellMark::of(o.time_ns, &o.joint_rad)).collect()
    }
}

/// Lists of an observation that should have one entry a joint.
fn check_observation(o: &Observation, recording: usize) -> Result<(), String> {
    let joints = o.joint_rad.len();
    let counts = [
        ("joint_sigma_rad", Some(o.joint_sigma_rad.len()), joints),
        ("arrival", Some(o.arrival.len()), joints),
        ("path_memory_rad", o.path_memory_rad.as_ref().map(Vec::len), joints),
        ("pair_memory_rad", o.pair_memory_rad.as_ref().map(Vec::len), joints.saturating_sub(1)),
        ("moved_rad", o.moved_rad.as_ref().map(Vec::len), joints),
        ("joint_velocity_radps", o.joint_velocity_radps.as_ref().map(Vec::len), joints),
        ("effort_nm", o.effort_nm.as_ref().map(Vec::len), joints),
    ];
    if let Some((what, Some(n), of)) = counts.into_iter().find(|(_, n, of)| n.is_some_and(|n| n != *of)) {
        return Err(format!("{what} has {n} entries instead of {of}"));
    }
    if o.dwell.recording != recording {
        return Err(format!("it stands under recording {recording}"));
    }
    Ok(())
}

fn observed_recording(run: &Run, index: usize, recording: &RecordingRun) -> ObservedRecording {
    let start = run.model.nominal();
    // What the recording has for itself is its base.
    let (model, start) = run.model.in_recording(index, &start);
    let board = model.board_in_world(&start, index);
    let of_frame = |name: String, pose: &Pose| StartFrame::of(model.parameters(), &name, pose);
    let lost = recording.all_warnings().into_iter().filter(|w| w.severity == Severity::DataLost);
    ObservedRecording {
        lost: lost.take(LOSSES).map(|w| w.message.clone()).collect(),
        name: recording.name.clone(),
        files: recording.files(),
        dwells: recording.found(),
        rejected: recording.rejected(),
        base: of_frame("base".into(), &model.base_in_world(&start)),
        board: board.map(|pose| of_frame(format!("board.{}", recording.name), &pose)),
        observations: run.observations.iter().filter(|o| o.dwell.recording == index).cloned().collect(),
    }
}

impl StartFrame {
    fn of(parameters: &[Parameter], name: &str, pose: &Pose) -> StartFrame {
        let find = |quantity: &str| {
            let wanted = format!("{name}.{quantity}");
            parameters.iter().find(|p| p.name == wanted && p.free)
        };
        let q = pose.rotation.coords;
        StartFrame {
            xyz_m: pose.translation.vector.into(),
            quaternion_xyzw: [q.x, q.y, q.z, q.w],
            estimated: find("x").is_some_and(|p| p.role == Role::EstimatedFrame),
            sigma_m: find("x").and_then(|p| p.prior_sigma),
            sigma_rad: find("rx").and_then(|p| p.prior_sigma),
        }
    }

    /// Where it started, in the world.
    pub fn pose(&self) -> Pose {
        let [x, y, z, w] = self.quaternion_xyzw;
        // As it was written: normalising again would change its last digit.
        let rotation = UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z));
        Pose::from_parts(Vector3::from(self.xyz_m).into(), rotation)
    }
}

impl BoardFacts {
    /// Of a board.
    pub fn of(board: &Board) -> BoardFacts {
        let cavity =
            |c: &armcal_table::Cavity| CavityFacts { name: c.name.clone(), in_board_m: c.in_board_m.into() };
        BoardFacts {
            name: board.name.clone(),
            cavity_sigma_m: board.cavity_sigma_m,
            seat_sigma_m: board.seat_sigma_m,
            cavities: board.cavities.iter().map(cavity).collect(),
        }
    }

    /// The first way in which another board differs, in words; `None` for the same board.
    pub fn difference(&self, other: &BoardFacts) -> Option<String> {
        let mm = |m: f64| m * 1e3;
        if self.name != other.name {
            return Some(format!("board `{}` instead of `{}`", self.name, other.name));
        }
        for (what, a, b) in [
            ("cavity_sigma_mm", self.cavity_sigma_m, other.cavity_sigma_m),
            ("seat_sigma_mm", self.seat_sigma_m, other.seat_sigma_m),
        ] {
            if a != b {
                return Some(format!("{what} = {} instead of {}", mm(a), mm(b)));
            }
        }
        if self.cavities.len() != other.cavities.len() {
            return Some(format!("{} cavities instead of {}", self.cavities.len(), other.cavities.len()));
        }
        let (a, b) = self.cavities.iter().zip(&other.cavities).find(|(a, b)| a != b)?;
        Some(format!(
            "cavity `{}` at {:?} mm instead of `{}` at {:?} mm",
            a.name,
            a.in_board_m.map(mm),
            b.name,
            b.in_board_m.map(mm)
        ))
    }
}
