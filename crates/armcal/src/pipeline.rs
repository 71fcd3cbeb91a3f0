//! The pipeline file: one TOML a rig or purpose, its sections in the order of the story.
//!
//! Paths inside the file are relative to the file. Every section belongs to the crate that acts on it;
//! this module only puts them side by side, so a key is documented where it is used.

mod loads;
mod markers;
mod measures;
mod points;
mod text;

pub use loads::LoadEntry;
pub use markers::MarkerSection;
pub(crate) use measures::knowledge;
pub use measures::{Measure, MeasureKind, MeasureSection};
pub use points::PointsFile;
pub(crate) use text::read_text;

use crate::check::CheckSection;
use crate::error::Error;
use crate::pool::PoolSection;
use crate::two_arms::{ClosedChainSection, TwoArms};
use armcal_calibrate::{FitConfig, HoldoutConfig};
use armcal_core::RollPitchYaw;
use armcal_diagnose::DiagnosisConfig;
use armcal_dwell::{ClockConfig, DwellConfig};
use armcal_model::{Deviation, EffectTable, Masses};
use armcal_recording::input::Kind;
use armcal_recording::{Streams, files_of, input, is_url, without_ending};
use armcal_report::{OutputConfig, VerifyConfig};
use armcal_table::{AssociationConfig, Tilt};
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

/// How good the result has to be.
#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct AccuracySection {
    /// Mean error of the judged points that is wanted at most [mm]: above it the result is inadequate (exit 3), at it nothing about
    /// the size of the errors makes it so. Eq. 4 of the paper has it as `a`.
    pub wanted_mm: Option<f64>,
}

/// One recording.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordingEntry {
    /// Name used in parameters and outputs; the stem of the first file when absent.
    pub name: Option<String>,
    /// Its files: one, the parts of a split bag or the folder of one; paths, or URLs such as `s3://bucket/key` (feature `s3`).
    pub paths: Vec<PathBuf>,
    /// Declared tilt of the board.
    #[serde(default)]
    pub tilt: Tilt,
    /// Load at the tip [kg].
    #[serde(default)]
    pub load_kg: f64,
    /// Loads at any tip or marker.
    #[serde(default)]
    pub loads: Vec<LoadEntry>,
    /// Points of the tip that a laser tracker exported, one a dwell.
    pub points: Option<PointsFile>,
}

impl RecordingEntry {
    /// The recording's name.
    pub fn name(&self) -> String {
        recording_name(self.name.as_ref(), &self.paths)
    }
}

/// The given name, or the stem of the first file.
pub(crate) fn recording_name(given: Option<&String>, paths: &[PathBuf]) -> String {
    let stem = || paths.first().map(|p| without_ending(p));
    let stem = || stem().and_then(|p| p.file_name().map(|s| s.to_string_lossy().into_owned()));
    given.cloned().or_else(stem).unwrap_or_default()
}

/// The calibration table.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TableSection {
    /// Board geometry file.
    pub board: PathBuf,
    /// How the board's pose is known.
    pub pose: BoardPose,
    /// What the table's markers are fixed to, for `pose = "measured"`.
    #[serde(default)]
    pub markers_on: MarkersOn,
    /// Pose of the untilted board (`given`), or of the board relative to the tracked table subject
    /// (`measured`; identity when absent).
    #[serde(default)]
    pub at: RollPitchYaw,
    /// Standard error of a measured board pose beyond the sensor's noise [mm]; 0 takes it as exact.
    #[serde(default)]
    pub sigma_mm: f64,
    /// Same for its rotation [deg].
    #[serde(default)]
    pub sigma_deg: f64,
    /// How dwells are associated to cavities.
    #[serde(default)]
    pub association: AssociationConfig,
}

/// How the board's pose is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum BoardPose {
    /// From the `table` stream.
    Measured,
    /// From `at` and the declared tilt.
    Given,
    /// Estimated with the arm, one pose a recording (camera-free).
    Estimated,
}

/// What the table's markers are fixed to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum MarkersOn {
    /// The board itself: the measured pose includes the tilt.
    #[default]
    Board,
    /// The frame below the tilting mechanism: the declared tilt is applied on top.
    Frame,
}

/// What is known of the position sensor itself.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensorSection {
    /// Standard error of its scale along each axis [ppm], beyond which no explanation goes; 0 takes the scale as exact.
    pub scale_sigma_ppm: Option<f64>,
}

/// The nominal arm: a DH file or a URDF chain.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelSection {
    /// DH file.
    pub dh: Option<PathBuf>,
    /// URDF file.
    pub urdf: Option<PathBuf>,
    /// First link of the chain, with `urdf`.
    pub base_link: Option<String>,
    /// Last link of the chain, with `urdf`.
    pub tip_link: Option<String>,
    /// Where the masses of its links come from; where nothing says it, from a URDF that gives all of them.
    pub masses: Option<Masses>,
    /// How far a joint origin may be from nominal, with `urdf`; a DH file says it itself. Learnt where nothing says it.
    pub deviation: Option<Deviation>,
}

