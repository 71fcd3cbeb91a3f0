//! The smooth field by which a wrong model displaces tips over the board.
//!
//! In board coordinates, with `v = u - centre`: `aligned = u + C^T [1, vx, vy, vz, vx^2, vx vy, vy^2]`.
//! A serial arm with wrong geometry moves its tip by a smooth function of where the tip is (one branch of
//! the inverse kinematics); over a board of 0.3 m, DH errors of 5 mm and 2 deg leave less than 0.1 mm
//! beyond these seven terms. Coefficients have independent normal priors of zero mean, which makes the
//! best ones a ridge regression, axis by axis.

use armcal_core::Pose;
use nalgebra::{Matrix3, SMatrix, SVector, UnitQuaternion, Vector3};

/// Standard deviations of the coefficients of the [`Field`].
#[derive(Clone, Copy)]
pub(super) struct Prior {
    pub offset_m: f64,
    pub slope: f64,
    pub curvature_per_m: f64,
}

const TERMS: usize = 7;
/// Stretch of heights, one standard deviation. Small: a field that may press all heights together would
/// turn hovering into seating.
const HEIGHT_STRETCH: f64 = 0.005;

type Terms = SVector<f64, TERMS>;

#[derive(Clone)]
pub(super) struct Field {
    /// Frame the field is added in: the board as first supposed.
    pub board_from_world: Pose,
    pub centre_m: Vector3<f64>,
    pub coefficients: SMatrix<f64, TERMS, 3>,
}

/// One pull on the field: where a tip is (board frame as supposed), where it should be, and how strongly,
/// beside the board's normal and along it [1/m^2].
pub(super) struct Pull {
    pub from_m: Vector3<f64>,
    pub to_m: Vector3<f64>,
    pub lateral: f64,
    pub normal: f64,
}

impl Field {
    pub fn none(board_from_world: Pose, centre_m: Vector3<f64>) -> Field {
        Field { board_from_world, centre_m, coefficients: SMatrix::zeros() }
    }

    /// Coordinates of a world point in the board as supposed.
    pub fn supposed_m(&self, world_m: &Vector3<f64>) -> Vector3<f64> {
        self.board_from_world.transform_point(&(*world_m).into()).coords
    }

    /// Coordinates of a world point on the board, the model's error removed.
    pub fn aligned_m(&self, world_m: &Vector3<f64>) -> Vector3<f64> {
        let u = self.supposed_m(world_m);
        u + self.coefficients.transpose() * self.terms(&u)
    }

    /// Adds a turn about the board's normal and a shift, in the board frame.
    pub fn turn_and_shift(&mut self, turn_rad: f64, shift_m: Vector3<f64>) {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn_rad).to_rotation_matrix();
        let slope = (turn.matrix() - Matrix3::identity()).transpose();
        let mut linear = self.coefficients.fixed_view_mut::<3, 3>(1, 0);
        linear += slope;
        let mut constant = self.coefficients.fixed_view_mut::<1, 3>(0, 0);
        constant += shift_m.transpose();
    }

    /// Adds a plane of heights, `a + b vx + c vy`.
    pub fn lift(&mut self, plane: [f64; 3]) {
        for (row, value) in [0, 1, 2].into_iter().zip(plane) {
            self.coefficients[(row, 2)] += value;
        }
    }

    /// Moves the supposed board so that all aligned points shift by `shift_m`.
    pub fn shift(&mut self, shift_m: Vector3<f64>) {
        let mut constant = self.coefficients.fixed_view_mut::<1, 3>(0, 0);
        constant += shift_m.transpose();
    }

    /// Replaces the coefficients by the best ones for `pulls`. Leaves them alone if the prior is degenerate.
    pub fn fit(&mut self, pulls: &[Pull], prior: &Prior) {
        let mut lateral = precision_matrix(Self::sigmas(prior, false));
        let mut normal = precision_matrix(Self::sigmas(prior, true));
        let mut target = SMatrix::<f64, TERMS, 3>::zeros();
        for pull in pulls {
            let terms = self.terms(&pull.from_m);
            let square = terms * terms.transpose();
            lateral += square * pull.lateral;
            normal += square * pull.normal;
            let gap = pull.to_m - pull.from_m;
            for (axis, weight) in [(0, pull.lateral), (1, pull.lateral), (2, pull.normal)] {
                let mut column = target.column_mut(axis);
                column += terms * (weight * gap[axis]);
            }
        }
        if let (Some(lateral), Some(normal)) = (lateral.cholesky(), normal.cholesky()) {
            for (axis, factor) in [(0, &lateral), (1, &lateral), (2, &normal)] {
                self.coefficients.set_column(axis, &factor.solve(&target.column(axis).into_owned()));
            }
        }
    }

    /// Logarithm of the prior density of the coefficients, without its constant.
    pub fn ln_prior(&self, prior: &Prior) -> f64 {
        let sigmas = [false, false, true].map(|normal| Self::sigmas(prior, normal));
        let whitened = |(i, c): (usize, &f64)| (c / sigmas[i / TERMS][i % TERMS]).powi(2);
        -0.5 * self.coefficients.iter().enumerate().map(whitened).sum::<f64>()
    }

    /// Prior of the terms, beside the normal or along it.
    fn sigmas(prior: &Prior, normal: bool) -> [f64; TERMS] {
        let (s, c) = (prior.slope, prior.curvature_per_m);
        [prior.offset_m, s, s, if normal { HEIGHT_STRETCH } else { s }, c, c, c]
    }

    fn terms(&self, u: &Vector3<f64>) -> Terms {
        let v = u - self.centre_m;
        Terms::from_column_slice(&[1.0, v.x, v.y, v.z, v.x * v.x, v.x * v.y, v.y * v.y])
    }
}

fn precision_matrix(sigmas: [f64; TERMS]) -> SMatrix<f64, TERMS, TERMS> {
    SMatrix::from_diagonal(&SVector::from(sigmas.map(|s| s.powi(-2))))
}
