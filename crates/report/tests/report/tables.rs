use crate::synthetic::{HOSTILE, Synthetic, synthetic};
use armcal_config::OutputConfig;
use armcal_core::{Pose, RollPitchYaw};
use armcal_model::{Chain, Frame, Frames, Model};
use armcal_report::{summary_json, write_all};
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

const URDF: &str = r#"<?xml version="1.0"?>
<robot name="arm"> <!-- kept -->
  <link name="base_link"/> <link name="l1"/> <link name="l2"/> <link name="l3"/>
  <joint name="a" type="revolute"><origin xyz="0 0 0.076" rpy="0 0 0"/><axis xyz="0 0 1"/>
    <parent link="base_link"/><child link="l1"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
  <joint name="b" type="revolute"><origin xyz="0 0 0" rpy="1.57 0 0"/><axis xyz="0 0 1"/>
    <parent link="l1"/><child link="l2"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
  <joint name="c" type="revolute"><origin xyz="0.4 0 0" rpy="0 0 0"/><axis xyz="0 0 1"/>
    <parent link="l2"/><child link="l3"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
</robot>
"#;

/// The synthetic run with its arm given as a URDF, every free parameter a little off.
fn with_urdf(tip: Frame) -> Synthetic {
    let mut s = synthetic();
    let chain = Chain::from_urdf(URDF, "base_link", "l3", Path::new("arm.urdf")).unwrap();
    let boards = (0..3).map(|i| Frame::given(format!("board.{i}"), Pose::identity())).collect();
    let model = Model::new(
        chain,
        Frames { base: Frame::given("base", Pose::identity()), tip, markers: Vec::new(), boards },
    )
    .unwrap();
    let template = s.run.calibration.fit.estimates[0].clone();
    let estimates = model.parameters().iter().enumerate().map(|(i, parameter)| {
        let slip = if parameter.free { 1e-3 * (1.0 + i as f64) } else { 0.0 };
        let (parameter, value) = (parameter.clone(), parameter.nominal + slip);
        armcal_calibrate::Estimate { parameter, value, ..template.clone() }
    });
    s.run.calibration.fit.estimates = estimates.collect();
    s.run.calibration.nominal_values = model.nominal();
    s.run.model_texts = vec![URDF.into()];
    s.run.model = model;
    s
}

#[test]
fn a_calibrated_urdf_predicts_like_the_calibration() {
    let s = with_urdf(Frame::given("tip", Pose::identity()));
    let out = s.folder.path().join("out");
    let written = write_all(&s.run, &s.recordings, &out, &OutputConfig::default()).unwrap();
    let path = out.join("calibrated.urdf");
    assert!(written.contains(&path) && !out.join("calibrated.toml").exists());
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(text.contains("<!-- kept -->") && text != URDF);
    let chain = Chain::from_urdf(&text, "base_link", "l3", &path).unwrap();
    let calibrated = Model::new(chain, Frames::of_bare_arm()).unwrap();
    let q = [0.3, -0.7, 1.1];
    let expected = s.run.model.tip_in_base(&s.run.calibration.fit.values(), &q).to_homogeneous();
    let nominal = s.run.model.tip_in_base(&s.run.model.nominal(), &q).to_homogeneous();
    let predicted = calibrated.tip_in_base(&calibrated.nominal(), &q).to_homogeneous();
    assert!((predicted - expected).norm() < 1e-9, "{predicted} {expected}");
    assert!((nominal - expected).norm() > 1e-3);
}

#[test]
fn what_the_urdf_cannot_hold_is_said() {
    let s = with_urdf(Frame::estimated("tip", Pose::identity()));
    let summary: serde_json::Value = serde_json::from_str(&summary_json(&s.run).unwrap()).unwrap();
    let codes: Vec<&str> =
        summary["warnings"].as_array().unwrap().iter().map(|w| w["code"].as_str().unwrap()).collect();
    assert_eq!(codes.iter().filter(|c| **c == "tip-not-in-urdf").count(), 1);
}