/// What is known about the frames that are not the board.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FramesSection {
    /// The robot's base in the sensor's frame; without a sensor the base is the world.
    #[serde(default)]
    pub base: FrameSection,
    /// The calibrated point on the last link.
    #[serde(default)]
    pub tip: FrameSection,
    /// Which frame's z axis is vertical; gravity bends the arm along it.
    #[serde(default)]
    pub vertical: Vertical,
}

/// Which frame's z axis points up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Vertical {
    /// The sensor's frame, levelled.
    #[default]
    World,
    /// The robot's base, standing upright; for a sensor whose frame lies anyhow.
    Base,
}

/// One frame.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrameSection {
    /// How it is known.
    #[serde(default)]
    pub pose: FramePose,
    /// The given pose, or where the estimate starts.
    #[serde(default)]
    pub at: RollPitchYaw,
    /// Standard error of a measured frame [mm].
    #[serde(default)]
    pub sigma_mm: f64,
    /// Same for its rotation [deg].
    #[serde(default)]
    pub sigma_deg: f64,
}

/// How a frame is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FramePose {
    /// Exactly `at`.
    #[default]
    Given,
    /// From the `base` stream, with `sigma_mm` and `sigma_deg` (for the tip: `at` with those).
    Measured,
    /// Estimated with the arm.
    Estimated,
}

/// A change to parameters whose names match a pattern such as `joint*.alpha`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParameterOverride {
    /// Name or glob; of an effect, a spec and a quantity (`backlash:2.width`, `sensor_scale.*`).
    pub name: String,
    /// Whether the fit may change it.
    pub free: Option<bool>,
    /// Largest deviation from nominal, display unit of the parameter (mm or deg).
    pub bound: Option<f64>,
    /// Standard deviation of the prior, display unit (mm or deg).
    pub prior: Option<f64>,
}

/// Which dwells become observations.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ObservationsSection {
    /// Dwells in a cavity.
    pub seated: bool,
    /// Dwells the sensor saw away from the cavities.
    pub tracked: bool,
    /// Standard error of a tracked position that averaging does not reduce, per axis [mm].
    pub sensor_sigma_mm: f64,
    /// Same for orientation [deg].
    pub sensor_sigma_deg: f64,
}

impl Default for ObservationsSection {
    fn default() -> Self {
        ObservationsSection { seated: true, tracked: true, sensor_sigma_mm: 0.0, sensor_sigma_deg: 0.0 }
    }
}

/// Text that is no TOML is nobody's; its syntax error is told by whoever parses it.
fn is_of_two_arms(text: &str) -> bool {
    text.parse::<toml::Table>().is_ok_and(|table| table.contains_key("arms"))
}

impl Pipeline {
    /// Reads and checks a pipeline file.
    pub fn load(path: &Path) -> Result<Pipeline, Error> {
        let text = read_text("pipeline", Kind::Text, path)?;
        Pipeline::parse(path, text, path.parent().unwrap_or(Path::new("")))
    }

    /// The same for recordings that are named elsewhere; the pipeline's own are left out.
    pub fn load_for_others(path: &Path) -> Result<Pipeline, Error> {
        let text = read_text("pipeline", Kind::Text, path)?;
        let mut pipeline = Pipeline::read(path, text, path.parent().unwrap_or(Path::new("")))?;
        pipeline.note_inputs();
        pipeline.recordings.clear();
        pipeline.check_sections(path)?;
        Ok(pipeline)
    }

    /// This pipeline on one other recording.
    pub fn of_recording(&self, entry: &RecordingEntry) -> Pipeline {
        Pipeline { recordings: vec![entry.clone()], ..self.clone() }
    }

    /// Reads and checks the text of a pipeline whose relative paths start in `folder`.
    pub fn parse(path: &Path, text: String, folder: &Path) -> Result<Pipeline, Error> {
        let pipeline = Pipeline::proposed(path, text, folder)?;
        pipeline.note_inputs();
        Ok(pipeline)
    }

    /// The same of one whose files may not be written yet: they are no inputs.
    pub(crate) fn proposed(path: &Path, text: String, folder: &Path) -> Result<Pipeline, Error> {
        let pipeline = Pipeline::read(path, text, folder)?;
        pipeline.check_recordings(path)?;
        pipeline.check_sections(path)?;
        Ok(pipeline)
    }

    fn read(path: &Path, text: String, folder: &Path) -> Result<Pipeline, Error> {
        let mut pipeline = match is_of_two_arms(&text) {
            true => TwoArms::parse(path, &text)?,
            false => toml::from_str(&text).map_err(|source| Error::PipelineSyntax {
                path: path.to_owned(),
                source: Box::new(source),
            })?,
        };
        let gauges = pipeline.measure.iter();
        pipeline.streams.gauges =
            gauges.filter_map(|m| Some((m.name().to_owned(), m.reading.clone()?))).collect();
        pipeline.folder = folder.to_owned();
        pipeline.text = text;
        pipeline.open_folders();
        Ok(pipeline)
    }

