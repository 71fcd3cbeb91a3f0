use armcal::plan::{Allowed, Known, Place, Proposal, Tracking, propose, standing};
use armcal::score::nominal_model;
use armcal_calibrate::{FitConfig, HoldoutConfig, calibrate};
use armcal_diagnose::{Diagnosis, DiagnosisConfig, Verdict, diagnose};
use armcal_lab::config::{RecordingConfig, StopConfig, TourConfig};
use armcal_lab::scenario::{Design, Scenario, Size};
use armcal_lab::{LabConfig, observe};
use armcal_model::Session;
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
    let diagnosis =
        diagnose(&model, &calibration, observations, &session, &fit, &diagnosed).expect("diagnosing");
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
    let open = standing(&diagnosis, model.chain().joint_names()).expect("what stands");
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
        let name = format!("next-{load_kg}");
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

fn settle(family: &str, target: usize, seed: u64) -> (Said, Said) {
    let scenario = Scenario {
        target: Some(target),
        size: Size::Medium,
        ..Scenario::new(family, Design::OneTiltOnePass, seed)
    };
    let config = scenario.plant().expect("planting").config;
    let allowed = Allowed { dwells: 8, loads_kg: vec![0.5], ..Allowed::default() };
    let before = ask(&config, &allowed);
    let after = ask(&record(&config, &before.proposal), &allowed);
    for (word, said) in [("before", &before), ("after", &after)] {
        println!("{family} {seed} {word}: {:?} {:?}", said.diagnosis.verdict, said.diagnosis.names);
    }
    println!("  told apart: {:?}; {}", before.proposal.explanations, before.proposal.sentence);
    for dwell in &before.proposal.dwells {
        println!(
            "  {:?} {:.1?} {:?} {} kg, Delta {:.1}",
            dwell.place, dwell.joint_deg, dwell.arrival, dwell.load_kg, dwell.delta
        );
    }
    (before, after)
}

#[test]
fn few_dwells_settle_what_the_board_alone_cannot_know() {
    for (family, target) in [("compliance", 2), ("belt_coupling", 3)] {
        for seed in 1..=4 {
            let (before, after) = settle(family, target, seed);
            let _ = (Verdict::Identified, before, after);
        }
    }
}
