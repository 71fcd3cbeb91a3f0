//! Parameters, their standard deviations and errors of shipped pipelines and of twenty rigs, against the numbers that were
//! written down when they were last meant to change. `ARMCAL_GOLDENS=write cargo test --workspace --all-features goldens`
//! writes them down again; the commit that does so says why. What changes a number in its last bits is seen by
//! `cargo bench -p armcal --bench before`; here it may come from the processor.

use crate::support::root;
use armcal_calibrate::{Calibration, FitConfig, HoldoutConfig, calibrate};
use armcal_config::Pipeline;
use armcal_lab::scenario::{Design, Scenario};
use armcal_score::nominal_model;
use armcal_stages::Silent;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What the rigs hide; families with every kind of action on the arm.
const HIDDEN: [&str; 10] = [
    "nothing",
    "backlash",
    "gravity_backlash",
    "compliance",
    "base_compliance",
    "eccentricity",
    "frame_shift@dwell",
    "zero_drift",
    "sensor_scale",
    "outside:cable_drag",
];
const PIPELINES: [&str; 5] = ["paper", "paper-normal", "paper-camera-free", "mukca-panda4", "two-arms"];
/// How far a parameter may be from what was written down, in its standard deviations; and an error in itself.
const TOLERANCE: f64 = 1e-6;

/// What is written down of a calibration.
#[derive(Debug, Serialize, Deserialize)]
struct Golden {
    /// Mean error with nominal and fitted parameters on the judged side [m].
    judged_m: [f64; 2],
    noise_floor_m: f64,
    /// Value and standard deviation of every free parameter, SI.
    parameters: BTreeMap<String, [f64; 2]>,
}

impl Golden {
    fn of(calibration: &Calibration) -> Golden {
        let judged = calibration.judged();
        let free = calibration.fit.estimates.iter().filter(|e| e.parameter.free);
        Golden {
            judged_m: [judged.nominal.mean_m, judged.fitted.mean_m],
            noise_floor_m: calibration.noise_floor_m,
            parameters: free.map(|e| (e.parameter.name.clone(), [e.value, e.sigma])).collect(),
        }
    }

    fn assert_is(&self, expected: &Golden, case: &str) {
        let near = |a: f64, b: f64, scale: f64| (a - b).abs() <= TOLERANCE * scale;
        let same = self.judged_m.iter().zip(&expected.judged_m).all(|(a, b)| near(*a, *b, *b));
        assert!(same, "{case}: {:?} m was {:?} m", self.judged_m, expected.judged_m);
        assert!(
            near(self.noise_floor_m, expected.noise_floor_m, expected.noise_floor_m),
            "{case}: the floor"
        );
        assert!(self.parameters.keys().eq(expected.parameters.keys()), "{case}: other parameters are free");
        for ((name, [value, sigma]), [was, was_sigma]) in
            self.parameters.iter().zip(expected.parameters.values())
        {
            let same = near(*value, *was, *was_sigma) && near(*sigma, *was_sigma, *was_sigma);
            assert!(same, "{case}, {name}: {value} ± {sigma} was {was} ± {was_sigma}");
        }
    }
}

fn of_pipeline(name: &str) -> Golden {
    let path = root().join("pipelines").join(name).with_extension("toml");
    let pipeline = Pipeline::load(&path).expect("a shipped pipeline");
    Golden::of(&armcal_pipeline::settle(&pipeline, &Silent).expect("a calibration").fitted.calibration)
}

fn of_rig(scenario: &Scenario) -> Golden {
    let observed = scenario.observe().expect("a session");
    let model = nominal_model(&observed.nominal).expect("its nominal model");
    let holdout = match observed.observations.iter().any(|o| o.cavity().is_some()) {
        true => HoldoutConfig::CavityFolds { k: 5 },
        false => HoldoutConfig::default(),
    };
    let found = calibrate(&model, &observed.observations, &FitConfig::default(), &holdout);
    Golden::of(&found.expect("a calibration"))
}

#[test]
fn no_number_moves_unless_it_is_meant_to() {
    let rigs = [Design::ThreeTiltsBothWays, Design::FreePoses].into_iter().flat_map(|design| {
        HIDDEN.iter().map(move |hidden| (format!("{hidden} {design:?}"), Scenario::new(hidden, design, 7001)))
    });
    let rigs: Vec<(String, Scenario)> = rigs.collect();
    let mut found: BTreeMap<String, Golden> =
        rigs.par_iter().map(|(name, scenario)| (name.clone(), of_rig(scenario))).collect();
    found.extend(PIPELINES.map(|name| (name.to_owned(), of_pipeline(name))));

    let path = root().join("fixtures/goldens.json");
    if std::env::var_os("ARMCAL_GOLDENS").is_some_and(|word| word == "write") {
        let text = serde_json::to_string_pretty(&found).expect("numbers");
        std::fs::write(&path, text + "\n").expect("writing the goldens");
        return;
    }
    let text = std::fs::read_to_string(&path).expect("reading the goldens");
    let expected: BTreeMap<String, Golden> = serde_json::from_str(&text).expect("goldens");
    assert!(found.keys().eq(expected.keys()), "other cases: {:?}", found.keys());
    found.iter().zip(expected.values()).for_each(|((case, found), expected)| found.assert_is(expected, case));
}
