//! Is an assessment complete, does it find what was planted, and does it say what is missing and why?

use super::{close, mm, sampled, turned};
use crate::catalogue::CHARACTERISTICS;
use crate::{Assessment, Evidence, IsoError, PathTest, Settings, TipPose, Visit, assess};
use nalgebra::Vector3;

fn stop(
    pose: &str,
    time_s: f64,
    commanded: TipPose,
    attained: TipPose,
    approach: Option<Vector3<f64>>,
) -> Visit {
    Visit {
        pose: pose.into(),
        recording: 0,
        commanded,
        attained,
        time_ns: (time_s * 1e9) as i64,
        approach,
        departed_ns: None,
        arrival: Vec::new(),
    }
}

/// Thirty cycles through two poses, each from the three axes in turn, an hour apart each time: a gap lets the tip
/// lag behind its motion by 0.2 mm, and the arm warms up and grows by 0.01 mm an hour along x.
fn three_directions() -> Evidence {
    let mut visits = Vec::new();
    for hour in 0..30 {
        for (k, name) in ["P1", "P2"].iter().enumerate() {
            for axis in 0..3 {
                let commanded = mm(100.0 * k as f64, 0.0, 0.0);
                let approach = Vector3::ith(axis, 1.0);
                let lag_m = -approach * 0.2e-3 + Vector3::x() * 1e-5 * f64::from(hour);
                let attained = TipPose::at(commanded.position_m + lag_m);
                let time_s = 3600.0 * f64::from(hour) + 20.0 * axis as f64 + 5.0 * k as f64;
                visits.push(stop(name, time_s, commanded, attained, Some(approach * 7.0)));
            }
        }
    }
    Evidence { visits, ..Evidence::default() }
}

fn value(assessment: &Assessment, symbol: &str, at: &str) -> f64 {
    let found: Vec<f64> =
        assessment.criteria.iter().filter(|c| c.symbol == symbol && c.at == at).map(|c| c.value).collect();
    assert_eq!(found.len(), 1, "{symbol} at {at}: {found:?}");
    found[0]
}

fn reason<'a>(assessment: &'a Assessment, clause: &str, name: &str) -> &'a str {
    let found = assessment.not_measured.iter().find(|n| n.clause == clause && n.name == name);
    &found.unwrap_or_else(|| panic!("{clause} {name} was measured")).reason
}

#[test]
fn a_planted_lag_and_drift_are_found() {
    let assessment = assess(&three_directions(), &Settings::default()).unwrap();
    // Lags of 0.2 mm along perpendicular axes lie 0.2 sqrt(2) mm apart; the growth is common to all.
    close(value(&assessment, "vAP_P", "P1"), 0.2e-3 * 2.0_f64.sqrt(), 1e-12);
    // Mean growth over 30 hours 0.145 mm.
    close(value(&assessment, "AP_x", "P1 arriving along (+1.00, +0.00, +0.00)"), (0.145 - 0.2) * 1e-3, 1e-12);
    let along_y = "P2 arriving along (+0.00, +1.00, +0.00)";
    close(value(&assessment, "AP_P", along_y), (0.145_f64.powi(2) + 0.04).sqrt() * 1e-3, 1e-12);
    // Blocks of ten hours: mean growths 0.045, 0.145, 0.245 mm beside the lag of 0.2 mm.
    let ap = |growth: f64| (growth * growth + 0.04).sqrt() * 1e-3;
    close(value(&assessment, "dAP_P", along_y), ap(0.245) - ap(0.045), 1e-12);
    close(value(&assessment, "dRP_P", along_y), 0.0, 1e-12);
    // P1 to P2 from the same side: lag and growth cancel.
    close(value(&assessment, "AD_P", "P1 to P2"), 0.0, 1e-12);
    assert_eq!(assessment.notes[0], "2 commanded poses instead of 5");
    // Thirty cycles, 29 hours, perpendicular: as the standard asks.
    for criterion in assessment.criteria.iter().filter(|c| c.clause.starts_with("7.2")) {
        assert_eq!((criterion.n, criterion.notes.len()), (30, 0), "{criterion}");
    }
}

#[test]
fn every_criterion_is_computed_or_has_a_reason() {
    for evidence in [Evidence::default(), three_directions()] {
        let assessment = assess(&evidence, &Settings::default()).unwrap();
        for what in CHARACTERISTICS {
            for component in what.components {
                let (clause, name) = (what.clause, what.name_of(*component));
                let computed = assessment.criteria.iter().any(|c| c.clause == clause && c.name == name);
                let reasons: Vec<&str> = assessment
                    .not_measured
                    .iter()
                    .filter(|n| n.clause == clause && n.name == name)
                    .map(|n| n.reason.as_str())
                    .collect();
                assert_eq!(usize::from(computed) + reasons.len(), 1, "{clause} {name}: {reasons:?}");
                assert!(reasons.iter().all(|reason| reason.starts_with("needs ")), "{reasons:?}");
            }
        }
    }
}

