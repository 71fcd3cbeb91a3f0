use crate::synthetic::synthetic;
use armcal_config::OutputConfig;
use armcal_core::{Observation, Reference};
use armcal_report::write_all;
use armcal_result::{BoardFacts, OBSERVATIONS_FILE, StoredObservations, observations_json, open_model};

#[test]
fn what_a_fit_saw_comes_back_to_the_last_bit() {
    let mut s = synthetic();
    // Thirds and infinities, which text does not hold by itself.
    for (i, o) in s.run.observations.iter_mut().enumerate() {
        o.joint_rad.iter_mut().for_each(|q| *q += 1.0 / (3.0 + i as f64));
        if let Reference::Tracked { orientation_sigma_rad, .. } = &mut o.reference {
            *orientation_sigma_rad = f64::INFINITY;
        }
    }
    assert!(s.run.observations.iter().any(|o| o.cavity().is_none()));
    let out = s.folder.path().join("out");
    write_all(&s.run, &s.recordings, &out, &OutputConfig::default()).unwrap();
    let past = StoredObservations::open(&out.join(OBSERVATIONS_FILE)).unwrap();

    let found: Vec<Observation> = past.recordings.iter().flat_map(|r| r.observations.clone()).collect();
    let mut wanted = s.run.observations.clone();
    wanted.sort_by_key(|o| o.dwell.recording);
    assert_eq!(found, wanted);
    assert_eq!(past.session, s.run.session);
    assert_eq!(past.board, s.run.board.as_ref().map(BoardFacts::of));
    let start = s.run.model.nominal();
    for (index, (then, now)) in past.recordings.iter().zip(&s.run.recordings).enumerate() {
        assert_eq!((&then.name, then.dwells), (&now.name, now.dwells.len()));
        let hashes: Vec<&str> = now.report.files.iter().map(|f| f.identity.as_str()).collect();
        assert_eq!(then.files.iter().map(|f| f.identity.as_str()).collect::<Vec<_>>(), hashes);
        assert_eq!(then.base.pose(), s.run.model.base_in_world(&start));
        assert_eq!(then.board.as_ref().map(|b| b.pose()), s.run.model.board_in_world(&start, index));
    }
    let text = std::fs::read_to_string(out.join(OBSERVATIONS_FILE)).unwrap();
    assert_eq!(text, observations_json(&s.run).unwrap());

    // As an earlier version wrote them: files by their SHA-256.
    let earlier = s.folder.path().join("earlier");
    std::fs::create_dir(&earlier).unwrap();
    for file in [OBSERVATIONS_FILE, "model.json"] {
        let text = std::fs::read_to_string(out.join(file)).unwrap();
        assert!(text.contains("\"identity\":") && !text.contains("\"sha256\":"), "{file}");
        std::fs::write(earlier.join(file), text.replace("\"identity\":", "\"sha256\":")).unwrap();
    }
    let before = StoredObservations::open(&earlier.join(OBSERVATIONS_FILE)).unwrap();
    let files =
        |past: &StoredObservations| past.recordings.iter().flat_map(|r| r.files.clone()).collect::<Vec<_>>();
    assert_eq!(files(&before), files(&past));
    let files = |folder: &std::path::Path| open_model(folder).unwrap().recordings[0].identity.clone();
    assert_eq!(files(&earlier), files(&out));
}

#[test]
fn observations_that_contradict_themselves_are_refused() {
    let s = synthetic();
    let path = s.folder.path().join(OBSERVATIONS_FILE);
    let whole: serde_json::Value = serde_json::from_str(&observations_json(&s.run).unwrap()).unwrap();
    let refused = |edit: &dyn Fn(&mut serde_json::Value)| {
        let mut value = whole.clone();
        edit(&mut value);
        std::fs::write(&path, value.to_string()).unwrap();
        StoredObservations::open(&path).unwrap_err().to_string()
    };
    let first = "/recordings/0/observations/0";
    let short = refused(&|v| v.pointer_mut(first).unwrap()["arrival"] = serde_json::json!([]));
    assert!(short.contains("arrival has 0 entries") && short.contains("run the pipeline again"), "{short}");
    let stray = refused(&|v| v.pointer_mut(first).unwrap()["dwell"]["recording"] = 7.into());
    assert!(stray.contains("stands under recording 0"), "{stray}");
    let other = refused(&|v| v["schema"] = "armcal.observations/2".into());
    assert!(other.contains("armcal.observations/2"), "{other}");
    let number = refused(&|v| v.pointer_mut(first).unwrap()["time_ns"] = "noon".into());
    assert!(number.contains("noon"), "{number}");
    assert!(StoredObservations::open(s.folder.path()).is_err());
}
