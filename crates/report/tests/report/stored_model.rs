use crate::synthetic::synthetic;
use armcal_config::OutputConfig;
use armcal_model::{EffectTable, Model};
use armcal_report::write_all;
use armcal_result::{Run, open_model};
use std::path::Path;

/// What the model of a run predicts, in millimetres, at parameters that are off in every entry.
fn predictions_m(model: &Model, values: &[f64], run: &Run) -> Vec<nalgebra::Vector3<f64>> {
    run.observations.iter().map(|o| model.residual(values, o).position_m).collect()
}

fn agree(run: &Run, path: &Path) {
    let past = open_model(path).unwrap();
    let arms = past.arms().unwrap();
    assert_eq!(arms.values.len(), run.model.parameters().len());
    let kept: Vec<&str> = past.parameters.iter().map(|p| p.name.as_str()).collect();
    let own: Vec<&str> = run.model.parameters().iter().map(|p| p.name.as_str()).collect();
    assert_eq!(kept, own);
    let wanted = predictions_m(&run.model, &run.calibration.fit.values(), run);
    for (wanted, found) in wanted.iter().zip(predictions_m(&arms.model, &arms.values, run)) {
        assert!((wanted - found).norm() < 1e-12, "{wanted} {found}");
    }
    let nominal = &run.calibration.nominal_values[..arms.nominal_values.len()];
    let off = nominal.iter().zip(&arms.nominal_values).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(off < 1e-15);
}

/// Geometry, frames, effects of every sort, and what drives them come back from the folder, the recording, the file.
#[test]
fn the_calibrated_model_predicts_from_its_file_as_it_did() {
    let mut s = synthetic();
    let out = s.folder.path().join("out");
    write_all(&s.run, &s.recordings, &out, &OutputConfig::default()).unwrap();
    for path in [out.clone(), out.join("run.mcap"), out.join("model.json")] {
        agree(&s.run, &path);
    }

    let joints = s.run.model.chain().joint_names().to_vec();
    let formula: EffectTable = toml::from_str(
        "kind = 'expression'\nname = 'cable'\nformula = 'k * sin(q1) + 0.3 * k * tau2'\nacts_on = 'joint3'\n\
         parameters.k = { unit = 'deg', prior = 0.3 }\n",
    )
    .unwrap();
    let mut specs = vec![formula.spec(&joints).unwrap()];
    for spec in ["backlash:1", "compliance:2", "zero_slip:2@1", "zero_drift:3", "periodic:1,frequency=30"] {
        specs.push(s.run.model.effect(spec).unwrap());
    }
    let before = s.run.model.parameters().len();
    let model = s.run.model.with_effects(&specs, &s.run.session).unwrap();
    let estimate = s.run.calibration.fit.estimates[0].clone();
    for p in &model.parameters()[before..] {
        let value = 0.3 * p.prior_sigma.unwrap_or(1e-3);
        s.run.calibration.fit.estimates.push(armcal_calibrate::Estimate {
            parameter: p.clone(),
            value,
            ..estimate.clone()
        });
        s.run.calibration.nominal_values.push(0.0);
    }
    let count = model.parameters().len();
    s.run.calibration.fit.covariance = nalgebra::DMatrix::zeros(count, count).into();
    let rigid = predictions_m(&s.run.model, &s.run.calibration.fit.values(), &s.run);
    s.run.model = model;
    let with = predictions_m(&s.run.model, &s.run.calibration.fit.values(), &s.run);
    assert!(rigid.iter().zip(&with).any(|(a, b)| (a - b).norm() > 1e-5), "the effects do nothing");
    let again = s.folder.path().join("again");
    write_all(&s.run, &s.recordings, &again, &OutputConfig::default()).unwrap();
    agree(&s.run, &again);
}

/// Files written before the session was written as it is say the same.
#[test]
fn the_session_is_written_in_the_words_of_the_format() {
    let session = armcal_model::Session {
        start_ns: 1,
        end_ns: 2,
        recordings: 3,
        reference_temperature_c: None,
        gravity_in_world_mps2: nalgebra::Vector3::new(0.0, 0.0, -9.80665),
        gravity_in_base_mps2: Some(nalgebra::Vector3::new(1.0, 2.0, 3.0)),
        volume_centre_m: None,
        volume_half_extent_m: 0.3,
        board_centres_m: [(1, nalgebra::Vector3::new(0.1, 0.2, 0.3))].into(),
        largest_effort_nm: Some(vec![4.0, 5.0]),
        temperature: true,
        load: false,
        moving: false,
        moved: false,
        cavities: vec!["c1".into()],
    };
    let text = "{\"start_ns\":1,\"end_ns\":2,\"recordings\":3,\"reference_temperature_c\":null,\
                \"gravity_in_world_mps2\":[0.0,0.0,-9.80665],\"gravity_in_base_mps2\":[1.0,2.0,3.0],\
                \"volume_centre_m\":null,\"volume_half_extent_m\":0.3,\"board_centres_m\":{\"1\":[0.1,0.2,0.3]},\
                \"largest_effort_nm\":[4.0,5.0],\"temperature\":true,\"load\":false,\"moving\":false,\
                \"moved\":false,\"cavities\":[\"c1\"]}";
    assert_eq!(serde_json::to_string(&session).unwrap(), text);
    assert_eq!(serde_json::from_str::<armcal_model::Session>(text).unwrap(), session);
    // A joint without an effort is a gap there and back.
    let text = text.replace("[4.0,5.0]", "[null,5.0]");
    let gappy = serde_json::from_str::<armcal_model::Session>(&text).unwrap();
    assert!(gappy.largest_effort_nm.as_ref().unwrap()[0].is_nan());
    assert_eq!(serde_json::to_string(&gappy).unwrap(), text);
}

#[test]
fn a_file_that_is_not_a_model_is_refused_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let missing = open_model(folder.path()).unwrap_err().to_string();
    assert!(missing.contains("model.json") && missing.contains("run an older result again"), "{missing}");
    let path = folder.path().join("model.json");
    for text in ["", "{}", "{\"schema\": \"armcal.model/9\"}", "null"] {
        std::fs::write(&path, text).unwrap();
        assert!(open_model(&path).unwrap_err().to_string().contains("run the pipeline again"));
    }
}
