//! `report.html` read as text: what it embeds, and what a name from outside can do to it.

use crate::synthetic::{HOSTILE, synthetic};
use armcal_core::DwellId;
use armcal_report::{live_page, report_html, summary_json};
use armcal_result::Refit;
use armcal_result::sensitivity::Basis;
use serde_json::Value;

const DATA: &str = "<script type=\"application/json\" id=\"data\">";

/// The document in a page.
fn document(page: &str) -> Value {
    let from = page.find(DATA).expect("the document's element") + DATA.len();
    let to = from + page[from..].find("</script>").expect("its end");
    serde_json::from_str(&page[from..to]).expect("JSON")
}

#[test]
fn the_page_shows_the_numbers_of_the_summary() {
    let run = synthetic().run;
    let page = report_html(&run, &Basis::of(&run)).unwrap();
    let (document, summary) =
        (document(&page), serde_json::from_str::<Value>(&summary_json(&run).unwrap()).unwrap());
    for side in ["train", "holdout"] {
        for model in ["nominal_mm", "fitted_mm"] {
            for statistic in ["mean", "rms", "p95", "max"] {
                let shown = &document["refits"][0][side][model][statistic];
                assert_eq!(shown, &summary["fit"][side][model][statistic], "{side} {model} {statistic}");
            }
        }
    }
    let n = run.observations.len();
    assert!(n > 0 && document["dwells"]["dwell"].as_array().unwrap().len() == n);
    // Errors on the page are those of the calibration, to the digits kept.
    let errors = document["refits"][0]["error_mm"].as_array().unwrap();
    for (shown, r) in errors.iter().zip(&run.calibration.residuals) {
        let (shown, mm) = (shown.as_f64().unwrap(), r.fitted_m.norm() * 1e3);
        assert!((shown - mm).abs() < 1e-3 * mm.max(0.1), "{shown} {mm}");
    }
    // Every joint and the lengths have an implied error for each dwell.
    let implied = document["refits"][0]["implied"].as_array().unwrap();
    assert_eq!(implied.len(), run.model.joint_count() + 1);
    assert!(implied.iter().all(|c| c.as_array().unwrap().len() == n));
}

/// A joint that is off by the same small angle everywhere is seen as that angle on the page.
#[test]
fn a_joint_that_is_off_is_seen_off_by_as_much() {
    let mut run = synthetic().run;
    let p = run.calibration.fit.values();
    let offset_rad = 3e-3;
    for (o, r) in run.observations.iter().zip(&mut run.calibration.residuals) {
        let mut turned = o.clone();
        turned.joint_rad[1] += offset_rad;
        // Where the tip is when the link is further than the encoder says.
        r.fitted_m = run.model.predicted_tip_in_world(&p, &turned) - run.model.predicted_tip_in_world(&p, o);
    }
    let page = document(&report_html(&run, &Basis::of(&run)).unwrap());
    assert_eq!(page["channels"][1]["unit"], "deg");
    let implied = page["refits"][0]["implied"][1].as_array().unwrap();
    assert!(!implied.is_empty());
    for shown in implied {
        let shown = shown.as_f64().unwrap();
        assert!((shown - offset_rad.to_degrees()).abs() < 2e-3 * offset_rad.to_degrees(), "{shown}");
    }
}

#[test]
fn no_name_becomes_markup() {
    let mut run = synthetic().run;
    run.pipeline_name = HOSTILE.into();
    let page = report_html(&run, &Basis::of(&run)).unwrap();
    // Three scripts: the document, the charting library, the page's own.
    assert_eq!(page.matches("<script").count(), 3 + page.matches("\"<script").count());
    assert!(!page.contains("</script>\n/../"), "the name ended an element");
    let names: Vec<&str> =
        run.recordings.iter().map(|r| r.name.as_str()).filter(|name| name.contains("</script>")).collect();
    assert!(!names.is_empty(), "no hostile recording among the fixtures");
    let shown = document(&page)["recordings"].clone();
    assert!(names.iter().all(|name| shown.as_array().unwrap().iter().any(|s| s == name)));
}

#[test]
fn a_page_from_disk_may_talk_to_nobody() {
    let run = synthetic().run;
    let page = report_html(&run, &Basis::of(&run)).unwrap();
    let policy = |page: &str| {
        let from = page.find("Content-Security-Policy").unwrap();
        page[from..from + 400].to_owned()
    };
    let (file, live) = (policy(&page), policy(&live_page(&page).unwrap()));
    assert!(file.contains("default-src ") && file.contains("connect-src &#39;none&#39;"), "{file}");
    assert!(live.contains("connect-src &#39;self&#39;"), "{live}");
    assert_eq!(live_page("<h1>of another program</h1>"), None);
}

/// A long session with every refit that a run embeds; left where a browser can be pointed at it.
#[test]
fn two_thousand_dwells_stay_under_five_megabytes() {
    let mut run = synthetic().run;
    let (seen, residuals) = (run.observations.clone(), run.calibration.residuals.clone());
    run.observations.clear();
    run.calibration.residuals.clear();
    for k in 0..2000 {
        let (mut o, mut r) = (seen[k % seen.len()].clone(), residuals[k % seen.len()].clone());
        let wave = (k as f64).sin();
        o.dwell = DwellId { recording: o.dwell.recording, dwell: k };
        o.time_ns += k as i64 * 5_000_000_000;
        o.joint_rad.iter_mut().for_each(|q| *q += 0.2 * wave);
        r.dwell = o.dwell;
        r.fitted_m *= 1.0 + 0.3 * wave;
        run.observations.push(o);
        run.calibration.residuals.push(r);
    }
    let refit = |k: usize| {
        let (mut calibration, model) = (run.calibration.clone(), run.model.clone());
        calibration.residuals.iter_mut().for_each(|r| r.fitted_m *= 1.0 - 0.07 * k as f64);
        Refit { effects: vec![format!("refit {k}")], model, calibration }
    };
    run.alternatives = (1..=10).map(refit).collect();
    let page = report_html(&run, &Basis::of(&run)).unwrap();
    assert!(page.len() < 5_000_000, "{} bytes", page.len());
    std::fs::write(std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("report-2000.html"), page).unwrap();
}
