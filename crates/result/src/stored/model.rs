//! `model.json`, the file of `armcal_model_file`: made of a run, and read back from its results.

use crate::StoredResultError;
use crate::error::ResultError;
use crate::run::{RecordingRun, Run, VERSION};
use crate::stored::{attached_texts, stored_text};
use armcal_core::{DwellMark, FeatureId, Observation, Pose, Unit, Visited};
use armcal_model::{Chain, EffectSpec, EffectTable, Model};
use armcal_model_file::{
    ArmText, ChainText, FILE, FrameFacts, LengthFacts, MarkerFacts, PlaceFacts, RecordingFacts, SCHEMA,
    StoredModel, Value,
};
use std::path::Path;

/// Postures that are kept at most; a longer session is thinned out evenly.
const MOST_POSTURES: usize = 400;

/// What a run leaves for later: the arm as it was last. What each recording has for itself is that of the last.
pub fn model_of(run: &Run) -> Result<StoredModel, ResultError> {
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
    let facts =
        |name: &str, pose: &Pose| FrameFacts::at(name, pose, model.index(&format!("{name}.rx")).is_some());
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
    Ok(StoredModel {
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
        recordings: recordings.map(|(i, r)| recording_facts(r, i, run)).collect(),
        postures_rad: thin_postures(&run.observations),
        range_rad: (0..model.joint_count()).map(|j| joint_range(&run.observations, j)).collect(),
        visited: visited_intervals(model, &run.observations),
        mean_error_m: Some(judged.fitted.mean_m).filter(|mean| mean.is_finite()),
        missing: missing.iter().map(EffectSpec::to_string).collect(),
    })
}

/// Reads the model of a run: its folder, its `run.mcap`, or the `model.json` itself.
///
/// # Errors
/// A file that cannot be read, or holds no model in this format.
pub fn open_model(path: &Path) -> Result<StoredModel, StoredResultError> {
    let path = if path.is_dir() { path.join(FILE) } else { path.to_owned() };
    let text = if path.extension().is_some_and(|e| e == "mcap") {
        attached_model_text(&path)?
    } else {
        model_file_text(&path)?
    };
    let bad = |why: String| StoredResultError::BadModel { path: path.clone(), why };
    StoredModel::from_json(&text).map_err(|e| bad(e.to_string()))
}

fn model_file_text(path: &Path) -> Result<String, StoredResultError> {
    stored_text(path, |why| StoredResultError::NoModel { path: path.to_owned(), why })
}

fn attached_model_text(path: &Path) -> Result<String, StoredResultError> {
    let why = || format!("it has no attachment armcal/{FILE}");
    let [text] = attached_texts(path, [FILE])?;
    text.ok_or_else(|| StoredResultError::NoModel { path: path.to_owned(), why: why() })
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

fn recording_facts(recording: &RecordingRun, index: usize, run: &Run) -> RecordingFacts {
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

fn thin_postures(observations: &[Observation]) -> Vec<Vec<f64>> {
    let stride = observations.len().div_ceil(MOST_POSTURES).max(1);
    observations.iter().step_by(stride).map(|o| o.joint_rad.clone()).collect()
}

/// What each joint of the model visited in these observations.
pub fn visited_intervals(model: &Model, observations: &[Observation]) -> Vec<Visited> {
    let of_joint = |joint: usize| {
        let readings = observations.iter().filter_map(|o| o.joint_rad.get(joint).copied());
        Visited::of(readings, model.chain().joint_unit(joint) == Unit::Metre)
    };
    (0..model.joint_count()).map(of_joint).collect()
}

fn joint_range(observations: &[Observation], joint: usize) -> [f64; 2] {
    let readings = observations.iter().filter_map(|o| o.joint_rad.get(joint).copied());
    let start = [f64::INFINITY, f64::NEG_INFINITY];
    readings.fold(start, |[low, high], q| [q.min(low), q.max(high)])
}
