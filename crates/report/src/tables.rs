//! The Parquet tables: `dwells`, `observations`, `parameters`, one row each. Names carry units; a value that
//! does not exist is null. Columns of joints are numbered from 1 in the order of the model's joints.

use crate::ReportError;
use armcal_calibrate::Estimate;
use armcal_core::{Dwell, DwellId, Observation};
use armcal_result::{Point, RecordingRun, Run, role_word};
use armcal_table::{Assignment, Place};
use nalgebra::Vector3;
use polars::polars_utils::compression::ZstdLevel;
use polars::prelude::{
    Column, DataFrame, KeyValueMetadata, NamedFrom, ParquetCompression, ParquetWriter, PolarsError,
    PolarsResult, Series,
};
use std::collections::BTreeMap;

/// Names of the tables of a run.
pub(crate) const FILES: [&str; 3] = ["dwells.parquet", "observations.parquet", "parameters.parquet"];

/// File names and contents.
pub(crate) fn parquet_files(
    run: &Run,
    points: &[Point],
) -> Result<Vec<(&'static str, Vec<u8>)>, ReportError> {
    let tables = [dwell_columns(run), observation_columns(run, points), parameter_columns(run)];
    FILES.into_iter().zip(tables).map(|(name, columns)| Ok((name, columns.encode(name)?))).collect()
}

fn dwell_columns(run: &Run) -> Columns {
    let rows: Vec<(&RecordingRun, &Dwell)> =
        run.recordings.iter().flat_map(|r| r.dwells.iter().map(move |d| (r, d))).collect();
    let mut c = Columns::default();
    c.text("recording", rows.iter().map(|(r, _)| Some(r.name.as_str())));
    c.integer("recording_index", rows.iter().map(|(_, d)| d.id.recording as i64));
    c.integer("dwell", rows.iter().map(|(_, d)| d.id.dwell as i64));
    c.integer("start_ns", rows.iter().map(|(_, d)| d.start_ns));
    c.integer("end_ns", rows.iter().map(|(_, d)| d.end_ns));
    c.number("duration_s", rows.iter().map(|(_, d)| Some(d.duration_s())));
    c.integer("samples", rows.iter().map(|(_, d)| d.samples as i64));
    c.number("effective_samples", rows.iter().map(|(_, d)| Some(d.effective_samples)));
    for j in 0..run.model.joint_count() {
        let joint = format!("joint{}", j + 1);
        c.number(format!("{joint}_rad"), rows.iter().map(|(_, d)| d.joint_rad.get(j).copied()));
        c.number(format!("{joint}_spread_rad"), rows.iter().map(|(_, d)| d.joint_spread_rad.get(j).copied()));
        c.number(format!("{joint}_sigma_rad"), rows.iter().map(|(_, d)| d.joint_sigma_rad.get(j).copied()));
        let effort = |d: &Dwell| d.effort_nm.as_ref()?.get(j).copied().filter(|e| e.is_finite());
        c.number(format!("{joint}_effort_nm"), rows.iter().map(|(_, d)| effort(d)));
        c.number(
            format!("{joint}_arrival_sign"),
            rows.iter().map(|(_, d)| d.arrival.get(j).map(|a| a.sign())),
        );
    }
    c.number("temperature_c", rows.iter().map(|(_, d)| d.temperature_c));
    let tip = |d: &Dwell, f: fn(&Vector3<f64>) -> f64| d.tip.as_ref().map(|t| f(&t.position_m));
    c.number("tip_x_m", rows.iter().map(|(_, d)| tip(d, |p| p.x)));
    c.number("tip_y_m", rows.iter().map(|(_, d)| tip(d, |p| p.y)));
    c.number("tip_z_m", rows.iter().map(|(_, d)| tip(d, |p| p.z)));
    let assigned = run.assigned();
    let places: Vec<Option<&Assignment>> = rows.iter().map(|(_, d)| assigned.get(&d.id).copied()).collect();
    c.places(&places);
    let used = run.observed();
    c.flag("used", rows.iter().map(|(_, d)| used.contains(&d.id)));
    let why_not: BTreeMap<DwellId, &str> = run.recordings.iter().flat_map(RecordingRun::why_not).collect();
    c.text("why_not", rows.iter().map(|(_, d)| why_not.get(&d.id).copied()));
    c
}

