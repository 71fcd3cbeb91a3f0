//! A verification for programs.

use super::page::verification_html;
use crate::ReportError;
use crate::tables::Columns;
use armcal_result::{PathSample, VERSION, Verification};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Version of the contract of `verification.json`.
const SCHEMA: &str = "armcal.verification/1";

/// `verification.json`: every row of every table in SI, indented, with a final newline. `before` is the nominal arm,
/// `after` the calibrated one.
pub fn verification_json(v: &Verification) -> String {
    let file = json!({
        "schema": SCHEMA,
        "version": VERSION,
        "pipeline": v.pipeline,
        "result": v.result.to_string_lossy(),
        "status": v.status(),
        "conclusion": super::terminal::verification_conclusion(v),
        "effects": v.effects,
        "recordings": v.recordings,
        "told": v.told,
        "recognises_copies": v.recognises_copies,
        "points": v.points,
        "paths": v.paths,
        "iso9283": v.iso9283,
        "parameters": v.parameters,
        "published": v.published,
        "warnings": v.warnings,
    });
    format!("{file:#}\n")
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
