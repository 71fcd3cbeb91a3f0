use super::rig;
use crate::{Calibration, FitConfig, HoldoutConfig, calibrate};
use armcal_core::{Arrival, DwellId, Observation, Pose, Reference};
use armcal_model::{Frame, Model, Session};
use rand::RngExt as _;

/// Width of the gap in joint 1 [rad].
const WIDTH_RAD: f64 = 0.02;

/// Half of the dwells held by a servo, on the flank that it drives; half in cavities, anywhere in the gap.
fn observations(model: &Model, seed: u64) -> Vec<Observation> {
    let mut rng = rig::rng(seed);
    let p = model.nominal();
    let board = model.board_in_world(&p, 0).unwrap();
    let mut one = |(dwell, q): (usize, Vec<f64>)| {
        let seated = dwell % 2 == 0;
        let up = rng.random_bool(0.5);
        let flank = if up { -0.5 } else { 0.5 };
        let rest = if seated { rng.random_range(-0.5..0.5) } else { flank };
        let mut link = q.clone();
        link[0] += WIDTH_RAD * rest;
        let at = |q, reference| rig::observation(DwellId { recording: 0, dwell }, q, reference);
        let free = at(link, Reference::position(nalgebra::Vector3::zeros()));
        let tip = model.predicted_tip_in_world(&p, &free) + rig::gauss3(&mut rng, rig::SIGMA_M);
        let in_board_m = (board.inverse() * nalgebra::Point3::from(tip)).coords;
        let reference = match seated {
            true => Reference::Seated { cavity: format!("c{dwell}"), in_board_m },
            false => Reference::position(tip),
        };
        let mut o = at(q, reference);
        o.arrival[0] = if up { Arrival::Positive } else { Arrival::Negative };
        o
    };
    rig::poses(300, &mut rig::rng(seed + 1000)).into_iter().enumerate().map(&mut one).collect()
}

fn calibrated(effect: &str, observations: &[Observation], geometry: &Model) -> (Model, Calibration) {
    let spec = geometry.effect(effect).unwrap();
    let model = geometry.with_effects(&[spec], &Session::of(observations)).unwrap();
    let done = calibrate(&model, observations, &FitConfig::default(), &HoldoutConfig::None).unwrap();
    (model, done)
}

#[test]
fn where_a_joint_rests_in_its_gap_is_noise_of_known_size() {
    let board = Frame::given("board.a", Pose::translation(0.4, 0.0, 0.1));
    let geometry = rig::model(Frame::given("base", Pose::identity()), vec![board]);
    for seed in 1..=5 {
        let observations = observations(&geometry, seed);
        let (_, anywhere) = calibrated("backlash:1,seated=0", &observations, &geometry);
        let width = anywhere.fit.estimates.iter().find(|e| e.parameter.name.ends_with(".width")).unwrap();
        let [mean_m, floor_m] = [anywhere.train.fitted.mean_m, anywhere.noise_floor_m];
        println!(
            "seed {seed}: width {:.5} +- {:.5}, scale {:.3}, mean {:.3} mm, floor {:.3} mm",
            width.value,
            width.sigma,
            anywhere.fit.sigma_scale,
            mean_m * 1e3,
            floor_m * 1e3
        );
        assert!((width.value - WIDTH_RAD).abs() < 4.0 * width.sigma && width.sigma < 0.02 * WIDTH_RAD);
        assert!((0.85..1.1).contains(&anywhere.fit.sigma_scale));
        // An even spread is 8.5 % larger in the mean than the normal one of the same variance.
        assert!((0.95..1.15).contains(&(mean_m / floor_m)), "{mean_m} of {floor_m}");
        // Taken to be on the flank everywhere, the same errors are many times what noise explains.
        let (_, on_flank) = calibrated("backlash:1,seated=1", &observations, &geometry);
        assert!(on_flank.train.fitted.mean_m > 3.0 * on_flank.noise_floor_m);
    }
}

/// The variance between the flanks, in closed form; none on a flank, none where a servo holds the arm.
#[test]
fn slack_ends_at_the_flanks() {
    let board = Frame::given("board.a", Pose::translation(0.4, 0.0, 0.1));
    let geometry = rig::model(Frame::given("base", Pose::identity()), vec![board]);
    let observations = observations(&geometry, 1);
    for (seated, share) in [("-1", 0.0), ("-0.5", 0.25), ("0", 1.0 / 3.0), ("1", 0.0), ("2", 0.0)] {
        let spec = geometry.effect(&format!("backlash:1,seated={seated}")).unwrap();
        let model = geometry.with_effects(&[spec], &Session::of(&observations)).unwrap();
        let mut p = model.nominal();
        let width = p.len() - 2;
        p[width] = WIDTH_RAD;
        let half = 0.5 * WIDTH_RAD;
        let of = |o: &Observation| model.slack(&p, o);
        let expected: Vec<(usize, f64)> =
            if share > 0.0 { vec![(0, half * half * share)] } else { Vec::new() };
        let found = of(&observations[0]);
        assert_eq!(found.len(), expected.len(), "{seated}");
        assert!(found.iter().zip(&expected).all(|(a, b)| a.0 == b.0 && (a.1 - b.1).abs() < 1e-15));
        assert!(of(&observations[1]).is_empty(), "a servo holds it");
        assert_eq!(model.has_gaps(), share > 0.0, "{seated}");
        assert!(!geometry.has_gaps());
    }
    // What rests in half of its gap does so whoever holds it, and no joint leaves its gap.
    for (text, in_cavity, held) in
        [("rest=0.5", 0.25, 0.25), ("seated=0,rest=0.6", 1.0, 0.36), ("rest=0", 0.0, 0.0)]
    {
        let spec = geometry.effect(&format!("backlash:1,{text}")).unwrap();
        let model = geometry.with_effects(std::slice::from_ref(&spec), &Session::of(&observations)).unwrap();
        let mut p = model.nominal();
        p[geometry.parameters().len()] = WIDTH_RAD;
        let part =
            |o: &Observation| model.slack(&p, o).first().map_or(0.0, |(_, v)| 12.0 * v / WIDTH_RAD.powi(2));
        assert!((part(&observations[0]) - in_cavity).abs() < 1e-12, "{text}");
        assert!((part(&observations[1]) - held).abs() < 1e-12, "{text}");
        assert_eq!(model.gaps(&p), [(spec, 0, WIDTH_RAD)]);
    }
}
