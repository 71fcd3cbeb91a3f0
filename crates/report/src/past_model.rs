//! `model.json`: the calibrated model with all it needs to predict again, without the recordings it came from.
//!
//! [`PastModel::of`] a run, [`PastModel::open`] from its results, [`PastModel::arms`] to compute with. The nominal arm
//! is kept as the text of its file, frames and effects as what was built on it, what drives the effects as the facts
//! of the session; so the model is made again by the code that made it first.

use crate::run::{RecordingRun, Run, VERSION};
use crate::{DwellMark, PastRunError, ReportError};
use armcal_calibrate::{Calibration, Estimate};
use armcal_core::{FeatureId, Observation, Pose, Unit, Visited};
use armcal_model::{Chain, EffectSpec, EffectTable, Frame, Frames, Marker, Model, ModelError, Session};
use armcal_recording::{Recording, RecordingError, input};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Format of the file.
const SCHEMA: &str = "armcal.model/1";
/// Its name in the folder of results, and behind `armcal/` in `run.mcap`.
pub(crate) const FILE: &str = "model.json";
/// Postures that are kept at most; a longer session is thinned out evenly.
const MOST_POSTURES: usize = 400;

/// A calibrated model of an earlier run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PastModel {
    schema: String,
    version: String,
    /// Name of the pipeline.
    pub pipeline: String,
    chain: ChainText,
    base: FrameFacts,
    tip: FrameFacts,
    /// Absent in a model without markers, and in one written before there were any.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    markers: Vec<MarkerFacts>,
    boards: Vec<FrameFacts>,
    effects: Vec<EffectTable>,
    session: Session,
    /// Every parameter, in the order of the model.
    pub parameters: Vec<Value>,
    /// The recordings, in the order of the pipeline.
    pub recordings: Vec<RecordingFacts>,
    /// Readings at rest, for a posture to start from [rad] (sliding: [m]).
    pub postures_rad: Vec<Vec<f64>>,
    /// Smallest and largest reading of each joint [rad] (sliding: [m]).
    pub range_rad: Vec<[f64; 2]>,
    /// What each joint visited between them; empty in a model written before this was kept.
    #[serde(default)]
    pub visited: Vec<Visited>,
    /// Mean error on points the fit did not see, else on those it saw [m]; `None` where it is not a number.
    pub mean_error_m: Option<f64>,
    /// What the diagnosis would add to the model, as `armcal add` takes it.
    pub missing: Vec<String>,
}

/// One parameter, SI.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Value {
    /// Its name.
    pub name: String,
    /// With nominal robot parameters, estimated frames fitted.
    pub nominal: f64,
    /// As calibrated.
    pub calibrated: f64,
    /// Posterior standard deviation; 0 where it was fixed.
    pub sigma: f64,
}

/// One recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecordingFacts {
    /// Its name.
    pub name: String,
    /// Hashes of its files.
    pub sha256: Vec<String>,
    /// Its observed dwells, by which a copy of it is recognised; absent in a model written before this was kept.
    #[serde(default)]
    pub dwells: Option<Vec<DwellMark>>,
    /// Its last observed dwell.
    pub last_dwell: usize,
    /// When that was [ns], robot clock.
    pub last_ns: i64,
    /// Load at the tip [kg].
    pub load_kg: f64,
    /// Mean temperature [degC].
    pub temperature_c: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "form", rename_all = "lowercase")]
pub(crate) enum ChainText {
    Dh { text: String },
    Urdf { text: String, base_link: String, tip_link: String },
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct FrameFacts {
    name: String,
    xyz_m: [f64; 3],
    quaternion_xyzw: [f64; 4],
    free_rotation: bool,
}

/// A marker and the link that it is on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct MarkerFacts {
    link: String,
    #[serde(flatten)]
    frame: FrameFacts,
}

/// What a model is written from.
pub(crate) struct Calibrated<'a> {
    pub pipeline: &'a str,
    pub chain: ChainText,
    pub model: &'a Model,
    /// Where the base starts (world_from_base).
    pub base: Pose,
    /// One for each parameter of the model.
    pub estimates: &'a [Estimate],
    pub calibration: &'a Calibration,
    /// Name and hashes of the files of every recording.
    pub recordings: Vec<(&'a str, Vec<String>)>,
    pub observations: &'a [Observation],
    pub session: &'a Session,
    pub missing: &'a [EffectSpec],
}

/// The model without effects and with them, and their parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct PastArms {
    /// The nominal arm in its frames: no effects.
    pub geometry: Model,
    /// Its parameters: robot nominal, estimated frames fitted.
    pub nominal_values: Vec<f64>,
    /// The model with its effects.
    pub model: Model,
    /// Its parameters as calibrated.
    pub values: Vec<f64>,
}

