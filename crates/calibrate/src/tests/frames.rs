use super::rig;
use crate::fit;
use crate::{FitConfig, align_frames, fit_frames};
use armcal_core::{DwellId, Observation, Pose, Reference};
use armcal_model::{Frame, Frames, Model};
use nalgebra::Vector3;

fn far() -> Pose {
    Pose::new(Vector3::new(2.5, -1.5, 0.8), Vector3::new(0.2, -0.1, 2.9))
}

/// Puts base (and tip) parameters of a pose into a parameter vector whose nominal rotation is identity.
fn put(model: &Model, p: &mut [f64], frame: &str, pose: &Pose) {
    let turn = pose.rotation.scaled_axis();
    for (k, axis) in ["x", "y", "z"].iter().enumerate() {
        p[model.index(&format!("{frame}.{axis}")).unwrap()] = pose.translation.vector[k];
        if let Some(i) = model.index(&format!("{frame}.r{axis}")) {
            p[i] = turn[k];
        }
    }
}

fn rms_mm(model: &Model, p: &[f64], observations: &[Observation]) -> f64 {
    let sum: f64 = observations.iter().map(|o| model.residual(p, o).position_m.norm_squared()).sum();
    1e3 * (sum / observations.len() as f64).sqrt()
}

#[test]
fn base_metres_and_half_turns_off_and_an_unknown_tool_are_found() {
    let given = rig::tracked_model();
    let tip = Frame { free_rotation: false, ..Frame::estimated("tip", Pose::identity()) };
    let frames = Frames {
        base: Frame::estimated("base", Pose::identity()),
        tip,
        markers: Vec::new(),
        boards: Vec::new(),
    };
    let model = Model::new(given.chain().clone(), frames).unwrap();
    let mut rng = rig::rng(21);
    let mut truth = rig::planted(&model, &mut rng, 0.0);
    put(&model, &mut truth, "base", &far());
    put(&model, &mut truth, "tip", &Pose::translation(0.06, -0.08, 0.05));
    let mut observations = rig::tracked(&model, &truth, 60, &mut rng);
    if let Reference::Tracked { position_m, .. } = &mut observations[4].reference {
        position_m.x += 0.3;
    }
    let sound: Vec<Observation> =
        observations.iter().enumerate().filter(|(i, _)| *i != 4).map(|(_, o)| o.clone()).collect();
    let config = FitConfig::default();
    let start = align_frames(&model, &observations, &config).unwrap();
    let fitted = fit_frames(&model, &observations, &config).unwrap();
    println!(
        "rms start {:.3} mm, fitted {:.3} mm",
        rms_mm(&model, &start, &sound),
        rms_mm(&model, &fitted, &sound)
    );
    assert!(rms_mm(&model, &fitted, &sound) < 0.6);
    assert!(model.base_in_world(&fitted).rotation.angle_to(&far().rotation) < 3e-3);
    // Only estimated frames moved.
    for ((p, v), nominal) in model.parameters().iter().zip(&fitted).zip(model.nominal()) {
        assert!(*v == nominal || p.name.starts_with("base.") || p.name.starts_with("tip."), "{}", p.name);
    }
}

#[test]
fn boards_are_found_without_a_camera_and_the_zero_of_joint_1_is_tied_to_them() {
    let model = rig::board_model();
    let mut rng = rig::rng(22);
    let truth = rig::planted(&model, &mut rng, 0.8);
    let boards = [
        far(),
        Pose::translation(0.5, 0.1, 0.1),
        Pose::new(Vector3::new(0.4, 0.0, 0.2), Vector3::new(1.9, 0.0, 0.4)),
    ];
    let observations = rig::seated(&model, &truth, &boards, 33, &mut rng);
    let fit = fit(&model, &observations, &FitConfig::default()).unwrap();
    println!("rms {:.3} mm, scale {:.3}", rms_mm(&model, &fit.values(), &observations), fit.sigma_scale);
    assert!((0.9..1.15).contains(&fit.sigma_scale));
    let tied = fit.undetermined.iter().find(|d| d.shares.iter().any(|s| s.0 == "joint1.theta"));
    println!("{:#?}", fit.undetermined.iter().map(|d| &d.text).collect::<Vec<_>>());
    assert!(tied.is_some());
}

#[test]
fn a_board_seen_at_two_sockets_keeps_its_turn_about_their_line() {
    let model = rig::board_model();
    let mut rng = rig::rng(23);
    let truth = rig::planted(&model, &mut rng, 0.0);
    let mut observations = rig::seated(&model, &truth, &[Pose::identity()], 12, &mut rng);
    // Fold the twelve visits onto two sockets 50 mm apart, by giving each its own reachable reading.
    let sockets = [Vector3::zeros(), Vector3::new(0.0, 0.05, 0.0)];
    let board = Pose::translation(0.45, -0.02, 0.12);
    for (i, o) in observations.iter_mut().enumerate() {
        let target = (board * nalgebra::Point3::from(sockets[i % 2])).coords;
        o.joint_rad = reach(&model, &truth, target, &o.joint_rad);
        let cavity = format!("hole_{}", i % 2);
        o.reference = Reference::Seated { cavity, in_board_m: sockets[i % 2] };
        o.dwell = DwellId { recording: 0, dwell: i };
    }
    let fitted = fit_frames(&model, &observations, &FitConfig::default()).unwrap();
    assert!(rms_mm(&model, &fitted, &observations) < 1e-3, "{}", rms_mm(&model, &fitted, &observations));
    let turn = model.board_in_world(&fitted, 0).unwrap().rotation.angle();
    assert!(turn < 1e-3, "turned by {turn} although nothing asks for it");
}

/// Joint readings that bring the tip to a point, by Newton's method.
fn reach(model: &Model, p: &[f64], target: Vector3<f64>, start: &[f64]) -> Vec<f64> {
    let mut q = start.to_vec();
    let reference = Reference::Tracked { position_m: target, orientation: None, orientation_sigma_rad: 0.0 };
    for _ in 0..200 {
        let o = rig::observation(DwellId { recording: 0, dwell: 0 }, q.clone(), reference.clone());
        let jacobian = model.joint_jacobian(p, &o);
        let normal = &jacobian.transpose() * &jacobian + nalgebra::DMatrix::identity(3, 3) * 1e-6;
        let step = normal.try_inverse().unwrap() * jacobian.transpose() * model.residual(p, &o).position_m;
        let factor = (0.3 / step.norm()).min(1.0);
        q.iter_mut().zip(step.iter()).for_each(|(q, s)| *q += factor * s);
    }
    q
}
