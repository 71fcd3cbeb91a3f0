//! Names of one joint that one name does as well, and those that it does not.

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use super::*;
use crate::Problem;
use crate::tests::{entry, own, planted, quick, with_conditioned};

/// Names as if a search had ended with them, and those that are left of them.
fn left(p: &Problem, specs: &[&str]) -> Vec<String> {
    let config = quick();
    let found = with_conditioned(p, &config, |conditioned_problems| {
        let mut accepted = Vec::new();
        for spec in specs {
            let others: Vec<Candidate> = specs.iter().filter(|s| *s != spec).map(|s| own(p, s)).collect();
            let conditioned = conditioned_problems.with(&others)?;
            let judged = conditioned.judge(entry(&conditioned.weighed, spec), &config);
            let grade = judged.grade(&config);
            let set = vec![judged.entry];
            let (instead_of, ranked) = Default::default();
            accepted.push(Accepted {
                candidate: own(p, spec),
                judged,
                conditioned,
                grade,
                set,
                instead_of,
                ranked,
            });
        }
        merge_names(conditioned_problems, Found { accepted, may_be_shape: false }, &config)
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
