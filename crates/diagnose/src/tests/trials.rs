//! What a trial says of a noise against what the noise says once everything is projected in full.

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use super::*;
use crate::evidence::{Metric, over_noise};
use crate::grams::tests::forms;
use crate::tests::planted;

#[test]
fn a_trial_weighs_as_the_full_projection_under_every_noise() {
    let problem = planted(&[("backlash:1", 1.0)], 0, 5);
    let forms = forms(&problem);
    let scouts: Vec<&Columns> = forms.iter().collect();
    let config = DiagnosisConfig::default();
    let white = Metric::new(Noise::White, 0.0, &problem, 1.3).weighed(0.9, None, &config);
    let trials = Trials::new(&scouts, &problem, 1.3, &config);
    let kinds = Noise::available(&problem);
    assert!(kinds.contains(&Noise::Memory) && kinds.contains(&Noise::Slack(0)), "{kinds:?}");
    let mut widened = 0;
    for kind in kinds {
        let of_kind = trials.of(kind);
        for amplitude in [0.3, 3.0, 10.0] {
            let metric = Metric::new(kind, amplitude, &problem, 1.3).weighed(0.5, Some(&white), &config);
            let tried = |ln_weight| of_kind.tried(amplitude, 0.5, &Metric { ln_weight, ..white.clone() });
            let found = tried(f64::NEG_INFINITY).unwrap();
            let mut expected = vec![metric.ln_weight];
            expected.extend(over_noise(&scouts, &problem, 1.3, &[metric], &config).concat());
            let near = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-6 * b.abs().max(1.0);
            assert!(found.iter().zip(&expected).all(near), "{kind:?} {amplitude}: {found:?} {expected:?}");
            assert_eq!(found.len(), 1 + scouts.len());
            // One that widens what is declared is not asked further where it says less of nothing.
            let refused = tried(found[0] + 1e-9).is_none();
            assert_eq!(refused, kind.widens(), "{kind:?}");
            widened += usize::from(refused);
        }
    }
    assert!(widened > 0);
}
