use crate::synthetic::{HOSTILE, synthetic};
use armcal_core::RollPitchYaw;
use armcal_model::Chain;
use armcal_report::{OutputConfig, write_all};
use polars::prelude::{DataFrame, ParquetReader, SerReader as _};
use std::path::Path;

fn parquet(path: &Path) -> DataFrame {
    ParquetReader::new(std::fs::File::open(path).unwrap()).finish().unwrap()
}

fn numbers(table: &DataFrame, column: &str) -> Vec<Option<f64>> {
    table.column(column).unwrap().f64().unwrap().iter().collect()
}

fn texts(table: &DataFrame, column: &str) -> Vec<Option<String>> {
    table.column(column).unwrap().str().unwrap().iter().map(|t| t.map(str::to_owned)).collect()
}

#[test]
fn parquet_tables_read_back_equal() {
    let s = synthetic();
    let out = s.folder.path().join("out");
    write_all(&s.run, &s.recordings, &out, &OutputConfig::default()).unwrap();

    let table = parquet(&out.join("observations.parquet"));
    let residuals = &s.run.calibration.residuals;
    assert_eq!(table.height(), residuals.len());
    let expected: Vec<Option<f64>> = residuals.iter().map(|r| Some(r.fitted_m.y * 1e3)).collect();
    assert_eq!(numbers(&table, "fitted_y_mm"), expected);
    let expected: Vec<Option<f64>> = residuals.iter().map(|r| Some(r.nominal_m.norm() * 1e3)).collect();
    assert_eq!(numbers(&table, "nominal_norm_mm"), expected);
    let expected: Vec<Option<f64>> = s.run.observations.iter().map(|o| Some(o.joint_rad[2])).collect();
    assert_eq!(numbers(&table, "joint3_rad"), expected);
    let expected: Vec<Option<String>> =
        s.run.observations.iter().map(|o| o.cavity().map(str::to_owned)).collect();
    assert_eq!(texts(&table, "cavity"), expected);
    let times: Vec<Option<i64>> = table.column("time_ns").unwrap().i64().unwrap().iter().collect();
    assert_eq!(times, s.run.observations.iter().map(|o| Some(o.time_ns)).collect::<Vec<_>>());

    let table = parquet(&out.join("dwells.parquet"));
    assert_eq!(table.height(), 18);
    assert_eq!(texts(&table, "recording")[17].as_deref(), Some(HOSTILE));
    assert_eq!(numbers(&table, "joint2_effort_nm")[..2], [Some(-2.5), None]);
    assert_eq!(numbers(&table, "joint2_arrival_sign")[0], Some(-1.0));
    assert_eq!(numbers(&table, "height_mm")[4], Some(31.0));
    assert_eq!(texts(&table, "place")[5].as_deref(), Some("free_space"));
    assert_eq!(numbers(&table, "distance_mm")[5], None);
    assert!(texts(&table, "why_not")[4].as_ref().unwrap().contains("hovers"));
    let used: Vec<bool> = table.column("used").unwrap().bool().unwrap().iter().flatten().collect();
    assert_eq!(used.iter().filter(|u| **u).count(), 13);

    let table = parquet(&out.join("parameters.parquet"));
    let values: Vec<Option<f64>> = s.run.calibration.fit.values().into_iter().map(Some).collect();
    assert_eq!(numbers(&table, "value"), values);
}

#[test]
fn the_parameter_file_is_toml_with_every_parameter_and_frame() {
    let s = synthetic();
    let out = s.folder.path().join("out");
    write_all(&s.run, &s.recordings, &out, &OutputConfig::default()).unwrap();
    let text = std::fs::read_to_string(out.join("parameters.toml")).unwrap();
    let file: toml::Table = text.parse().unwrap();
    let parameters = file["parameters"].as_array().unwrap();
    assert_eq!(parameters.len(), s.run.model.parameters().len());
    let estimate = &s.run.calibration.fit.estimates[5];
    assert_eq!(parameters[5]["value"].as_float(), Some(estimate.value));
    assert_eq!(parameters[5]["name"].as_str(), Some(estimate.parameter.name.as_str()));
    let frames = file["frames"].as_array().unwrap();
    let names: Vec<&str> = frames.iter().map(|f| f["frame"].as_str().unwrap()).collect();
    let hostile = format!("board.{HOSTILE}");
    assert_eq!(names, ["base", "tip", "board.normal", "board.roll", hostile.as_str()]);
    let board = s.run.model.board_in_world(&s.run.calibration.fit.values(), 1).unwrap();
    let RollPitchYaw { rpy_deg, .. } = (&board).into();
    assert_eq!(frames[3]["rpy_deg"][0].as_float(), Some(rpy_deg[0]));
    assert!((rpy_deg[0] - 0.2_f64.to_degrees()).abs() < 1e-9);
}

#[test]
fn the_calibrated_model_predicts_like_the_calibration() {
    let s = synthetic();
    let out = s.folder.path().join("out");
    write_all(&s.run, &s.recordings, &out, &OutputConfig::default()).unwrap();
    let path = out.join("calibrated.toml");
    let chain = Chain::from_dh_toml(&std::fs::read_to_string(&path).unwrap(), &path).unwrap();
    let p = s.run.calibration.fit.values();
    for (written, value) in chain.parameters().iter().zip(&p) {
        assert!((written.nominal - value).abs() < 1e-12, "{}", written.name);
    }
}
