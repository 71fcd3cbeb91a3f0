//! A scenario on disk: everything the product may see in one folder, the truth elsewhere.

use crate::checks::value_error;
use crate::config::LabConfig;
use crate::scenario::Scenario;
use crate::truth::write_json;
use crate::{
    LabError, Nominal, board, make_folder, may_write, nothing_hidden, simulate_in_memory, write_recordings,
};
use armcal_recording::may_write_all;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Where a sealed scenario lies.
#[derive(Debug, Clone, PartialEq)]
pub struct Sealed {
    /// One file a recording.
    pub recordings: Vec<PathBuf>,
    /// The pipeline that `armcal run` takes.
    pub pipeline: PathBuf,
    /// The truth.
    pub truth: PathBuf,
}

/// Records a scenario in full into `folder`: `<recording>.mcap`, `pipeline.toml`, `arm.toml`, `board.toml`. Nothing
/// there tells what is hidden; that goes to `truth`, which must lie outside of the folder.
pub fn seal(scenario: &Scenario, folder: &Path, truth: &Path) -> Result<Sealed, LabError> {
    let whole = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    if whole(truth).starts_with(whole(folder)) {
        let why = "must lie outside of the folder of the recordings, or it would not be sealed".into();
        return Err(value_error("truth", why));
    }
    let planted = scenario.plant()?;
    let config = &planted.config;
    let [arm, drawing, pipeline] = ["arm.toml", "board.toml", "pipeline.toml"].map(|name| folder.join(name));
    may_write(config.recordings.iter().map(|r| r.name.as_str()), folder, truth)?;
    may_write_all([&arm, &drawing, &pipeline])?;
    let (mut facts, logs) = simulate_in_memory(config, Path::new(""), &nothing_hidden)?;
    facts.scenario = Some(scenario.clone());
    facts.hidden = planted.hidden;

    let recordings = write_recordings(&facts, &logs, folder)?;
    write_with_header(&arm, "arm", &Nominal::dh_toml(config))?;
    write_with_header(&drawing, "board", &board::read_drawing(&config.board.file)?)?;
    write_with_header(&pipeline, "pipeline", &pipeline_toml(config))?;
    if let Some(parent) = truth.parent() {
        make_folder(parent)?;
    }
    write_json(&facts, truth)?;
    Ok(Sealed { recordings, pipeline, truth: truth.to_owned() })
}

/// Writes a text that says in its first line by whom it was made.
fn write_with_header(path: &Path, kind: &str, text: &str) -> Result<(), LabError> {
    let text = format!("# armcal.simulated-{kind}/1\n{text}");
    armcal_recording::atomic::write(path, text.as_bytes())
        .map_err(|source| LabError::Recording { path: path.to_owned(), source: Box::new(source) })
}

fn pipeline_toml(config: &LabConfig) -> String {
    let mut text = format!("name = \"{}\"\n", config.name);
    for recording in &config.recordings {
        let (name, load) = (&recording.name, recording.load_kg);
        let (roll, pitch) = (recording.roll_deg, recording.pitch_deg);
        // Writing to a string cannot fail.
        let _ = write!(
            text,
            "\n[[recordings]]\npaths = [\"{name}.mcap\"]\ntilt = {{ roll_deg = {roll:?}, pitch_deg = {pitch:?} }}\n\
             load_kg = {load:?}\n"
        );
    }
    let subject = |name: &str| format!("/vicon/{name}/{name}");
    let vicon = &config.vicon;
    let _ = write!(
        text,
        "\n[streams.joints]\ntopic = \"{}\"\nnames = {:?}\n\n[streams.tip]\ntopic = \"{}\"\n\n\
         [streams.base]\ntopic = \"{}\"\n\n[streams.table]\ntopic = \"{}\"\n",
        config.joints.topic,
        config.joints.names,
        subject(&vicon.tip.subject),
        subject(&vicon.base.subject),
        subject(&vicon.table.subject),
    );
    if config.temperature.published {
        let _ = write!(text, "\n[streams.temperature]\ntopic = \"{}\"\n", config.temperature.topic);
    }
    let holdout =
        if config.task.passes.is_empty() { "" } else { "\n[holdout]\nkind = \"cavity-folds\"\nk = 5\n" };
    let _ = write!(
        text,
        "\n[table]\nboard = \"board.toml\"\npose = \"measured\"\n\n[model]\ndh = \"arm.toml\"\n\n\
         [frames.base]\npose = \"measured\"\nsigma_mm = {:?}\nsigma_deg = {:?}\n{holdout}",
        vicon.base_mount_sigma_mm, vicon.base_mount_sigma_deg,
    );
    text
}
