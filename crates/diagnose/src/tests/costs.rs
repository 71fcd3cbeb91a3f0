//! What explanations cost, against sums written out.

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use super::{conditioned, entry, own, planted, quick};
use crate::Scan;
use crate::config::DiagnosisConfig;

fn close(found: f64, by_hand: f64) {
    assert!((found - by_hand).abs() < 1e-12, "{found}, by hand {by_hand}");
}

#[test]
fn costs_are_three_nats_an_amplitude_and_minus_ln_of_the_prior() {
    let p = planted(&[("backlash:1", 1.0)], 0, 3);
    let config = quick();
    let conditioned = conditioned(&p, &config);
    let costs = conditioned.costs(&config);
    let entries = conditioned.weighed.entries.len() as f64;
    close(costs.of_nothing(), 2f64.ln());
    close(costs.of_unlisted(), 12.0 - (0.1 / conditioned.weighed.unlisted.len() as f64).ln());
    let play = costs.of_entry(entry(&conditioned.weighed, "backlash:1"));
    close(play, 3.0 - (0.4 / entries).ln());
    // Prior times what was said: of what says nothing at all, the priors are left.
    let all = (-costs.of_nothing()).exp()
        + entries * (3.0 - play).exp()
        + conditioned.weighed.unlisted.len() as f64 * (12.0 - costs.of_unlisted()).exp();
    close(all, 1.0);
}

#[test]
fn costs_are_those_of_the_configuration() {
    let p = planted(&[], 0, 1);
    let config = DiagnosisConfig {
        margin_nats: 5.0,
        prior_nothing: 0.2,
        prior_catalogue: 0.7,
        prior_unknown: 0.1,
        ..quick()
    };
    let conditioned = conditioned(&p, &config);
    let costs = conditioned.costs(&config);
    close(costs.of_nothing(), 5f64.ln());
    let play = costs.of_entry(entry(&conditioned.weighed, "backlash:1"));
    close(play, 5.0 - (0.7 / conditioned.weighed.entries.len() as f64).ln());
    close(costs.of_unlisted(), 20.0 - (0.1 / conditioned.weighed.unlisted.len() as f64).ln());
}

#[test]
fn a_shape_that_was_searched_for_costs_an_amplitude_and_the_search_more() {
    let mut p = planted(&[("backlash:1", 1.0)], 0, 3);
    let point = crate::Candidate { spec: "backlash:1,shape=3".into(), ..own(&p, "backlash:1") };
    p.scans.push(Scan { tried: 20, ..Scan::of("backlash:1", vec![point]) });
    let config = quick();
    let conditioned = conditioned(&p, &config);
    let costs = conditioned.costs(&config);
    let [given, searched] = ["backlash:1", "backlash:1,shape=3"].map(|s| entry(&conditioned.weighed, s));
    close(costs.of_entry(searched) - costs.of_entry(given), 3.0 + 20f64.ln());
}

#[test]
fn what_came_out_as_no_such_mechanism_can_costs_two_amplitudes_more() {
    // The same columns turned over: what explains the data is negative there, and may not be.
    let mut p = planted(&[("backlash:1", 1.0)], 0, 3);
    for c in p.candidates.iter_mut().filter(|c| c.spec == "backlash:1") {
        c.amplitudes[0].never_negative = true;
    }
    let play = own(&p, "backlash:1");
    let turned = crate::Columns::Dense(std::sync::Arc::new(-1.0 * play.columns.dense(&p.dwells, 1.0)));
    p.candidates.push(crate::Candidate { spec: "turned".into(), columns: turned, ..play });
    let config = quick();
    let conditioned = conditioned(&p, &config);
    let costs = conditioned.costs(&config);
    let [play, turned] = ["backlash:1", "turned"].map(|s| entry(&conditioned.weighed, s));
    assert!(!conditioned.judge(turned, &config).impossible.is_empty());
    assert!(conditioned.judge(play, &config).impossible.is_empty());
    close(costs.of_entry(turned) - costs.of_entry(play), 6.0);
    // What it must gain is what it costs without: a sign is no freedom.
    close(conditioned.judge(turned, &config).cost_nats, conditioned.judge(play, &config).cost_nats);
}
