use armcal_calibrate::{FitConfig, HoldoutConfig, calibrate};
use armcal_diagnose::{Calibrated, Diagnosis, DiagnosisConfig, Verdict, diagnose};
use armcal_lab::config::{RecordingConfig, StopConfig, TourConfig};
use armcal_lab::scenario::{Design, Scenario, Size};
use armcal_lab::{LabConfig, observe};
use armcal_model::Session;
use armcal_plan::{Allowed, Known, Place, Proposal, Tracking, propose, rivals_from_diagnosis};
use armcal_score::nominal_model;
use armcal_table::Board;
use nalgebra::Matrix3;
use std::path::Path;

const BOARD: &str = include_str!("../pipelines/boards/paper.toml");

/// What a rig's recordings say, and what to record next.
struct Said {
    diagnosis: Diagnosis,
    proposal: Proposal,
}

fn ask(config: &LabConfig, allowed: &Allowed) -> Said {
    let observed = observe(config).expect("observing");
    let model = nominal_model(&observed.nominal).expect("nominal model");
    let (observations, fit) = (&observed.observations, FitConfig::default());
    let session = Session::of(observations);
    let calibration = calibrate(&model, observations, &fit, &HoldoutConfig::default()).expect("calibrating");
    let diagnosed = DiagnosisConfig::default();
    let holdout = HoldoutConfig::default();
    let calibrated = Calibrated {
        model: &model,
        calibration: &calibration,
        observations,
        session: &session,
        fit: &fit,
        holdout: &holdout,
    };
    let diagnosis = diagnose(&calibrated, &diagnosed).expect("diagnosing");
    let board = Board::from_toml(BOARD, Path::new("paper.toml")).expect("board");
    let known = Known {
        model: &model,
        values: calibration.fit.values(),
        observations,
        session: &session,
        fit: &fit,
        board: Some(&board),
        tracked: Some(Tracking { covariance_m2: Matrix3::identity() * 1e-8, orientation_sigma_rad: None }),
        recordings: config.recordings.iter().map(|r| r.name.clone()).collect(),
    };
    let open = rivals_from_diagnosis(&diagnosis, model.chain().joint_names()).expect("what stands");
    let proposal = propose(&known, &open, allowed, &diagnosed).expect("planning");
    Said { diagnosis, proposal }
}

/// The same rig, and after what it recorded the proposed dwells: one recording for each load.
fn record(config: &LabConfig, proposal: &Proposal) -> LabConfig {
    let mut more = config.clone();
    let mut loads: Vec<f64> = proposal.dwells.iter().map(|d| d.load_kg).collect();
    loads.sort_by(f64::total_cmp);
    loads.dedup();
    for load_kg in loads {
        let name = format!("round{}-{load_kg}", config.task.tours.len());
        let stops = proposal.dwells.iter().filter(|d| d.load_kg == load_kg).map(|dwell| match &dwell.place {
            Place::Cavity { cavity, slide_from_deg, .. } => {
                StopConfig::Cavity { name: cavity.clone(), slide_from_deg: *slide_from_deg }
            }
            _ => StopConfig::Pose {
                joint_deg: dwell.joint_deg.clone(),
                from_deg: dwell
                    .joint_deg
                    .iter()
                    .zip(&dwell.arrival)
                    .map(|(q, side)| q - 5.0 * side.sign())
                    .collect(),
            },
        });
        more.task.tours.push(TourConfig { recording: name.clone(), stops: stops.collect() });
        more.recordings.push(RecordingConfig { name, roll_deg: 0.0, pitch_deg: 0.0, load_kg });
    }
    more
}

/// Hides a family in the paper's rig, which visits the flat board once, and twice records what is proposed.
fn told(family: &str, target: usize, seed: u64) -> [Said; 3] {
    let scenario = Scenario {
        target: Some(target),
        size: Size::Medium,
        ..Scenario::new(family, Design::OneTiltOnePass, seed)
    };
    let config = scenario.plant().expect("planting").config;
    let allowed = Allowed { dwells: 8, loads_kg: vec![0.5], margin_deg: 30.0, ranges_deg: Vec::new() };
    let alone = ask(&config, &allowed);
    let once = record(&config, &alone.proposal);
    let after = ask(&once, &allowed);
    let twice = record(&once, &after.proposal);
    let rounds = [alone, after, ask(&twice, &allowed)];
    for (round, said) in rounds.iter().enumerate() {
        println!("{family} {seed} round {round}: {:?} {:?}", said.diagnosis.verdict, said.diagnosis.names);
        println!("  next: {} dwells, {}", said.proposal.dwells.len(), said.proposal.sentence);
    }
    rounds
}

/// Asserts the story for one hidden effect: unseen and said to be so, then in the answer, then not lost again.
fn becomes_known(family: &str, target: usize, seed: u64) -> [Said; 3] {
    let truth = format!("{family}:{target}");
    let rounds = told(family, target, seed);
    let [alone, after, again] = &rounds;
    assert_eq!(alone.diagnosis.verdict, Verdict::NothingMissing, "claimed {:?}", alone.diagnosis.names);
    assert!(
        alone.diagnosis.not_testable.iter().any(|n| n.effect == truth),
        "{truth} is not said to be invisible"
    );
    let dwells = &alone.proposal.dwells;
    assert!(!dwells.is_empty() && dwells.len() <= 8);
    assert!(dwells.iter().any(|d| d.load_kg > 0.0 || d.place == Place::Free));
    assert!(dwells.windows(2).all(|d| d[1].delta >= d[0].delta - 1e-6), "a dwell more told less");
    for said in [after, again] {
        assert!(said.diagnosis.names.contains(&truth), "{truth} is not among {:?}", said.diagnosis.names);
    }
    assert!(again.diagnosis.names.len() <= after.diagnosis.names.len());
    rounds
}

#[test]
fn few_dwells_show_a_spring_that_the_board_alone_hides() {
    becomes_known("compliance", 2, 1);
}

#[test]
fn few_dwells_show_a_belt_that_the_board_alone_hides() {
    let [_, after, again] = becomes_known("belt_coupling", 3, 1);
    for said in [&after, &again] {
        assert_eq!(said.diagnosis.names.first().map(String::as_str), Some("belt_coupling:3"));
    }
    assert_eq!(again.diagnosis.verdict, Verdict::Identified, "{:?}", again.diagnosis.names);
}
