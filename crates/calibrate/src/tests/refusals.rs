use super::linear::{Linear, parameter};
use super::rig;
use crate::fit;
use crate::fit_problem;
use crate::{CalibrateError, FitConfig, HoldoutConfig, Objective, calibrate};
use armcal_core::{Code, Observation, Reference};
use nalgebra::{DMatrix, DVector, Matrix3};

fn good() -> (armcal_model::Model, Vec<Observation>) {
    let model = rig::tracked_model();
    let mut rng = rig::rng(41);
    let truth = rig::planted(&model, &mut rng, 0.5);
    let observations = rig::tracked(&model, &truth, 30, &mut rng);
    (model, observations)
}

#[test]
fn a_broken_observation_is_named() {
    type Break = fn(&mut Observation);
    let cases: [(Break, &str); 6] = [
        (|o| o.joint_rad[1] = f64::NAN, "a joint reading is not finite"),
        (|o| o.joint_sigma_rad[0] = -1.0, "standard error of a joint reading"),
        (|o| o.joint_sigma_rad.clear(), "3 joint readings but 0 standard errors"),
        (|o| o.covariance_m2 = Matrix3::zeros(), "not positive definite"),
        (|o| o.covariance_m2[(0, 0)] = f64::NAN, "not positive definite"),
        (
            |o| {
                if let Reference::Tracked { position_m, .. } = &mut o.reference {
                    position_m.y = f64::INFINITY;
                }
            },
            "the measured position is not finite",
        ),
    ];
    for (break_it, expected) in cases {
        let (model, mut observations) = good();
        break_it(&mut observations[17]);
        let error = fit(&model, &observations, &FitConfig::default()).unwrap_err().to_string();
        assert!(error.contains("recording 0 dwell 17") && error.contains(expected), "{error}");
    }
}

#[test]
fn what_does_not_match_the_model_is_refused() {
    let (model, mut observations) = good();
    observations[2].joint_rad.pop();
    let error = fit(&model, &observations, &FitConfig::default()).unwrap_err();
    assert!(matches!(error, CalibrateError::Model(_)), "{error}");
    let error = calibrate(&model, &[], &FitConfig::default(), &HoldoutConfig::None).unwrap_err();
    assert!(matches!(error, CalibrateError::NoObservations { .. }), "{error}");
}

#[test]
fn a_fit_that_nobody_waits_for_is_stopped() {
    let (model, observations) = good();
    for objective in [Objective::Robust, Objective::LeastSquares, Objective::Paper] {
        let config = FitConfig { objective, ..FitConfig::default() };
        fit(&model, &observations, &config).unwrap();
        config.clone().stop.now();
        let error = fit(&model, &observations, &config).unwrap_err();
        assert!(matches!(error, CalibrateError::Stopped), "{objective:?}: {error}");
    }
}

#[test]
fn too_few_dwells_are_said_with_numbers() {
    let (model, observations) = good();
    let fit = fit(&model, &observations[..4], &FitConfig::default()).unwrap();
    let warning = fit.warnings.iter().find(|w| w.code == Code::TooFewDwells).unwrap();
    assert!(
        warning.message.starts_with("12 equations from 4 dwells for 16 free parameters"),
        "{}",
        warning.message
    );
    assert!(fit.estimates.iter().all(|e| e.value.is_finite() && e.sigma.is_finite()));

    // Nothing known beforehand about four parameters, three equations.
    let parameters = ["a", "b", "c", "d"].map(|n| parameter(n, f64::INFINITY, None)).to_vec();
    let blocks = vec![(DVector::zeros(3), DMatrix::from_element(3, 4, 1.0))];
    let problem = Linear { parameters, blocks, variance: 1.0 };
    let error = fit_problem(&problem, &[0.0; 4], &|p| p.free, &FitConfig::default()).unwrap_err();
    assert!(
        error.to_string().starts_with("3 equations from 1 dwells cannot give 4 free parameters"),
        "{error}"
    );
}

#[test]
fn impossible_parameters_and_settings_are_refused() {
    let problem = |edit: fn(&mut Linear)| {
        let parameters = ["a"].map(|n| parameter(n, 1.0, None)).to_vec();
        let blocks = vec![(DVector::zeros(3), DMatrix::from_element(3, 1, 1.0)); 3];
        let mut problem = Linear { parameters, blocks, variance: 1.0 };
        edit(&mut problem);
        fit_problem(&problem, &[0.0], &|p| p.free, &FitConfig::default()).map(|_| ()).unwrap_err().to_string()
    };
    assert!(problem(|p| p.parameters[0].free = false).contains("every parameter is fixed"));
    assert!(problem(|p| p.parameters[0].lower = 2.0).contains("leave no room"));
    assert!(problem(|p| p.parameters[0].prior_sigma = Some(-1.0)).contains("above zero"));
    assert!(problem(|p| p.parameters[0].nominal = f64::NAN).contains("not finite"));
    assert!(problem(|p| p.blocks[1].0[0] = f64::NAN).contains("block 1: the residual is not finite"));
    assert!(problem(|p| p.blocks[1].1[(0, 0)] = f64::NAN).contains("block 1"));
    let config: FitConfig = toml::from_str("huber_c = -1.0").unwrap();
    assert!(config.check().unwrap_err().to_string().contains("fit.huber_c = -1"));
    assert!(toml::from_str::<FitConfig>("objectiv = \"paper\"").is_err());
    assert!(toml::from_str::<HoldoutConfig>("kind = \"random\"\nshare = 0.2\nsed = 1").is_err());
    assert_eq!(toml::from_str::<FitConfig>("").unwrap(), FitConfig::default());
}
