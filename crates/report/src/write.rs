//! All files of a run, in one folder.

use crate::findings::Findings;
use crate::layouts::run_layouts;
use crate::mcap_file::{Attachment, write_mcap};
use crate::page::report_html;
use crate::parameters::parameters_toml;
use crate::pool_json::{self, pool_json};
use crate::tables::{self, parquet_files};
use crate::{ReportError, summary_json};
use armcal_config::{InputMessages, OutputConfig};
use armcal_recording::atomic::AtomicFile;
use armcal_recording::{Recording, RecordingError, make_folder};
use armcal_result::sensitivity::Basis;
use armcal_result::{
    CONCLUSIONS_FILE, Conclusions, ModelFile, OBSERVATIONS_FILE, REPORT, RUN, ResultError, Run, SUMMARY,
    model_file_name, model_files, model_of, observations_json, points,
};
use std::io::{self, BufWriter, Write as _};
use std::path::{Path, PathBuf};

const PARAMETERS: &str = "parameters.toml";
/// The layout for Foxglove, and the same for Foxglove Studio and Lichtblick.
pub(crate) const LAYOUT: &str = "foxglove-layout.json";
pub(crate) const LAYOUT_LEGACY: &str = "foxglove-layout-legacy.json";

/// Writes `run.mcap`, `report.html`, `summary.json`, `parameters.toml`, the calibrated model (for its own
/// tools, and as `model.json` with its effects), `observations.json` for `armcal pool` (of a pool `pool.json`), Foxglove layouts and the
/// Parquet tables into `out_dir`, which is made if need be; returns their paths.
///
/// `recordings` are the opened inputs in the order of [`Run::recordings`]; they are read only with
/// [`InputMessages::Copy`]. Files of an earlier run are replaced, each at once.
///
/// # Errors
/// A folder or file that cannot be written, an input that cannot be read again, or a run whose parts do not
/// belong together. Nothing but complete files is left behind: all are made before the first one appears.
pub fn write_all(
    run: &Run,
    recordings: &[Recording],
    out_dir: &Path,
    config: &OutputConfig,
) -> Result<Vec<PathBuf>, ReportError> {
    if config.input == InputMessages::Copy && recordings.len() != run.recordings.len() {
        let (opened, named) = (recordings.len(), run.recordings.len());
        return Err(
            ResultError::Inconsistent(format!("{opened} recordings opened for {named} in the run")).into()
        );
    }
    let points = points(run)?;
    let models = model_files(run)?;
    let parameters = parameters_toml(run)?;
    let stored_model = model_of(run)?.json().map_err(ReportError::Page)?;
    // Observations of earlier results are where they were read, and a second copy of them would be pooled with them.
    let observations = match run.is_pool() {
        true => (pool_json::FILE, pool_json(run)),
        false => (OBSERVATIONS_FILE, observations_json(run)?),
    };
    let summary = summary_json(run)?;
    let tables = parquet_files(run, &points)?;
    let findings = Findings::of(run, &points);
    let layouts = run_layouts(run, &points, &findings);
    let page = report_html(run, &Basis::of(run))?;

    make_folder(out_dir).map_err(|source| ReportError::Folder(Box::new(source)))?;
    let mut staged = Vec::new();
    let texts = [
        (REPORT, &page),
        (SUMMARY, &summary),
        (PARAMETERS, &parameters),
        (armcal_model_file::FILE, &stored_model),
        (observations.0, &observations.1),
        (LAYOUT, &layouts.current),
        (LAYOUT_LEGACY, &layouts.legacy),
    ];
    let models_as_texts = models.iter().map(|model| (model.name.as_str(), &model.text));
    for (name, text) in texts.into_iter().chain(models_as_texts) {
        staged.push(stage_file(&out_dir.join(name), text.as_bytes())?);
    }
    for (name, bytes) in &tables {
        staged.push(stage_file(&out_dir.join(name), bytes)?);
    }

    let mut attachments = vec![
        Attachment { name: "pipeline.toml", media_type: "application/toml", text: &run.pipeline_text },
        Attachment { name: REPORT, media_type: "text/html", text: &page },
        Attachment { name: SUMMARY, media_type: "application/json", text: &summary },
        Attachment { name: PARAMETERS, media_type: "application/toml", text: &parameters },
        Attachment { name: armcal_model_file::FILE, media_type: "application/json", text: &stored_model },
        Attachment { name: LAYOUT, media_type: "application/json", text: &layouts.current },
        Attachment { name: LAYOUT_LEGACY, media_type: "application/json", text: &layouts.legacy },
    ];
    let of_models =
        models.iter().map(|ModelFile { name, media_type, text, .. }| Attachment { name, media_type, text });
    attachments.splice(4..4, of_models);
    let concluded = Conclusions::of(run).map(|conclusions| conclusions.text()).transpose()?;
    let concluded = concluded.as_deref();
    let named = |text| Attachment { name: CONCLUSIONS_FILE, media_type: "application/toml", text };
    attachments.extend(concluded.map(named));
    let to_copy = config.copied(recordings);
    let mcap_path = out_dir.join(RUN);
    let mcap = write_mcap(run, &points, &findings, to_copy, &attachments, &mcap_path);
    // The last to get its name: by what the old one holds, files of earlier versions are known.
    staged.push(mcap.map_err(write_error(&mcap_path))?);
    commit_all(staged)
}