impl PastModel {
    /// What a run leaves for later.
    pub(crate) fn of(run: &Run) -> Result<PastModel, ReportError> {
        let missing = match &run.diagnosis {
            Some(diagnosis) => diagnosis.suggested(run.model.chain().joint_names())?,
            None => Vec::new(),
        };
        Ok(PastModel::of_calibrated(&Calibrated {
            pipeline: &run.pipeline_name,
            chain: chain_text(&run.model, &run.model_text, &run.pipeline_text),
            model: &run.model,
            base: run.model.base_in_world(&run.model.nominal()),
            estimates: &run.calibration.fit.estimates,
            calibration: &run.calibration,
            recordings: run.recordings.iter().map(|r| (r.name.as_str(), hashes(r))).collect(),
            observations: &run.observations,
            session: &run.session,
            missing: &missing,
        }))
    }

    /// What any calibration leaves for later.
    pub(crate) fn of_calibrated(of: &Calibrated<'_>) -> PastModel {
        let model = of.model;
        let start = model.nominal();
        let calibration = of.calibration;
        let values = of.estimates.iter().zip(&calibration.nominal_values);
        let value = |(e, nominal): (&Estimate, &f64)| Value {
            name: e.parameter.name.clone(),
            nominal: *nominal,
            calibrated: e.value,
            sigma: e.sigma,
        };
        let facts = |name: &str, pose: &Pose| FrameFacts::of(model, name, pose);
        let boards = of.recordings.iter().enumerate().filter_map(|(index, (name, _))| {
            let pose = model.board_in_world(&start, index)?;
            Some(facts(&format!("board.{name}"), &pose))
        });
        let marker = |(feature, name, link): (FeatureId, &str, &str)| MarkerFacts {
            link: link.to_owned(),
            frame: facts(name, &model.feature_in_link(&start, feature)),
        };
        let recordings = of.recordings.iter().enumerate();
        let judged = calibration.judged();
        PastModel {
            schema: SCHEMA.into(),
            version: VERSION.into(),
            pipeline: of.pipeline.to_owned(),
            chain: of.chain.clone(),
            base: facts("base", &of.base),
            tip: facts("tip", &model.tip_in_last_link(&start)),
            markers: model.markers().map(marker).collect(),
            boards: boards.collect(),
            effects: model.effects().iter().map(|effect| EffectTable::from(&effect.spec)).collect(),
            session: of.session.clone(),
            parameters: values.map(value).collect(),
            recordings: recordings.map(|(i, (name, sha256))| recording(name, sha256, i, of)).collect(),
            postures_rad: thinned(of.observations),
            range_rad: (0..model.joint_count()).map(|j| range(of.observations, j)).collect(),
            visited: visited(model, of.observations),
            mean_error_m: Some(judged.fitted.mean_m).filter(|mean| mean.is_finite()),
            missing: of.missing.iter().map(EffectSpec::to_string).collect(),
        }
    }

    /// Its JSON.
    pub(crate) fn json(&self) -> Result<String, ReportError> {
        serde_json::to_string_pretty(self).map(|text| text + "\n").map_err(ReportError::Page)
    }

    /// Reads the model of a run: its folder, its `run.mcap`, or the `model.json` itself.
    ///
    /// # Errors
    /// A file that cannot be read, or holds no model in this format.
    pub fn open(path: &Path) -> Result<PastModel, PastRunError> {
        let path = if path.is_dir() { path.join(FILE) } else { path.to_owned() };
        let text =
            if path.extension().is_some_and(|e| e == "mcap") { attached(&path)? } else { file(&path)? };
        let bad = |why: String| PastRunError::BadModel { path: path.clone(), why };
        let model: PastModel = serde_json::from_str(&text).map_err(|e| bad(e.to_string()))?;
        if model.schema != SCHEMA {
            return Err(bad(format!("its schema is `{}`, not `{SCHEMA}`", model.schema)));
        }
        Ok(model)
    }

    /// What the effects refer to.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// The models, made again.
    ///
    /// # Errors
    /// Contents that contradict each other, as only a file changed by hand has them.
    pub fn arms(&self) -> Result<PastArms, ModelError> {
        let path = Path::new(FILE);
        let chain = match &self.chain {
            ChainText::Dh { text } => Chain::from_dh_toml(text, path)?,
            ChainText::Urdf { text, base_link, tip_link } => {
                Chain::from_urdf(text, base_link, tip_link, path)?
            }
        };
        let frames = Frames {
            base: self.base.frame(),
            tip: self.tip.frame(),
            markers: self.markers.iter().map(MarkerFacts::marker).collect(),
            boards: self.boards.iter().map(FrameFacts::frame).collect(),
        };
        let geometry = Model::new(chain, frames)?;
        let joints = geometry.chain().joint_names();
        let specs = self.effects.iter().map(|e| e.spec(joints)).collect::<Result<Vec<_>, _>>()?;
        let model = geometry.with_effects(&specs, &self.session)?;
        let expected: Vec<&str> = model.parameters().iter().map(|p| p.name.as_str()).collect();
        let wrong = (0..expected.len().max(self.parameters.len()))
            .find(|i| self.parameters.get(*i).map(|v| v.name.as_str()) != expected.get(*i).copied());
        if let Some(index) = wrong {
            return Err(ModelError::UnknownParameter {
                name: self.parameters.get(index).map_or("(missing)".to_owned(), |v| v.name.clone()),
                nearest: expected.get(index).map(|name| (*name).to_owned()),
            });
        }
        let nominal = self.parameters.iter().take(geometry.parameters().len()).map(|v| v.nominal);
        Ok(PastArms {
            nominal_values: nominal.collect(),
            geometry,
            values: self.parameters.iter().map(|v| v.calibrated).collect(),
            model,
        })
    }
}

