//! `model.json`: the calibrated model with all it needs to predict again, without the recordings it came from.
//!
//! [`PastModel::of`] a run, [`PastModel::open`] from its results, [`PastModel::arms`] to compute with. The nominal arm
//! is kept as the text of its file, frames and effects as what was built on it, what drives the effects as the facts
//! of the session; so the model is made again by the code that made it first.

use crate::run::{RecordingRun, Run, VERSION};
use crate::{DwellMark, PastRunError, ReportError};
use armcal_core::{FeatureId, Load, Observation, Pose, Unit, Visited};
use armcal_model::{
    ArmFrames, Chain, EffectSpec, EffectTable, FixedPlace, Frame, Frames, Knowledge, Length, Marker, Masses,
    Model, ModelError, Session,
};
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
    /// Of several arms, base and tip of each behind the first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    more_arms: Vec<[FrameFacts; 2]>,
    /// Points and planes that stand in the world and were measured against.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    places: Vec<PlaceFacts>,
    /// Lengths that distances count from, a rigid link between two tips among them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    lengths: Vec<LengthFacts>,
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
    /// What identifies its files ([`armcal_recording::FileReport::identity`]); in results of earlier versions their SHA-256.
    #[serde(alias = "sha256")]
    pub identity: Vec<String>,
    /// Its observed dwells, by which a copy of it is recognised; absent in a model written before this was kept.
    #[serde(default)]
    pub dwells: Option<Vec<DwellMark>>,
    /// Its last observed dwell.
    pub last_dwell: usize,
    /// When that was [ns], robot clock.
    pub last_ns: i64,
    /// Load at the tip [kg].
    pub load_kg: f64,
    /// Loads at other points of the arm.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub more_loads: Vec<Load>,
    /// Mean temperature [degC].
    pub temperature_c: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "form", rename_all = "lowercase")]
enum ChainText {
    Dh {
        text: String,
    },
    Urdf {
        text: String,
        base_link: String,
        tip_link: String,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        masses: Option<Masses>,
    },
    Arms {
        arms: Vec<ArmText>,
    },
}

/// One of several arms.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct ArmText {
    name: String,
    chain: ChainText,
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

/// A point or a plane that stands in the world.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct PlaceFacts {
    is_plane: bool,
    #[serde(flatten)]
    frame: FrameFacts,
}

