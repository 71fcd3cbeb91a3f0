//! Seen from a joint: by how much it alone would have to be off for the tip to be where it was measured.
//!
//! ```text
//! error_j = J_j' C^-1 r / (J_j' C^-1 J_j),   sigma_j = (J_j' C^-1 J_j)^(-1/2)
//! ```
//!
//! with `r` measured minus predicted, `J_j` the derivative of the predicted tip by joint `j`, `C` the covariance of `r`:
//! weighted least squares with one unknown. Plotted against what may drive an error (the joint's angle by direction of
//! arrival, its torque, time) this is where an effect shows its shape: two branches for play, a sine for an eccentric
//! gear, a line over torque for compliance. Each joint explains the residual as if it were alone, so an error of one
//! joint also appears, weaker, in the others that can move the tip the same way.

use crate::PositionNoise;
use armcal_core::Observation;
use armcal_model::Model;
use nalgebra::Vector3;

/// A joint that moves the tip by less than this does not move it: rounding [m/rad] (prismatic: [m/m]).
const NO_LEVER: f64 = 1e-9;

/// Where a joint's implied error is this many times as uncertain as usual (median), the dwell says nothing about it.
pub const BLURRED: f64 = 4.0;

/// What one dwell says about one joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImpliedError {
    /// The link is further in +q than model and encoder say, by this much [rad] (prismatic: [m]).
    pub error: f64,
    /// Its standard deviation from the declared noise: large where the joint hardly moves the tip.
    pub sigma: f64,
}

/// The error of each joint that best explains one residual, in the order of the model's joints.
///
/// `p` is the model's parameter vector, `residual_m` measured minus predicted position in the world [m], which need not
/// be that of `p`: a held-out observation's is predicted by the fit that never saw it. `None` for a joint that does not
/// move the tip in this pose (its axis passes through it), or where something is not a number.
pub fn implied_joint_errors(
    model: &Model,
    p: &[f64],
    o: &Observation,
    residual_m: &Vector3<f64>,
) -> Vec<Option<ImpliedError>> {
    let jacobian = model.joint_jacobian(p, o);
    let noise = PositionNoise::of(model, p, o);
    let of_joint = |column: Vector3<f64>| {
        if column.norm() < NO_LEVER {
            return None;
        }
        let weighed = noise.as_ref()?.weigh(&column);
        let information = weighed.dot(&column);
        let error = weighed.dot(residual_m) / information;
        let sigma = information.sqrt().recip();
        (error.is_finite() && sigma.is_finite()).then_some(ImpliedError { error, sigma })
    };
    jacobian.column_iter().map(|column| of_joint(column.into_owned())).collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may stop")]
mod tests {
    use super::*;
    use armcal_core::{DwellId, Reference};
    use armcal_model::{Chain, Frames};
    use nalgebra::Matrix3;

    /// A planar arm of two links and a wrist that turns about its own axis, through the tip.
    fn planar_arm() -> Model {
        let row = |name: &str, a_mm: f64| {
            format!(
                "[[rows]]\nname = \"{name}\"\ntheta_deg = 0.0\nd_mm = 0.0\na_mm = {a_mm:.1}\nalpha_deg = 0.0\n"
            )
        };
        let rows = [("joint1", 400.0), ("joint2", 300.0), ("wrist", 0.0)].map(|(name, a_mm)| row(name, a_mm));
        let text = format!("name = \"planar\"\n{}", rows.concat());
        let chain = Chain::from_dh_toml(&text, std::path::Path::new("arm.toml")).unwrap();
        Model::new(chain, Frames::of_bare_arm()).unwrap()
    }

    fn seen(joint_rad: &[f64], position_m: Vector3<f64>) -> Observation {
        let id = DwellId { recording: 0, dwell: 0 };
        Observation {
            covariance_m2: Matrix3::from_diagonal_element(1e-8),
            ..Observation::bare(id, joint_rad.to_vec(), Reference::position(position_m))
        }
    }

    /// Where the planar arm's tip is, by trigonometry.
    fn tip_m(q: [f64; 2]) -> Vector3<f64> {
        let elbow = Vector3::new(0.4 * q[0].cos(), 0.4 * q[0].sin(), 0.0);
        elbow + Vector3::new(0.3 * (q[0] + q[1]).cos(), 0.3 * (q[0] + q[1]).sin(), 0.0)
    }

    #[test]
    fn an_offset_is_seen_in_its_joint_and_projected_into_the_others() {
        let model = planar_arm();
        let p = model.nominal();
        for q in [[0.3, 0.9], [-1.2, 2.0], [2.5, -0.4]] {
            let offset_rad = 2e-4;
            let o = seen(&[q[0], q[1], 0.7], tip_m([q[0], q[1] + offset_rad]));
            let residual_m = model.residual(&p, &o).position_m;
            let implied = implied_joint_errors(&model, &p, &o, &residual_m);
            let second = implied[1].unwrap();
            assert!((second.error - offset_rad).abs() < 1e-7, "{second:?}");
            // 0.1 mm at a lever of 300 mm.
            assert!((second.sigma - 1e-4 / 0.3).abs() < 1e-9, "{second:?}");
            // Alone, joint 1 explains the share of the displacement that points its way.
            let lever = Vector3::z().cross(&tip_m(q));
            let expected = lever.dot(&residual_m) / lever.norm_squared();
            assert!((implied[0].unwrap().error - expected).abs() < 1e-9, "{implied:?}");
            assert_eq!(implied[2], None, "the wrist does not move the tip");
        }
    }

    #[test]
    fn what_is_not_a_number_implies_nothing() {
        let model = planar_arm();
        let o = seen(&[0.1, 0.2, 0.3], Vector3::repeat(f64::NAN));
        let residual_m = model.residual(&model.nominal(), &o).position_m;
        assert_eq!(implied_joint_errors(&model, &model.nominal(), &o, &residual_m), [None; 3]);
    }
}