    /// Puts the files of a bag in the place of its folder.
    fn open_folders(&mut self) {
        for entry in &mut self.recordings {
            let is_folder = |p: &PathBuf| !is_url(p) && self.folder.join(p).is_dir();
            if entry.paths.iter().any(is_folder) {
                entry.name = Some(entry.name());
                let paths: Vec<PathBuf> =
                    entry.paths.iter().map(|p| armcal_recording::resolve(&self.folder, p)).collect();
                entry.paths = files_of(&paths);
            }
        }
    }

    /// Notes every file that the pipeline names, so that no output is begun in its place.
    fn note_inputs(&self) {
        let model = self.models().into_iter().flat_map(|model| [&model.dh, &model.urdf]).flatten();
        let board = self.table.iter().map(|table| &table.board);
        let recordings = self.recordings.iter().flat_map(|entry| &entry.paths);
        model.chain(board).chain(recordings).for_each(|path| input::note(&self.resolve(path)));
        if let Some(reference) = &self.check.reference {
            let reference = self.resolve(reference);
            let inside = ["summary.json", "run.mcap"].map(|name| reference.join(name));
            inside.iter().chain([&reference]).for_each(|path| input::note(path));
        }
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
        armcal_recording::resolve(&self.folder, path)
    }

    /// An error about a file that is not there, with what the pipeline says about where its data come from.
    pub fn where_data_come_from(&self, error: Error) -> Error {
        match &self.data {
            Some(data) if error.is_missing_file() => {
                Error::MissingData { source: Box::new(error), data: data.clone() }
            }
            _ => error,
        }
    }

    /// Recordings that contradict each other.
    fn check_recordings(&self, path: &Path) -> Result<(), Error> {
        let fail = |key: &str, problem: String| {
            Err(Error::PipelineContradiction { path: path.to_owned(), key: key.into(), problem })
        };
        if self.recordings.is_empty() {
            return fail("recordings", "names no recording; add [[recordings]] with paths = [...]".into());
        }
        for (i, entry) in self.recordings.iter().enumerate() {
            let name = entry.name();
            if entry.paths.is_empty() {
                return fail(&format!("recordings[{i}].paths"), "is empty".into());
            }
            if self.recordings[..i].iter().any(|other| other.name() == name) {
                return fail(
                    &format!("recordings[{i}].name"),
                    format!("`{name}` names two recordings; give one of them another name = \"...\""),
                );
            }
            loads::check(self, i, entry, &fail)?;
        }
        Ok(())
    }

    /// Sections that contradict each other.
    fn check_sections(&self, path: &Path) -> Result<(), Error> {
        let fail = |key: &str, problem: String| {
            Err(Error::PipelineContradiction { path: path.to_owned(), key: key.into(), problem })
        };
        if self.table.as_ref().is_some_and(|t| t.pose == BoardPose::Measured) && self.streams.table.is_none()
        {
            return fail("table.pose", "is \"measured\" but there is no [streams.table]".into());
        }
        if self.frames.base.pose == FramePose::Measured && self.streams.base.is_none() {
            return fail("frames.base.pose", "is \"measured\" but there is no [streams.base]".into());
        }
        let tracked = self.tip_is_tracked() || !self.markers.is_empty();
        let measured = self.closed_chain.is_some() || !self.measure.is_empty();
        if !measured && self.table.is_none() && !tracked {
            let problem = "is absent and so are [streams.tip], `points` of [[recordings]] and [[measure]]: nothing says where the tip was";
            return fail("table", problem.into());
        }
        points::check(self, &fail)?;
        markers::check(self, &fail)?;
        measures::check(self, &fail)?;
        if let Some((key, said)) = self.closed_chain.as_ref().and_then(|chain| chain.contradiction(self)) {
            return fail(key, said);
        }
        if self.sensor.scale_sigma_ppm.is_some_and(|ppm| !(ppm >= 0.0 && ppm.is_finite())) {
            return fail("sensor.scale_sigma_ppm", "must be 0 or more".into());
        }
        self.pool.check(path)?;
        let one_file = |model: &&ModelSection| model.dh.is_some() != model.urdf.is_some();
        if !self.models().iter().all(one_file) {
            return fail("model", "needs exactly one of dh = \"...\" or urdf = \"...\"".into());
        }
        let of_table = |model: &&ModelSection| model.urdf.is_none() && model.masses == Some(Masses::Urdf);
        match self.models().iter().any(of_table) {
            true => fail("model.masses", "is \"urdf\", but a DH table gives no masses; leave it out".into()),
            false => Ok(()),
        }
    }
}