#[test]
fn the_catalogue_has_the_fourteen_characteristics_of_the_standard() {
    // Scope of ISO 9283:1998 (also in GB/T 12642-2013 and JIS B 8432): accuracy and repeatability of a pose, a
    // distance and a path go by pairs, as do stroke and frequency of a weave; drift, cornering and velocity are one
    // characteristic each.
    let mut scope: Vec<&str> = CHARACTERISTICS
        .iter()
        .map(|what| match what.clause {
            "7.2.1" | "7.2.2" => "pose",
            "7.3.2" | "7.3.3" => "distance",
            "8.2" | "8.3" => "path",
            clause => clause,
        })
        .collect();
    scope.dedup();
    assert_eq!(scope.len(), 14, "{scope:?}");
    let mut names: Vec<(&str, &str)> =
        CHARACTERISTICS.iter().map(|what| (what.clause, what.symbol)).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), CHARACTERISTICS.len(), "a clause and symbol name one characteristic");
}

#[test]
fn what_is_missing_is_said_in_words() {
    let p = |x: f64| mm(x, 0.0, 0.0);
    let visits = vec![
        stop("cavity 1", 0.0, p(0.0), p(0.1), Some(Vector3::x())),
        stop("cavity 2", 10.0, p(50.0), p(50.2), None),
        stop("cavity 1", 20.0, p(0.0), p(-0.1), Some(-Vector3::x())),
    ];
    let assessment = assess(&Evidence { visits, ..Evidence::default() }, &Settings::default()).unwrap();
    let variation = reason(&assessment, "7.2.3", "multi-directional pose accuracy variation, position");
    assert_eq!(
        variation,
        "needs repeated approaches to a commanded pose from 3 directions; this recording has 2 (cavity 1), needs \
         repeated approaches to a commanded pose from 3 directions; this recording has 0 (cavity 2)"
    );
    assert!(reason(&assessment, "7.2.2", "pose repeatability, position").contains("it was visited once"));
    assert!(
        reason(&assessment, "7.2.1", "pose accuracy, about x")
            .starts_with("needs the orientation of the tip")
    );
    assert!(reason(&assessment, "7.4", "position stabilization time").starts_with("needs a limit band"));
    assert!(reason(&assessment, "7.7", "exchangeability").contains("robots of the same kind"));
    assert!(reason(&assessment, "8.2", "path accuracy, position").starts_with("needs a commanded path"));
    assert!(reason(&assessment, "10", "static compliance").starts_with("needs static loads"));
    assert!(
        reason(&assessment, "11", "weaving stroke error").starts_with("needs a commanded weaving motion")
    );
    let unknown = assessment.criteria.iter().find(|c| c.at == "cavity 2").unwrap();
    assert_eq!(
        unknown.to_string(),
        "7.2.1 pose accuracy, position AP_P at cavity 2: 0.2000 mm; n = 1 instead of 30; \
         direction of approach unknown"
    );
    // Of two places with one error the first; of several the worst.
    let worst = assessment.worst();
    let ap = worst.iter().find(|c| c.symbol == "AP_P").unwrap();
    assert_eq!(ap.at, "cavity 2");
    assert_eq!(worst.iter().filter(|c| c.symbol == "AP_P").count(), 1);
}

#[test]
fn oblique_directions_and_few_cycles_are_noted() {
    let down = |x: f64, y: f64| Some(Vector3::new(x, y, -1.0));
    let visits = (0..6).map(|i| {
        let approach = [down(0.0, 0.0), down(1.0, 0.0), down(0.0, 1.0)][i % 3];
        stop("P1", i as f64, mm(0.0, 0.0, 0.0), mm((i % 3) as f64, 0.0, 0.0), approach)
    });
    let evidence = Evidence { visits: visits.collect(), ..Evidence::default() };
    let assessment = assess(&evidence, &Settings::default()).unwrap();
    let variation = assessment.criteria.iter().find(|c| c.symbol == "vAP_P").unwrap();
    close(variation.value, 2e-3, 1e-15);
    assert_eq!(variation.notes, ["n = 2 instead of 30", "directions are 45 to 60 deg apart instead of 90"]);
}

