use super::rig;
use crate::FitConfig;
use crate::fit;

#[test]
fn intervals_hold_the_planted_truth_95_percent_of_the_time() {
    let model = rig::tracked_model();
    let mut coverage = rig::Coverage::default();
    for seed in 0..150 {
        let mut rng = rig::rng(seed);
        let truth = rig::planted(&model, &mut rng, 0.9);
        let observations = rig::tracked(&model, &truth, 99, &mut rng);
        let fit = fit(&model, &observations, &FitConfig::default()).unwrap();
        coverage.count(&fit, &truth, |e| e.determined);
    }
    let share = coverage.share();
    assert!((0.93..0.975).contains(&share), "coverage {share}");
}

#[test]
fn parallel_axes_are_reported_in_words() {
    let model = rig::tracked_model();
    let mut rng = rig::rng(7);
    let truth = rig::planted(&model, &mut rng, 0.9);
    let observations = rig::tracked(&model, &truth, 99, &mut rng);
    let fit = fit(&model, &observations, &FitConfig::default()).unwrap();
    for direction in &fit.undetermined {
        println!("{}  {:?}", direction.text, direction.shares);
    }
    let parallel = fit.undetermined.iter().find(|d| d.text.contains("joint2") && d.text.contains("parallel"));
    assert!(parallel.is_some(), "{:#?}", fit.undetermined);
    let d2 = fit.estimates.iter().find(|e| e.parameter.name == "joint2.d").unwrap();
    assert!(!d2.determined);
    let a2 = fit.estimates.iter().find(|e| e.parameter.name == "joint2.a").unwrap();
    assert!(a2.determined);
    let free = fit.estimates.iter().filter(|e| e.parameter.free).count();
    assert_eq!(fit.rank + fit.undetermined.len(), free);
    // What nothing determines keeps most of its prior's width (4 mm), and never gets more.
    assert!((3.0e-3..4.0e-3).contains(&d2.sigma), "{}", d2.sigma);
}