fn file(path: &Path) -> Result<String, PastRunError> {
    input::read_to_string(path)
        .map_err(|e| PastRunError::NoModel { path: path.to_owned(), why: e.to_string() })
}

fn attached(path: &Path) -> Result<String, PastRunError> {
    let at = |source: RecordingError| PastRunError::Open { path: path.to_owned(), source: Box::new(source) };
    let recording = Recording::open(&[PathBuf::from(path)]).map_err(at)?;
    let name = format!("armcal/{FILE}");
    let mut found = None;
    recording
        .for_each_attachment(&mut |a| {
            if a.name == name && found.is_none() {
                found = Some(String::from_utf8_lossy(a.data).into_owned());
            }
            Ok(())
        })
        .map_err(at)?;
    let missing =
        || PastRunError::NoModel { path: path.to_owned(), why: format!("it has no attachment {name}") };
    found.ok_or_else(missing)
}

/// The nominal arm's file; the ends of a URDF chain are what the pipeline says.
pub(crate) fn chain_text(model: &Model, model_text: &str, pipeline_text: &str) -> ChainText {
    let text = model_text.to_owned();
    if !model.chain().is_urdf() {
        return ChainText::Dh { text };
    }
    let pipeline = pipeline_text.parse::<toml::Table>().unwrap_or_default();
    let link = |key| {
        let found = pipeline.get("model").and_then(|model| model.get(key)).and_then(toml::Value::as_str);
        found.unwrap_or_default().to_owned()
    };
    ChainText::Urdf { text, base_link: link("base_link"), tip_link: link("tip_link") }
}

fn hashes(recording: &RecordingRun) -> Vec<String> {
    recording.report.files.iter().map(|f| f.identity()).collect()
}

fn recording(name: &str, sha256: &[String], index: usize, of: &Calibrated<'_>) -> RecordingFacts {
    let own: Vec<&Observation> = of.observations.iter().filter(|o| o.dwell.recording == index).collect();
    let temperatures: Vec<f64> = own.iter().filter_map(|o| o.temperature_c).collect();
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    RecordingFacts {
        name: name.to_owned(),
        sha256: sha256.to_vec(),
        dwells: Some(own.iter().map(|o| DwellMark::of(o.time_ns, &o.joint_rad)).collect()),
        last_dwell: own.iter().map(|o| o.dwell.dwell).max().unwrap_or(0),
        last_ns: own.iter().map(|o| o.time_ns).max().unwrap_or(of.session.end_ns),
        load_kg: own.last().map_or(0.0, |o| o.load_kg),
        temperature_c: (!temperatures.is_empty()).then(|| mean(&temperatures)),
    }
}

fn thinned(observations: &[Observation]) -> Vec<Vec<f64>> {
    let stride = observations.len().div_ceil(MOST_POSTURES).max(1);
    observations.iter().step_by(stride).map(|o| o.joint_rad.clone()).collect()
}

/// What each joint of the model visited in these observations.
pub(crate) fn visited(model: &Model, observations: &[Observation]) -> Vec<Visited> {
    let of_joint = |joint: usize| {
        let readings = observations.iter().filter_map(|o| o.joint_rad.get(joint).copied());
        Visited::of(readings, model.chain().joint_unit(joint) == Unit::Metre)
    };
    (0..model.joint_count()).map(of_joint).collect()
}

fn range(observations: &[Observation], joint: usize) -> [f64; 2] {
    let readings = observations.iter().filter_map(|o| o.joint_rad.get(joint).copied());
    let start = [f64::INFINITY, f64::NEG_INFINITY];
    readings.fold(start, |[low, high], q| [q.min(low), q.max(high)])
}

impl MarkerFacts {
    fn marker(&self) -> Marker {
        Marker { link: self.link.clone(), frame: self.frame.frame() }
    }
}

impl FrameFacts {
    fn of(model: &Model, name: &str, pose: &Pose) -> FrameFacts {
        let q = pose.rotation.coords;
        FrameFacts {
            name: name.to_owned(),
            xyz_m: pose.translation.vector.into(),
            quaternion_xyzw: [q.x, q.y, q.z, q.w],
            free_rotation: model.index(&format!("{name}.rx")).is_some(),
        }
    }

    fn frame(&self) -> Frame {
        let [x, y, z, w] = self.quaternion_xyzw;
        let rotation = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
        let pose = Pose::from_parts(Vector3::from(self.xyz_m).into(), rotation);
        Frame { free_rotation: self.free_rotation, ..Frame::given(self.name.clone(), pose) }
    }
}