#[test]
fn of_many_directions_the_perpendicular_ones_are_compared() {
    // Errors of 1 mm along each of x, y, z; one oblique direction is 50 mm off, and so is one that was taken only once.
    let directions = [
        (Vector3::new(1.0, 1.0, 0.5), mm(50.0, 0.0, 0.0)),
        (Vector3::x(), mm(1.0, 0.0, 0.0)),
        (Vector3::y(), mm(0.0, 1.0, 0.0)),
        (Vector3::z(), mm(0.0, 0.0, 1.0)),
        (-Vector3::z(), mm(0.0, 0.0, -50.0)),
    ];
    let visits = (0..9).map(|i| {
        let (approach, attained) = directions[if i < 8 { i % 4 } else { 4 }];
        stop("P1", i as f64, mm(0.0, 0.0, 0.0), attained, Some(approach))
    });
    let evidence = Evidence { visits: visits.collect(), ..Evidence::default() };
    let assessment = assess(&evidence, &Settings::default()).unwrap();
    close(value(&assessment, "vAP_P", "P1"), 2.0_f64.sqrt() * 1e-3, 1e-15);
}

#[test]
fn there_is_no_move_between_two_recordings() {
    let mut visits = vec![
        stop("P1", 0.0, mm(0.0, 0.0, 0.0), mm(0.0, 0.0, 0.0), None),
        stop("P2", 1.0, mm(50.0, 0.0, 0.0), mm(50.0, 0.0, 0.0), None),
        stop("P3", 2.0, mm(90.0, 0.0, 0.0), mm(90.0, 0.0, 0.0), None),
    ];
    visits[2].recording = 1;
    let assessment = assess(&Evidence { visits, ..Evidence::default() }, &Settings::default()).unwrap();
    let moves: Vec<&str> =
        assessment.criteria.iter().filter(|c| c.symbol == "AD_P").map(|c| c.at.as_str()).collect();
    assert_eq!(moves, ["P1 to P2"]);
}

#[test]
fn speed_is_that_of_the_middle_half() {
    // 400 mm: the first and last 80 mm at 0.1 m/s, the rest at 0.3 m/s, asked for 0.3 m/s.
    let x_mm = |t: f64| match t {
        t if t < 0.8 => 100.0 * t,
        t if t < 1.6 => 80.0 + 300.0 * (t - 0.8),
        _ => 320.0 + 100.0 * (t - 1.6),
    };
    let path = PathTest {
        name: "line".into(),
        commanded: vec![mm(0.0, 0.0, 0.0), mm(400.0, 0.0, 0.0)],
        runs: vec![sampled(0.01, 2.4, |t| mm(x_mm(t), 0.0, 0.0))],
        speed_m_s: Some(0.3),
    };
    let assessment =
        assess(&Evidence { paths: vec![path], ..Evidence::default() }, &Settings::default()).unwrap();
    close(value(&assessment, "AV", "line"), 0.0, 1e-6);
    close(value(&assessment, "FV", "line"), 0.0, 1e-6);
    assert!(reason(&assessment, "8.6", "path velocity repeatability").contains("at least 2 cycles"));
}

#[test]
fn a_settling_arm_is_timed_from_its_departure() {
    // Twice from P2 to P1 in 2 s, the last stretch at 20 mm/s into a band of 1 mm: settled 0.05 s before the stop.
    let mut visits = Vec::new();
    for cycle in 0..2 {
        let start_s = 10.0 * f64::from(cycle);
        visits.push(stop("P2", start_s, mm(50.0, 0.0, 0.0), mm(50.0, 0.0, 0.0), None));
        let mut arrival = sampled(0.01, 3.0, |t| mm((20.0 * (2.0 - t)).max(0.0), 0.0, 0.0));
        arrival.iter_mut().for_each(|s| s.time_ns += (start_s * 1e9) as i64 + 1_000_000_000);
        let rest = stop("P1", start_s + 5.0, mm(0.0, 0.0, 0.0), mm(0.0, 0.0, 0.0), None);
        visits.push(Visit { departed_ns: Some((start_s * 1e9) as i64 + 1_000_000_000), arrival, ..rest });
    }
    let settings = Settings { limit_band_m: Some(1e-3), ..Settings::default() };
    let assessment = assess(&Evidence { visits, ..Evidence::default() }, &settings).unwrap();
    let time = |clause: &str| assessment.criteria.iter().find(|c| c.clause == clause).unwrap();
    close(time("9").value, 1.95, 1e-8);
    assert_eq!(time("9").at, "P2 to P1");
    close(time("7.4").value, 0.0, 1e-12);
    assert_eq!(
        time("7.5").notes,
        ["n = 2 instead of 3", "direction of approach unknown", "limit band 1.000 mm"]
    );
}

