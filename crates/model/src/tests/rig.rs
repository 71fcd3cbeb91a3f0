//! The paper's rig in closed form, and its mirror image.

use super::*;
use nalgebra::Matrix4;
use proptest::prelude::*;

#[test]
fn all_joints_at_zero_put_the_tip_where_the_rig_says() {
    let tip = nominal_tip(&bare(dh(RIGHT_ARM)), &[0.0; 3]);
    assert!((tip[(0, 3)] - 0.3543).abs() < 1e-15);
    assert!((tip[(1, 3)] - 0.012).abs() < 1e-15);
    assert!((tip[(2, 3)] - 0.476).abs() < 1e-15);
}

/// Eq. 11-14 of Li et al. 2016, entered as printed, and their product (eq. 15).
fn paper_tip(q: [f64; 3]) -> Matrix4<f64> {
    let (s1, c1) = q[0].sin_cos();
    let (s2, c2) = (std::f64::consts::FRAC_PI_2 + q[1]).sin_cos();
    let (s3, c3) = q[2].sin_cos();
    #[rustfmt::skip]
    let a1 = Matrix4::new(
        c1, 0.0,  s1, 0.0,
        s1, 0.0, -c1, 0.0,
        0.0, 1.0, 0.0, 0.076,
        0.0, 0.0, 0.0, 1.0,
    );
    #[rustfmt::skip]
    let a2 = Matrix4::new(
        c2, -s2, 0.0, 0.4 * c2,
        s2,  c2, 0.0, 0.4 * s2,
        0.0, 0.0, 1.0, 0.0,
        0.0, 0.0, 0.0, 1.0,
    );
    #[rustfmt::skip]
    let a3 = Matrix4::new(
        c3, 0.0,  s3, 0.0,
        s3, 0.0, -c3, 0.0,
        0.0, 1.0, 0.0, -0.012,
        0.0, 0.0, 0.0, 1.0,
    );
    #[rustfmt::skip]
    let a4 = Matrix4::new(
        1.0, 0.0, 0.0, 0.0,
        0.0, 0.0, -1.0, 0.0,
        0.0, 1.0, 0.0, 0.3543,
        0.0, 0.0, 0.0, 1.0,
    );
    a1 * a2 * a3 * a4
}

proptest! {
    #[test]
    fn the_right_arm_is_the_papers_matrices(q in prop::array::uniform3(-3.0..3.0f64)) {
        let tip = nominal_tip(&bare(dh(RIGHT_ARM)), &q);
        prop_assert!((tip - paper_tip(q)).abs().max() < 1e-14);
    }

    #[test]
    fn the_left_arm_is_its_mirror_image(q in prop::array::uniform3(-3.0..3.0f64)) {
        let mirror = Matrix4::from_diagonal(&nalgebra::Vector4::new(1.0, -1.0, 1.0, 1.0));
        let left = nominal_tip(&bare(dh(LEFT_ARM)), &q);
        let right = nominal_tip(&bare(dh(RIGHT_ARM)), &[-q[0], q[1], q[2]]);
        prop_assert!((left - mirror * right * mirror).abs().max() < 1e-14);
    }
}

#[test]
fn every_entry_is_a_parameter_within_the_papers_bounds() {
    let chain = dh(RIGHT_ARM);
    let names: Vec<&str> = chain.parameters().iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names.len(), 16);
    assert_eq!(&names[4..8], ["joint2.theta", "joint2.d", "joint2.a", "joint2.alpha"]);
    assert_eq!(chain.joint_names(), ["joint1", "joint2", "joint3"]);
    let a2 = &chain.parameters()[6];
    assert!(
        (a2.nominal - 0.4).abs() < 1e-15
            && (a2.upper - 0.405).abs() < 1e-15
            && (a2.lower - 0.395).abs() < 1e-15
    );
    assert_eq!(a2.prior_sigma, Some(0.004));
    let theta2 = &chain.parameters()[4];
    assert!((theta2.upper - theta2.nominal - 2f64.to_radians()).abs() < 1e-15);
}

#[test]
fn the_drawn_frames_lead_from_base_to_tip() {
    let model = bare(dh(RIGHT_ARM));
    let frames = model.link_frames(&model.nominal(), &[0.0; 3]);
    let names: Vec<&str> = frames.iter().map(|frame| frame.name.as_str()).collect();
    assert_eq!(names, ["base", "joint1", "joint2", "joint3", "tool", "tip"]);
    // Shoulder 76 mm up, elbow 400 mm above it.
    assert!((frames[1].in_base.translation.vector - Vector3::new(0.0, 0.0, 0.076)).norm() < 1e-15);
    assert!((frames[2].in_base.translation.vector - Vector3::new(0.0, 0.0, 0.476)).norm() < 1e-15);
    assert_eq!(frames[5].in_base.translation, model.tip_in_base(&model.nominal(), &[0.0; 3]).translation);
}