fn observation_columns(run: &Run, points: &[Point]) -> Columns {
    let mut c = Columns::default();
    let observed = |f: fn(&Observation) -> Option<f64>| points.iter().map(move |p| f(p.observation));
    c.text("recording", points.iter().map(|p| Some(run.recording_name(p.observation.dwell))));
    c.integer("recording_index", points.iter().map(|p| p.observation.dwell.recording as i64));
    c.integer("dwell", points.iter().map(|p| p.observation.dwell.dwell as i64));
    c.integer("time_ns", points.iter().map(|p| p.observation.time_ns));
    c.text("cavity", points.iter().map(|p| p.observation.cavity()));
    c.text("feature", points.iter().map(|p| Some(run.model.feature_name(p.observation.feature))));
    let against = |p: &Point| p.observation.against().map(|against| run.model.against_name(against));
    c.text("against", points.iter().map(against));
    let assigned = run.assigned();
    let places: Vec<Option<&Assignment>> =
        points.iter().map(|p| assigned.get(&p.observation.dwell).copied()).collect();
    c.confidence(&places);
    for j in 0..run.model.joint_count() {
        let joint = format!("joint{}", j + 1);
        c.number(format!("{joint}_rad"), points.iter().map(|p| p.observation.joint_rad.get(j).copied()));
        let sign = |o: &Observation| o.arrival.get(j).map(|a| a.sign());
        c.number(format!("{joint}_arrival_sign"), points.iter().map(|p| sign(p.observation)));
    }
    c.number("load_kg", observed(|o| Some(o.load_kg)));
    for (feature, name) in run.model.features() {
        let load = |o: &Observation| o.more_loads.iter().find(|load| load.at == feature).map(|load| load.kg);
        if points.iter().any(|p| load(p.observation).is_some()) {
            let loads = points.iter().map(|p| Some(load(p.observation).unwrap_or(0.0)));
            c.number(format!("load_{name}_kg"), loads);
        }
    }
    c.number("temperature_c", observed(|o| o.temperature_c));
    c.vector("measured", "_m", points.iter().map(|p| p.measured_m));
    c.vector("predicted", "_m", points.iter().map(|p| p.predicted_m));
    c.flag("held_out", points.iter().map(|p| p.residual.held_out));
    c.vector("nominal", "_mm", points.iter().map(|p| p.residual.nominal_m * 1e3));
    c.number("nominal_norm_mm", points.iter().map(|p| Some(p.residual.nominal_m.norm() * 1e3)));
    c.vector("fitted", "_mm", points.iter().map(|p| p.residual.fitted_m * 1e3));
    c.number("fitted_norm_mm", points.iter().map(|p| Some(p.residual.fitted_m.norm() * 1e3)));
    c.vector("whitened", "", points.iter().map(|p| p.residual.whitened));
    c.number("weight", points.iter().map(|p| Some(p.residual.weight)));
    c.number("expected_norm_mm", points.iter().map(|p| Some(p.residual.expected_norm_m * 1e3)));
    c
}

fn parameter_columns(run: &Run) -> Columns {
    let rows = &run.calibration.fit.estimates;
    let number = |f: fn(&Estimate) -> f64| rows.iter().map(move |e| Some(f(e)));
    let mut c = Columns::default();
    c.text("name", rows.iter().map(|e| Some(e.parameter.name.as_str())));
    c.text("unit", rows.iter().map(|e| Some(e.parameter.unit.symbol())));
    c.number("nominal", number(|e| e.parameter.nominal));
    c.number("value", number(|e| e.value));
    c.number("sigma", number(|e| e.sigma));
    c.number("ci95_low", number(|e| e.ci95[0]));
    c.number("ci95_high", number(|e| e.ci95[1]));
    c.number("lower", number(|e| e.parameter.lower));
    c.number("upper", number(|e| e.parameter.upper));
    c.number("prior_sigma", rows.iter().map(|e| e.parameter.prior_sigma));
    c.flag("free", rows.iter().map(|e| e.parameter.free));
    c.flag("determined", rows.iter().map(|e| e.determined));
    c.flag("at_bound", rows.iter().map(|e| e.at_bound));
    c.text("role", rows.iter().map(|e| Some(role_word(e.parameter.role))));
    c.text("meaning", rows.iter().map(|e| Some(e.parameter.meaning.as_str())));
    c
}