/// A length before the fit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct LengthFacts {
    name: String,
    length_m: f64,
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
    /// What a run leaves for later: the arm as it was last. What each recording has for itself is that of the last.
    pub(crate) fn of(run: &Run) -> Result<PastModel, ReportError> {
        let missing = match &run.diagnosis {
            Some(diagnosis) => diagnosis.suggested(run.model.chain().joint_names())?,
            None => Vec::new(),
        };
        let (model, calibration) = (&run.model, &run.calibration);
        let start = model.nominal();
        let last = run.recordings.len().saturating_sub(1);
        let value = |index: usize| {
            let at = model.in_place_of(index, last);
            let estimate = &calibration.fit.estimates[at];
            Value {
                name: model.parameters()[index].name.clone(),
                nominal: calibration.nominal_values[at],
                calibrated: estimate.value,
                sigma: estimate.sigma,
            }
        };
        let shared = (0..model.parameters().len()).filter(|index| !model.copies().contains(index));
        let (alone, start_then) = model.in_recording(last, &start);
        let facts = |name: &str, pose: &Pose| FrameFacts::of(model, name, pose);
        let prefix =
            |arm: usize| model.chain().arms().get(arm).map_or_else(String::new, |a| a.name.clone() + ".");
        let tip = |arm: usize| facts(&(prefix(arm) + "tip"), &model.feature_in_link(&start, FeatureId(arm)));
        let further = (1..model.chain().arms().len())
            .map(|arm| [facts(&(prefix(arm) + "base"), &model.arm_base_in_world(&start, arm)), tip(arm)]);
        let boards = run.recordings.iter().enumerate().filter_map(|(index, recording)| {
            let pose = model.board_in_world(&start, index)?;
            Some(facts(&format!("board.{}", recording.name), &pose))
        });
        let marker = |(feature, name, link): (FeatureId, &str, &str)| MarkerFacts {
            link: link.to_owned(),
            frame: facts(name, &model.feature_in_link(&start, feature)),
        };
        let recordings = run.recordings.iter().enumerate();
        let judged = calibration.judged();
        Ok(PastModel {
            schema: SCHEMA.into(),
            version: VERSION.into(),
            pipeline: run.pipeline_name.clone(),
            chain: chain_text(run.model.chain(), &run.model_texts, &run.pipeline_text),
            base: facts(&(prefix(0) + "base"), &alone.base_in_world(&start_then)),
            tip: tip(0),
            markers: model.markers().map(marker).collect(),
            more_arms: further.collect(),
            places: model
                .places()
                .map(|(k, name, is_plane)| PlaceFacts {
                    is_plane,
                    frame: facts(name, &model.place_in_world(&start, k)),
                })
                .collect(),
            lengths: model
                .lengths()
                .map(|(name, index)| LengthFacts { name: name.to_owned(), length_m: start[index] })
                .collect(),
            boards: boards.collect(),
            effects: model.effects().iter().map(|effect| EffectTable::from(&effect.spec)).collect(),
            session: run.session.clone(),
            parameters: shared.map(value).collect(),
            recordings: recordings.map(|(i, r)| recording(r, i, run)).collect(),
            postures_rad: thinned(&run.observations),
            range_rad: (0..model.joint_count()).map(|j| range(&run.observations, j)).collect(),
            visited: visited(model, &run.observations),
            mean_error_m: Some(judged.fitted.mean_m).filter(|mean| mean.is_finite()),
            missing: missing.iter().map(EffectSpec::to_string).collect(),
        })
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

    /// The URDF that an arm came from and the link that its base is; none of one from a DH table.
    pub fn urdf(&self, arm: usize) -> Option<(&str, &str)> {
        let chain = match &self.chain {
            ChainText::Arms { arms } => &arms.get(arm)?.chain,
            one => one,
        };
        match chain {
            ChainText::Urdf { text, base_link, .. } => Some((text, base_link)),
            _ => None,
        }
    }

    /// Whether the fit could change a parameter.
    pub fn was_free(&self, index: usize) -> bool {
        self.parameters.get(index).is_some_and(|value| value.sigma > 0.0)
    }

    /// The nominal arm, or arms, in the frames.
    fn geometry(&self, chain: Chain) -> Result<Model, ModelError> {
        let place = |p: &PlaceFacts| FixedPlace { frame: p.frame.frame(), is_plane: p.is_plane };
        let length = |l: &LengthFacts| Length {
            name: l.name.clone(),
            length_m: l.length_m,
            knowledge: Knowledge::Given,
        };
        let places: Vec<FixedPlace> = self.places.iter().map(place).collect();
        let lengths: Vec<Length> = self.lengths.iter().map(length).collect();
        self.arms_in_frames(chain)?.against(&places, &lengths)
    }

    fn arms_in_frames(&self, chain: Chain) -> Result<Model, ModelError> {
        let (base, tip) = (self.base.frame(), self.tip.frame());
        if self.more_arms.is_empty() {
            let boards = self.boards.iter().map(FrameFacts::frame).collect();
            let markers = self.markers.iter().map(MarkerFacts::marker).collect();
            return Model::new(chain, Frames { base, tip, markers, boards });
        }
        let further =
            self.more_arms.iter().map(|[base, tip]| ArmFrames { base: base.frame(), tip: tip.frame() });
        let arms = std::iter::once(ArmFrames { base, tip }).chain(further).collect();
        Model::of_arms(chain, arms)
    }

    /// The models, made again.
    ///
    /// # Errors
    /// Contents that contradict each other, as only a file changed by hand has them.
    pub fn arms(&self) -> Result<PastArms, ModelError> {
        let measured: Vec<&str> = self.markers.iter().map(|marker| marker.link.as_str()).collect();
        let geometry = self.geometry(self.chain.chain(&measured, Path::new(FILE))?)?;
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

impl ChainText {
    /// The arm, or arms, that the text is of, with the branches to what is measured.
    fn chain(&self, measured: &[&str], path: &Path) -> Result<Chain, ModelError> {
        match self {
            ChainText::Dh { text } => Chain::from_dh_toml(text, path),
            ChainText::Urdf { text, base_link, tip_link, masses } => {
                let chain = Chain::from_urdf_branches(text, base_link, tip_link, measured, path)?;
                chain.with_masses(*masses, path)
            }
            ChainText::Arms { arms } => {
                let chains = arms.iter().map(|arm| Ok((arm.name.clone(), arm.chain.chain(measured, path)?)));
                Chain::joined(chains.collect::<Result<Vec<_>, ModelError>>()?)
            }
        }
    }
}

/// The files of the nominal arms; the ends of a URDF chain are what the pipeline says.
fn chain_text(chain: &Chain, texts: &[String], pipeline_text: &str) -> ChainText {
    let pipeline = pipeline_text.parse::<toml::Table>().unwrap_or_default();
    let one = |chain: &Chain, text: &String, model: Option<&toml::Value>| {
        let link = |key| {
            let found = model.and_then(|model| model.get(key)).and_then(toml::Value::as_str);
            found.unwrap_or_default().to_owned()
        };
        let text = text.clone();
        match chain.is_urdf() {
            true => {
                let (base_link, tip_link) = (link("base_link"), link("tip_link"));
                ChainText::Urdf { text, base_link, tip_link, masses: chain.masses() }
            }
            false => ChainText::Dh { text },
        }
    };
    if chain.arms().is_empty() {
        return one(chain, texts.first().unwrap_or(&String::new()), pipeline.get("model"));
    }
    let arms = chain.arms().iter().zip(texts).enumerate().map(|(at, (arm, text))| {
        let section = pipeline.get("arms").and_then(|arms| arms.get(at)).and_then(|arm| arm.get("model"));
        ArmText { name: arm.name.clone(), chain: one(&arm.chain, text, section) }
    });
    ChainText::Arms { arms: arms.collect() }
}

fn recording(recording: &RecordingRun, index: usize, run: &Run) -> RecordingFacts {
    let own: Vec<&Observation> = run.observations.iter().filter(|o| o.dwell.recording == index).collect();
    let temperatures: Vec<f64> = own.iter().filter_map(|o| o.temperature_c).collect();
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    RecordingFacts {
        name: recording.name.clone(),
        identity: recording.files().into_iter().map(|f| f.identity).collect(),
        dwells: Some(own.iter().map(|o| DwellMark::of(o.time_ns, &o.joint_rad)).collect()),
        last_dwell: own.iter().map(|o| o.dwell.dwell).max().unwrap_or(0),
        last_ns: own.iter().map(|o| o.time_ns).max().unwrap_or(run.session.end_ns),
        load_kg: own.last().map_or(0.0, |o| o.load_kg),
        more_loads: own.last().map_or_else(Vec::new, |o| o.more_loads.clone()),
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
