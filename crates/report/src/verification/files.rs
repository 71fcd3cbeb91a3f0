//! A verification for programs.

use super::page::verification_html;
use super::{IsoReport, PathSample, Published, Told, Verification, VerifiedRecording};
use crate::ReportError;
use crate::past_model::Value;
use crate::run::{Status, VERSION};
use crate::tables::Columns;
use armcal_core::Warning;
use armcal_verify::{PathRow, PointsRow};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Version of the contract of `verification.json`.
const SCHEMA: &str = "armcal.verification/1";

#[derive(Serialize)]
struct File<'a> {
    schema: &'static str,
    version: &'static str,
    pipeline: &'a str,
    result: String,
    status: Status,
    conclusion: String,
    effects: &'a [String],
    recordings: &'a [VerifiedRecording],
    told: &'a [Told],
    recognises_copies: bool,
    points: &'a [PointsRow],
    paths: &'a [PathRow],
    iso9283: &'a IsoReport,
    parameters: &'a [Value],
    published: &'a [Published],
    warnings: &'a [Warning],
}

/// `verification.json`: every row of every table in SI, indented, with a final newline. `before` is the nominal arm,
/// `after` the calibrated one.
pub fn verification_json(v: &Verification) -> String {
    let file = File {
        schema: SCHEMA,
        version: VERSION,
        pipeline: &v.pipeline,
        result: v.result.to_string_lossy().into_owned(),
        status: v.status(),
        conclusion: super::terminal::conclusion(v),
        effects: &v.effects,
        recordings: &v.recordings,
        told: &v.told,
        recognises_copies: v.recognises_copies,
        points: &v.points,
        paths: &v.paths,
        iso9283: &v.iso9283,
        parameters: &v.parameters,
        published: &v.published,
        warnings: &v.warnings,
    };
    let json = serde_json::to_string_pretty(&file);
    json.expect("strings, numbers and lists under literal names always serialise") + "\n"
}

/// The files that `armcal verify` writes into a folder.
pub fn verification_paths(folder: &Path) -> [PathBuf; 3] {
    ["verification.html", "verification.json", "paths.parquet"].map(|name| folder.join(name))
}

/// Files of a verification, by name: `verification.html` to look at, `verification.json`, and `paths.parquet` with the moving
/// tip frame by frame.
pub fn verification_files(v: &Verification) -> Result<Vec<(&'static str, Vec<u8>)>, ReportError> {
    Ok(vec![
        ("verification.html", verification_html(v)?.into_bytes()),
        ("verification.json", verification_json(v).into_bytes()),
        ("paths.parquet", path_columns(&v.samples).encode("paths.parquet")?),
    ])
}

fn path_columns(samples: &[PathSample]) -> Columns {
    let mut c = Columns::default();
    c.text("recording", samples.iter().map(|s| Some(s.recording.as_str())));
    c.integer("motion", samples.iter().map(|s| s.motion as i64));
    c.integer("time_ns", samples.iter().map(|s| s.time_ns));
    c.vector("measured", "_m", samples.iter().map(|s| s.measured_m));
    c.vector("nominal", "_m", samples.iter().map(|s| s.nominal_m));
    c.vector("calibrated", "_m", samples.iter().map(|s| s.calibrated_m));
    c
}
