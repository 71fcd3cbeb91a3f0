use crate::synthetic::synthetic;
use armcal_config::{InputMessages, OutputConfig};
use armcal_report::{ReportError, write_all};
use std::path::Path;

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

#[test]
fn a_folder_that_cannot_be_made_is_named() {
    let s = synthetic();
    let file = s.folder.path().join("a file");
    std::fs::write(&file, "x").unwrap();
    let before = names(s.folder.path());
    let out = file.join("out");
    let error = write_all(&s.run, &s.recordings, &out, &OutputConfig::default()).unwrap_err();
    assert!(matches!(&error, ReportError::Folder(why) if why.to_string().contains(&*out.to_string_lossy())));
    assert!(error.to_string().contains("a file/out"), "{error}");
    assert_eq!(names(s.folder.path()), before);
}

#[test]
fn one_file_that_cannot_be_written_leaves_no_other() {
    let s = synthetic();
    for blocked in ["summary.json", "parameters.parquet", "run.mcap"] {
        let out = s.folder.path().join(format!("out without {blocked}"));
        std::fs::create_dir_all(out.join(blocked)).unwrap();
        let error = write_all(&s.run, &s.recordings, &out, &OutputConfig::default()).unwrap_err();
        assert!(error.to_string().contains(blocked), "{error}");
        assert_eq!(names(&out), [blocked]);
    }
}

#[test]
fn a_run_that_contradicts_itself_is_refused() {
    let s = synthetic();
    let refused = |change: &dyn Fn(&mut armcal_result::Run)| {
        let mut run = s.run.clone();
        change(&mut run);
        let out = s.folder.path().join("never");
        let error = write_all(&run, &s.recordings, &out, &OutputConfig::default()).unwrap_err();
        assert!(!out.exists());
        error.to_string()
    };
    assert!(refused(&|r| r.calibration.residuals.truncate(3)).contains("13 observations, 3 residuals"));
    assert!(refused(&|r| r.calibration.residuals.swap(0, 1)).contains("recording 0 dwell 1"));
    assert!(refused(&|r| r.calibration.nominal_values.truncate(2)).contains("2 nominal values"));
    assert!(refused(&|r| r.observations[2].joint_rad.truncate(1)).contains("dwell 2"));
}

#[test]
fn inputs_are_not_needed_to_be_referenced() {
    let s = synthetic();
    let config = OutputConfig { input: InputMessages::Reference };
    let out = s.folder.path().join("out");
    assert_eq!(write_all(&s.run, &[], &out, &config).unwrap().len(), 12);
    assert!(write_all(&s.run, &[], &out, &OutputConfig::default()).is_err());
}

#[test]
fn numbers_that_are_not_finite_do_not_stop_the_writing() {
    let mut s = synthetic();
    s.run.calibration.residuals[1].fitted_m.x = f64::NAN;
    s.run.calibration.residuals[2].nominal_m.z = f64::INFINITY;
    s.run.calibration.noise_floor_m = f64::NAN;
    s.run.recordings[0].dwells[1].joint_rad.clear();
    s.run.recordings[1].dwells.clear();
    s.run.recordings[1].association = None;
    let out = s.folder.path().join("out");
    write_all(&s.run, &s.recordings, &out, &OutputConfig::default()).unwrap();
    let summary = std::fs::read_to_string(out.join("summary.json")).unwrap();
    assert!(serde_json::from_str::<serde_json::Value>(&summary).is_ok());
}

#[test]
fn the_output_section_is_checked() {
    assert_eq!(toml::from_str::<OutputConfig>("").unwrap().input, InputMessages::Copy);
    assert_eq!(
        toml::from_str::<OutputConfig>("input = \"reference\"").unwrap().input,
        InputMessages::Reference
    );
    assert!(toml::from_str::<OutputConfig>("inputs = \"copy\"").is_err());
    assert!(toml::from_str::<OutputConfig>("input = \"move\"").unwrap_err().to_string().contains("copy"));
}
