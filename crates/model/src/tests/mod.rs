//! Tests of the whole model, by question.

mod formats;
mod jacobian;
mod oracles;
mod rig;
mod scopes;
mod surroundings;
mod urdf_edit;

use crate::{Chain, Frames, Model};
use armcal_core::{DwellId, Observation, Pose, Reference};
use nalgebra::{Matrix3, Matrix4, Vector3};
use std::path::Path;

pub(crate) const RIGHT_ARM: &str = include_str!("../../../../pipelines/models/right_arm.toml");
pub(crate) const LEFT_ARM: &str = include_str!("../../../../pipelines/models/left_arm.toml");
pub(crate) const UR10: &str = include_str!("../../../../pipelines/models/ur10.toml");

pub(crate) fn dh(text: &str) -> Chain {
    Chain::from_dh_toml(text, Path::new("arm.toml")).expect("a valid DH table")
}

pub(crate) fn urdf(xml: &str, base: &str, tip: &str) -> Chain {
    Chain::from_urdf(xml, base, tip, Path::new("arm.urdf")).expect("a valid URDF")
}

pub(crate) fn bare(chain: Chain) -> Model {
    Model::new(chain, Frames::of_bare_arm()).expect("frames without a fault")
}

/// Tip of the nominal arm in its base.
pub(crate) fn nominal_tip(model: &Model, joints: &[f64]) -> Matrix4<f64> {
    model.tip_in_base(&model.nominal(), joints).to_homogeneous()
}

pub(crate) fn assert_pose(actual: &Matrix4<f64>, expected_rows: [f64; 12], what: &str) {
    let expected = Matrix4::from_fn(|i, j| match i {
        3 => f64::from(u8::from(j == 3)),
        _ => expected_rows[4 * i + j],
    });
    let error = (actual - expected).abs().max();
    assert!(error < 1e-12, "{what}: off by {error:e}");
}

pub(crate) fn observation(joints: &[f64], reference: Reference) -> Observation {
    let bare = Observation::bare(DwellId { recording: 0, dwell: 0 }, joints.to_vec(), reference);
    Observation { covariance_m2: Matrix3::identity(), ..bare }
}

pub(crate) fn tracked(joints: &[f64], pose: &Pose) -> Observation {
    let reference = Reference::Tracked {
        position_m: pose.translation.vector,
        orientation: Some(pose.rotation),
        orientation_sigma_rad: 1e-4,
    };
    observation(joints, reference)
}

pub(crate) fn seated(joints: &[f64], in_board_m: Vector3<f64>) -> Observation {
    observation(joints, Reference::Seated { cavity: "c01".into(), in_board_m })
}