/// A table under construction, column by column.
#[derive(Default)]
pub(crate) struct Columns {
    columns: Vec<Column>,
}

impl Columns {
    pub fn number(&mut self, name: impl Into<String>, values: impl Iterator<Item = Option<f64>>) {
        self.push(name, |name| Series::new(name, values.collect::<Vec<_>>()));
    }

    pub fn integer(&mut self, name: &str, values: impl Iterator<Item = i64>) {
        self.push(name, |name| Series::new(name, values.collect::<Vec<_>>()));
    }

    fn flag(&mut self, name: &str, values: impl Iterator<Item = bool>) {
        self.push(name, |name| Series::new(name, values.collect::<Vec<_>>()));
    }

    pub fn text<'a>(&mut self, name: &str, values: impl Iterator<Item = Option<&'a str>>) {
        self.push(name, |name| Series::new(name, values.collect::<Vec<_>>()));
    }

    /// Three columns: `<name>_x<unit>` and so on.
    pub fn vector(&mut self, name: &str, unit: &str, values: impl Iterator<Item = Vector3<f64>>) {
        let values: Vec<Vector3<f64>> = values.collect();
        for (axis, letter) in ["x", "y", "z"].into_iter().enumerate() {
            self.number(format!("{name}_{letter}{unit}"), values.iter().map(|v| Some(v[axis])));
        }
    }

    fn places(&mut self, places: &[Option<&Assignment>]) {
        self.text("place", places.iter().map(|a| a.map(|a| a.place.word())));
        self.text("cavity", places.iter().map(|a| a.and_then(cavity_name)));
        self.confidence(places);
        let height = |a: &Assignment| match a.place {
            Place::Hovering { height_m, .. } => Some(height_m * 1e3),
            _ => None,
        };
        self.number("height_mm", places.iter().map(|a| a.and_then(height)));
    }

    fn confidence(&mut self, places: &[Option<&Assignment>]) {
        let confidence = |a: &Assignment| match a.place {
            Place::Seated { confidence, .. } => Some(confidence).filter(|c| c.is_finite()),
            _ => None,
        };
        self.number("confidence", places.iter().map(|a| a.and_then(confidence)));
        let distance = |a: &Assignment| Some(a.distance_m * 1e3).filter(|d| d.is_finite());
        self.number("distance_mm", places.iter().map(|a| a.and_then(distance)));
    }

    fn push(&mut self, name: impl Into<String>, series: impl FnOnce(polars::prelude::PlSmallStr) -> Series) {
        self.columns.push(Column::from(series(name.into().into())));
    }

    pub fn encode(self, table: &'static str) -> Result<Vec<u8>, ReportError> {
        let failed = |e: PolarsError| ReportError::Parquet { table, source: Box::new(e) };
        encode_parquet(self.columns, schema_name(table)).map_err(failed)
    }
}

fn cavity_name(a: &Assignment) -> Option<&str> {
    match &a.place {
        Place::Seated { cavity, .. } => Some(cavity),
        Place::Hovering { above, .. } => Some(above),
        _ => None,
    }
}

/// What the footer says the table is; `run.mcap` and `pool` have words of their own for parameters and campaigns.
fn schema_name(table: &str) -> String {
    let kind = match table {
        "parameters.parquet" => "parameters-table",
        "campaign.parquet" => "campaign-table",
        other => other.trim_end_matches(".parquet"),
    };
    format!("armcal.{kind}/1")
}

fn encode_parquet(columns: Vec<Column>, mark: String) -> PolarsResult<Vec<u8>> {
    let mut bytes = Vec::new();
    let metadata = KeyValueMetadata::from_static(vec![("schema".into(), mark)]);
    ParquetWriter::new(&mut bytes)
        .with_key_value_metadata(Some(metadata))
        // Small tables of many columns: compressing takes megabytes for each that is encoded at a time, and more at higher levels.
        .set_parallel(false)
        .with_compression(ParquetCompression::Zstd(Some(ZstdLevel::try_new(1)?)))
        .finish(&mut DataFrame::new_infer_height(columns)?)?;
    Ok(bytes)
}