#[test]
fn paths_give_accuracy_corners_speed_and_reorientation() {
    let half_turn = |t: f64| [0.4 * (std::f64::consts::PI * t).sin(), 0.0, 0.0];
    let commanded: Vec<TipPose> = (0..=50)
        .map(|i| f64::from(i) / 50.0)
        .map(|t| turned(mm(300.0 * t, 0.0, 0.0), half_turn(t)))
        .collect();
    let run = |speed: f64| {
        sampled(4e-3, 1.4 / speed, |t| {
            let at = speed * t - 0.2;
            turned(mm(300.0 * at, 0.7, 0.0), half_turn(at))
        })
    };
    let turning = PathTest {
        name: "turning line".into(),
        commanded,
        runs: (0..10).map(|_| run(1.02)).collect(),
        speed_m_s: Some(0.3),
    };
    let corner = PathTest {
        name: "L".into(),
        commanded: vec![mm(0.0, 0.0, 0.0), mm(100.0, 0.0, 0.0), mm(100.0, 100.0, 0.0)],
        runs: vec![sampled(0.01, 2.0, |t| mm((100.0 * t).min(98.0), (100.0 * t - 98.0).max(0.0), 0.0))],
        speed_m_s: None,
    };
    let evidence = Evidence { paths: vec![turning, corner], ..Evidence::default() };
    let assessment = assess(&evidence, &Settings::default()).unwrap();
    let find = |clause: &str, at: &str| {
        assessment
            .criteria
            .iter()
            .find(|c| c.clause == clause && c.at == at)
            .unwrap_or_else(|| panic!("{clause}"))
    };
    for clause in ["8.2", "8.4"] {
        close(find(clause, "turning line").value, 0.7e-3, 1e-12);
    }
    assert!(find("8.2", "turning line").notes.is_empty());
    close(find("8.3", "turning line").value, 0.0, 1e-12);
    close(value(&assessment, "AV", "turning line"), 0.02, 1e-6);
    close(value(&assessment, "RV", "turning line"), 0.0, 1e-6);
    close(value(&assessment, "FV", "turning line"), 0.0, 1e-4);
    // Leaves the corner out by 2 mm along the first leg.
    close(value(&assessment, "CR", "L corner 1"), 2e-3, 1e-12);
    close(value(&assessment, "CO", "L corner 1"), 0.0, 1e-12);
    let missed = &find("8.2", "L").notes;
    assert!(missed.iter().any(|note| note.ends_with("of 100 planes not crossed by every run")), "{missed:?}");
}

#[test]
fn json_has_si_values_and_their_units() {
    let visits = vec![stop("P1", 0.0, mm(0.0, 0.0, 0.0), mm(3.0, 4.0, 0.0), None)];
    let assessment = assess(&Evidence { visits, ..Evidence::default() }, &Settings::default()).unwrap();
    let json = serde_json::to_value(&assessment).unwrap();
    let first = &json["criteria"][0];
    assert_eq!((first["symbol"].as_str(), first["unit"].as_str()), (Some("AP_P"), Some("m")));
    close(first["value"].as_f64().unwrap(), 5e-3, 1e-15);
    assert_eq!(first["notes"][0], "n = 1 instead of 30");
    assert_eq!(json["not_measured"][0]["symbol"], "AP_a");
}

#[test]
fn wrong_evidence_is_refused_by_name() {
    let visit = |pose: TipPose| stop("P1", 0.0, pose, pose, None);
    let refused =
        |visits| assess(&Evidence { visits, ..Evidence::default() }, &Settings::default()).unwrap_err();
    let two_commands = refused(vec![visit(mm(0.0, 0.0, 0.0)), visit(mm(0.0, 3.0, 0.0))]);
    assert!(matches!(two_commands, IsoError::CommandMoved { visit: 1, .. }), "{two_commands}");
    assert!(two_commands.to_string().starts_with("visit 1 to 'P1' was commanded 3.000 mm"), "{two_commands}");
    assert!(matches!(refused(vec![visit(mm(f64::NAN, 0.0, 0.0))]), IsoError::NotFinite { index: 0, .. }));
    let path = PathTest {
        name: "stub".into(),
        commanded: vec![mm(0.0, 0.0, 0.0)],
        runs: Vec::new(),
        speed_m_s: None,
    };
    let stub = Evidence { paths: vec![path], ..Evidence::default() };
    assert_eq!(assess(&stub, &Settings::default()), Err(IsoError::NoLength));
}