/// The files that [`write_all`] writes into `out_dir`, of an arm, or several by name, each with a URDF or a DH file: to look at
/// before a run whether they may be written.
pub fn run_files<'a>(
    out_dir: &Path,
    arms: impl IntoIterator<Item = (Option<&'a str>, bool)>,
) -> Vec<PathBuf> {
    output_paths(out_dir, arms, OBSERVATIONS_FILE)
}

/// The same of a run of earlier results.
pub fn pool_files<'a>(
    out_dir: &Path,
    arms: impl IntoIterator<Item = (Option<&'a str>, bool)>,
) -> Vec<PathBuf> {
    output_paths(out_dir, arms, pool_json::FILE)
}

fn output_paths<'a>(
    out_dir: &Path,
    arms: impl IntoIterator<Item = (Option<&'a str>, bool)>,
    observations: &str,
) -> Vec<PathBuf> {
    let models = arms.into_iter().map(|(arm, urdf)| model_file_name(arm, urdf));
    let fixed =
        [RUN, REPORT, SUMMARY, PARAMETERS, armcal_model_file::FILE, observations, LAYOUT, LAYOUT_LEGACY];
    let fixed = fixed.into_iter().chain(tables::FILES).map(str::to_owned);
    fixed.chain(models).map(|name| out_dir.join(name)).collect()
}

/// Writes what a campaign keeps of each recording: `summary.json`, `parameters.toml`, `model.json` and
/// `observations.json`, into a folder that is there.
///
/// # Errors
/// A file that cannot be written, or a run whose parts do not belong together.
pub fn write_brief(run: &Run, out_dir: &Path) -> Result<(), ReportError> {
    let texts = [
        (SUMMARY, summary_json(run)?),
        (PARAMETERS, parameters_toml(run)?),
        (armcal_model_file::FILE, model_of(run)?.json().map_err(ReportError::Page)?),
        (OBSERVATIONS_FILE, observations_json(run)?),
    ];
    for (name, text) in texts {
        let path = out_dir.join(name);
        stage_file(&path, text.as_bytes())?.commit().map_err(write_error(&path))?;
    }
    Ok(())
}

/// A complete file that has no name yet.
pub(crate) fn stage_file(path: &Path, bytes: &[u8]) -> Result<AtomicFile, ReportError> {
    stage_pieces(path, |out| out.write_all(bytes))
}

/// The same of a file that is written piece by piece, and never in memory as a whole.
pub(crate) fn stage_pieces(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<AtomicFile>) -> io::Result<()>,
) -> Result<AtomicFile, ReportError> {
    let refused =
        |e: io::Error| write_error(path)(RecordingError::Write { path: path.to_owned(), why: e.to_string() });
    let mut file = BufWriter::new(AtomicFile::create(path).map_err(write_error(path))?);
    write(&mut file).map_err(refused)?;
    file.into_inner().map_err(|e| refused(e.into_error()))
}

/// Gives complete files their names; returns their paths.
pub(crate) fn commit_all(staged: Vec<AtomicFile>) -> Result<Vec<PathBuf>, ReportError> {
    may_commit(&staged)?;
    let named = |file: AtomicFile| {
        let path = file.target().to_owned();
        file.commit().map_err(write_error(&path)).map(|()| path)
    };
    staged.into_iter().map(named).collect()
}

/// Whether each of these may take its place.
fn may_commit(staged: &[AtomicFile]) -> Result<(), ReportError> {
    staged.iter().try_for_each(|file| file.may_commit().map_err(write_error(file.target())))
}

/// What writing this file ran into.
pub(crate) fn write_error(path: &Path) -> impl FnOnce(RecordingError) -> ReportError {
    let path = path.to_owned();
    move |source| ReportError::Write { path, source: Box::new(source) }
}
