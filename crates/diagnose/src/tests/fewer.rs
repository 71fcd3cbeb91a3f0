//! Names of one joint that one name does as well, and those that it does not.

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use super::*;
use crate::evidence::Metric;
use crate::noise::Noise;
use crate::tests::{entry, in_rooms, own, planted, quick};

/// Names as if a search had ended with them, and those that are left of them.
fn left(p: &Problem, specs: &[&str]) -> Vec<String> {
    let config = quick();
    let found = in_rooms(p, &config, |rooms| {
        let mut accepted = Vec::new();
        for spec in specs {
            let others: Vec<Candidate> = specs.iter().filter(|s| *s != spec).map(|s| own(p, s)).collect();
            let room = rooms.with(&others)?;
            let judged = room.judge(entry(&room.weighed, spec), &config);
            let grade = judged.grade(&room.weighed, &config);
            accepted.push(Accepted {
                candidate: own(p, spec),
                judged,
                room,
                grade,
                instead_of: Vec::new(),
                refits: Vec::new(),
            });
        }
        fewer(rooms, Found { accepted, may_be_shape: false }, &config)
    });
    let mut names: Vec<String> = found.unwrap().accepted.iter().map(|a| a.candidate.spec.clone()).collect();
    names.sort();
    names
}

#[test]
fn one_cause_gets_one_name() {
    let p = planted(&[("eccentricity:2", 1.0), ("backlash:1", 1.0)], 80, 4);
    assert_eq!(left(&p, &["two_per_turn:2", "scale:2", "backlash:1"]), ["backlash:1", "eccentricity:2"]);
    // What is there stays, and so do two causes of one joint.
    assert_eq!(left(&p, &["eccentricity:2", "backlash:1"]), ["backlash:1", "eccentricity:2"]);
    let p = planted(&[("eccentricity:2", 1.0), ("backlash:2", 1.0)], 80, 5);
    assert_eq!(left(&p, &["eccentricity:2", "backlash:2"]), ["backlash:2", "eccentricity:2"]);
}

#[test]
fn the_evidence_of_a_base_is_its_bayes_factor() {
    // What joins the base with the prior that it is weighed with changes its evidence by what the weighing says.
    let p = planted(&[("backlash:1", 1.0)], 0, 3);
    let config = DiagnosisConfig { amplitude_scales: vec![10.0], noise_prior_dof: 1e9, ..quick() };
    let columns = own(&p, "backlash:1").columns.dense(&p.dwells, 1.0);
    let white = Metric::new(Noise::White, 0.0, &p, 1.0);
    let joined = Metric::new(Noise::White, 0.0, &p.clone().with_columns(&columns), 1.0);
    let change = joined.ln_evidence(&config) - white.ln_evidence(&config);
    let weighed = white.ln_bayes(&white.gram(&columns), &config);
    assert!(change > 10.0 && (change - weighed).abs() < 1e-3 * weighed, "{change} {weighed}");
}
