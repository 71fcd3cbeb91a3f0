//! The whole file: its sections side by side.

use crate::{
    AccuracySection, CheckSection, ClosedChainSection, FrameSection, FramesSection, LoadEntry, MarkerSection,
    MeasureSection, ModelSection, ObservationsSection, OutputConfig, ParameterOverride, PoolSection,
    RecordingEntry, SensorSection, TableSection, TwoArms, VerifyConfig,
};
use armcal_calibrate::{FitConfig, HoldoutConfig};
use armcal_core::{FeatureId, Load};
use armcal_diagnose::DiagnosisConfig;
use armcal_dwell::{ClockConfig, DwellConfig};
use armcal_model::EffectTable;
use armcal_recording::Streams;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A pipeline, as written.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pipeline {
    /// Name shown in every output.
    pub name: String,
    /// Where the recordings and models come from: told when one of these files is not there.
    pub data: Option<String>,
    /// The recordings, in order; a recording may consist of several split files. `armcal batch` brings its own.
    #[serde(default)]
    pub recordings: Vec<RecordingEntry>,
    /// Which channels to read, and as what.
    pub streams: Streams,
    /// How the sensor's clock is related to the robot's.
    #[serde(default)]
    pub clock: ClockConfig,
    /// What counts as standing still.
    #[serde(default)]
    pub dwell: DwellConfig,
    /// The calibration table; absent when the tip is only tracked.
    pub table: Option<TableSection>,
    /// What is known of the position sensor itself.
    #[serde(default)]
    pub sensor: SensorSection,
    /// The nominal arm.
    pub model: ModelSection,
    /// What is known about base and tip.
    #[serde(default)]
    pub frames: FramesSection,
    /// What else is seen of the arm than its tip, by name.
    #[serde(default)]
    pub markers: BTreeMap<String, MarkerSection>,
    /// Points that stand in the world, by name.
    #[serde(default)]
    pub points: BTreeMap<String, FrameSection>,
    /// Planes that stand in the world, by name; `at` is any point of one, z its normal.
    #[serde(default)]
    pub planes: BTreeMap<String, FrameSection>,
    /// What is measured against them.
    #[serde(default)]
    pub measure: Vec<MeasureSection>,
    /// Changes to single parameters, applied in order.
    #[serde(default)]
    pub parameters: Vec<ParameterOverride>,
    /// Physical effects beyond geometry, in the order they were added.
    #[serde(default)]
    pub effects: Vec<EffectTable>,
    /// Which dwells become observations.
    #[serde(default)]
    pub observations: ObservationsSection,
    /// Objective and loss.
    #[serde(default)]
    pub fit: FitConfig,
    /// What the fit must not see.
    #[serde(default)]
    pub holdout: HoldoutConfig,
    /// What each recording has for itself when many are pooled.
    #[serde(default)]
    pub pool: PoolSection,
    /// How the missing effect is looked for.
    #[serde(default)]
    pub diagnosis: DiagnosisConfig,
    /// How good the result has to be.
    #[serde(default)]
    pub accuracy: AccuracySection,
    /// What stands beside a verification on these recordings.
    #[serde(default)]
    pub verify: VerifyConfig,
    /// Limits that `armcal check` holds the result to.
    #[serde(default)]
    pub check: CheckSection,
    /// What is written.
    #[serde(default)]
    pub output: OutputConfig,
    /// Two points of the robot that are joined to each other.
    pub closed_chain: Option<ClosedChainSection>,
    /// The two arms whose tips are joined, of a pipeline with `[[arms]]`; `model` is that of the first then.
    #[serde(skip)]
    pub two_arms: Option<TwoArms>,
    /// Folder of the pipeline file.
    #[serde(skip)]
    pub folder: PathBuf,
    /// The file's text, carried into the results.
    #[serde(skip)]
    pub text: String,
}

impl Pipeline {
    /// This pipeline on one other recording.
    pub fn of_recording(&self, entry: &RecordingEntry) -> Pipeline {
        Pipeline { recordings: vec![entry.clone()], ..self.clone() }
    }

    /// The nominal arm, or each of two.
    pub fn models(&self) -> Vec<&ModelSection> {
        match &self.two_arms {
            Some(two) => two.arms.iter().map(|arm| &arm.model).collect(),
            None => vec![&self.model],
        }
    }

    /// The names of two arms, each with whether its file is a URDF; of one arm without a name.
    pub fn arm_files(&self) -> Vec<(Option<&str>, bool)> {
        let names = self.two_arms.iter().flat_map(|two| &two.arms).map(|arm| Some(arm.name.as_str()));
        let names: Vec<Option<&str>> = names.chain([None]).collect();
        names.into_iter().zip(self.models()).map(|(name, model)| (name, model.urdf.is_some())).collect()
    }

    /// A path of the pipeline file, resolved against its folder; a URL stays as it is.
    pub fn resolve(&self, path: &Path) -> PathBuf {
        armcal_recording::resolve_path(&self.folder, path)
    }

    /// Whether a sensor sees the tip, on a stream or point by point.
    pub fn tip_is_tracked(&self) -> bool {
        self.streams.tip.is_some() || self.recordings.iter().any(|r| r.points.is_some())
    }

    /// Where a load can hang, in the order of the model's features: the tip of each arm, then the markers.
    pub(crate) fn hooks(&self) -> Vec<String> {
        let tips = match &self.two_arms {
            None => vec!["tip".to_owned()],
            Some(two) => two.arms.iter().map(|arm| format!("{}.tip", arm.name)).collect(),
        };
        tips.into_iter().chain(self.markers.keys().cloned()).collect()
    }

    /// The load at the (first) tip in a recording [kg], and those at other points.
    pub fn loads_of(&self, entry: &RecordingEntry) -> (f64, Vec<Load>) {
        let hooks = self.hooks();
        let load = |load: &LoadEntry| {
            let at = hooks.iter().position(|hook| *hook == load.at)?;
            Some(Load { at: FeatureId(at), kg: load.kg })
        };
        let (first, more): (Vec<Load>, Vec<Load>) =
            entry.loads.iter().filter_map(load).partition(|load| load.at.is_tip());
        (first.first().map_or(entry.load_kg, |load| load.kg), more)
    }
}
