//! Offsets of the joints alone, for a controller that keeps its nominal geometry.
//!
//! The zeros among the calibrated parameters belong to the calibrated lengths and angles; with nominal ones others are better.
//! These bring the nominal arm as near as zeros can to where the calibrated one is at the readings of the session,
//!
//! ```text
//! min over o, f:  sum_i | tip(q_i) - nominal(q_i + o, f) |^2,
//! ```
//!
//! by Gauss-Newton steps of least length, in units of 0.01 rad for a zero and 1 m or rad for a frame; `f` are the frames that the calibration
//! was free to move, which whoever uses the nominal arm measures again anyhow: what a frame can take up, such as a turn of the base
//! beside the first joint's zero, is left to it.

use crate::ur::yaml_number;
use armcal_core::{Observation, Reference};
use armcal_model::{Model, Skeleton};
use nalgebra::{DMatrix, DVector, Matrix3xX, SymmetricEigen, Vector3};

/// A usual zero error [rad], of sliding joints [m].
const ZERO_RAD: f64 = 0.01;
/// How far a frame may go for it [m], [rad].
const FRAME: f64 = 1.0;
/// Directions in which the tips move by less, as a share of the most, are left alone.
const UNSEEN: f64 = 1e-12;
const STEPS: usize = 50;

/// Offsets and the frames with them.
#[derive(Debug, Clone, PartialEq)]
pub struct JointZeros {
    /// `true reading = reading + offset`, by joint of the model [rad]; of sliding joints [m].
    pub offset: Vec<f64>,
    /// The parameters of the nominal arm, its frames as they go with the offsets.
    pub values: Vec<f64>,
}

impl JointZeros {
    /// The offsets of these `joints` with which the nominal arm comes nearest to `tips_m`, the places in the world that the
    /// calibrated one has at `observations`; `frames` are the indices of parameters of frames that may move.
    pub fn fit(
        nominal: &Model,
        start: &[f64],
        (joints, frames): (&[usize], &[usize]),
        observations: &[(Observation, Vector3<f64>)],
    ) -> JointZeros {
        let mut zeros = JointZeros { offset: vec![0.0; nominal.joint_count()], values: start.to_vec() };
        let scales: Vec<f64> = joints.iter().map(|_| ZERO_RAD).chain(frames.iter().map(|_| FRAME)).collect();
        for _ in 0..STEPS {
            let (mut normal, mut towards) =
                (DMatrix::zeros(scales.len(), scales.len()), DVector::zeros(scales.len()));
            for (o, tip_m) in observations {
                let o = zeros.read(o, *tip_m);
                let (residual, by_parameters) = nominal.residual_with_jacobian(&zeros.values, &o);
                let by_joints = nominal.joint_jacobian(&zeros.values, &o);
                // The residual is measured - predicted; a joint's column is of what is predicted.
                let column = |k: usize| match joints.get(k) {
                    Some(joint) => by_joints.column(*joint) * scales[k],
                    None => by_parameters.fixed_view::<3, 1>(0, frames[k - joints.len()]) * -scales[k],
                };
                let jacobian = Matrix3xX::from_columns(&(0..scales.len()).map(column).collect::<Vec<_>>());
                normal += jacobian.transpose() * &jacobian;
                towards += jacobian.transpose() * residual.position_m;
            }
            let step = minimum_norm_solution(normal, &towards);
            for (k, (step, scale)) in step.iter().zip(&scales).enumerate() {
                match joints.get(k) {
                    Some(joint) => zeros.offset[*joint] += step * scale,
                    None => zeros.values[frames[k - joints.len()]] += step * scale,
                }
            }
            if step.amax() < 1e-12 {
                break;
            }
        }
        zeros
    }

    /// The observation as the controller has it: readings with the offsets, the tip seen where it should be.
    fn read(&self, o: &Observation, tip_m: Vector3<f64>) -> Observation {
        let joint_rad = o.joint_rad.iter().zip(&self.offset).map(|(q, offset)| q + offset).collect();
        Observation { joint_rad, reference: Reference::position(tip_m), ..o.clone() }
    }

    /// Where the nominal arm with the offsets has what an observation is of, in the world [m].
    pub fn tip_in_world(&self, nominal: &Model, o: &Observation) -> Vector3<f64> {
        nominal.predicted_tip_in_world(&self.values, &self.read(o, Vector3::zeros()))
    }

    /// The file, of the joints of an arm.
    pub fn yaml(&self, skeleton: &Skeleton) -> String {
        let mut text = format!(
            "# armcal.joint-zeros/1\n# Offsets of the joints of \"{}\", in rad, of sliding joints in m:\n\
             #   true reading = reading + offset\n\
             # ros2_control: add it to <offset> of the joint's transmission (joint = actuator / reduction + offset).\n\
             # URDF: add it to <calibration rising=\"...\"/> of the joint (the reading at which its flag rises).\n\
             # Fitted with nominal lengths and angles: not the zeros of parameters.toml, which go with calibrated ones.\n\
             joint_offsets:\n",
            skeleton.name.replace(char::is_control, "_")
        );
        for bone in &skeleton.joints {
            let Some(moving) = bone.moves.as_ref().filter(|moving| moving.follows.is_none()) else {
                continue;
            };
            // A string of JSON is one of YAML.
            let name = serde_json::Value::from(bone.name.as_str());
            text += &format!("  {name}: {}\n", yaml_number(self.offset[moving.reading]));
        }
        text
    }
}

/// The shortest solution of `normal x = towards`.
fn minimum_norm_solution(normal: DMatrix<f64>, towards: &DVector<f64>) -> DVector<f64> {
    let eigen = SymmetricEigen::new(normal);
    let most = eigen.eigenvalues.amax();
    let mut x = DVector::zeros(towards.len());
    for (value, direction) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if *value > UNSEEN * most {
            x += direction * (direction.dot(towards) / value);
        }
    }
    x
}
