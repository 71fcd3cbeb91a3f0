//! Rows of a DH table as CSV.
//!
//! An arm from a DH table keeps its rows, unless they have Hayati's beta, which no other table has a column for. Any other arm
//! gets standard rows `Rz(theta) Tz(d) Tx(a) Rx(alpha)`: each axis is a line, and the common normal of two lines that follow each
//! other is the row between them (Denavit and Hartenberg 1955). Axes that are nearly parallel meet their normal far away: `d` of
//! two rows is long then, and all its digits are needed. A row before the first joint brings the base to it, one behind the last
//! brings that to the end of the last link; both are left out where they are nothing.

use crate::{Format, FormatError};
use armcal_core::Pose;
use armcal_model::{DhRow, Motion, Moving, Place, Skeleton};
use nalgebra::{Point3, Unit, UnitQuaternion, Vector3};

/// Lines whose directions differ by less are parallel [rad]: at 1 m that is 10 nm.
const PARALLEL_RAD: f64 = 1e-8;
/// A row of less is nothing [m], [rad].
const NOTHING: f64 = 1e-13;
/// The header, by which the file is known for armcal's own.
pub const HEADER: [&str; 7] = ["joint", "type", "convention", "theta_deg", "d_mm", "a_mm", "alpha_deg"];

/// The rows of an arm in one convention, `standard` or `modified`.
#[derive(Debug, Clone, PartialEq)]
pub struct DhRows {
    /// The convention.
    pub convention: &'static str,
    /// The rows from base to the end of the last link; beta of each is zero.
    pub rows: Vec<DhRow>,
}

impl DhRows {
    /// The rows of the arm on the way to its tip: `own` where it came from such a table.
    ///
    /// # Errors
    /// Joints that follow others.
    pub fn of(
        skeleton: &Skeleton,
        tip: &Place,
        own: Option<(&'static str, Vec<DhRow>)>,
    ) -> Result<DhRows, FormatError> {
        match own {
            Some((convention, rows)) if rows.iter().all(|row| row.beta_rad == 0.0) => {
                Ok(DhRows { convention, rows })
            }
            _ => Ok(DhRows { convention: "standard", rows: by_normals(skeleton, tip)? }),
        }
    }

    /// The longest entry of a row [m].
    pub fn longest_m(&self) -> f64 {
        self.rows.iter().map(|row| row.d_m.abs().max(row.a_m.abs())).fold(0.0, f64::max)
    }

    /// The CSV.
    ///
    /// # Errors
    /// None but what the system refuses.
    pub fn csv(&self) -> Result<Vec<u8>, FormatError> {
        let mut out = csv::Writer::from_writer(Vec::new());
        out.write_record(HEADER)?;
        for row in &self.rows {
            let kind = match row.motion {
                Some(Motion::Revolute) => "revolute",
                Some(Motion::Prismatic) => "prismatic",
                None => "fixed",
            };
            let [theta, alpha] = [row.theta_rad, row.alpha_rad].map(f64::to_degrees);
            let numbers = [theta, row.d_m * 1e3, row.a_m * 1e3, alpha].map(|v| format!("{:?}", v + 0.0));
            let words = [row.name.as_str(), kind, self.convention];
            out.write_record(words.into_iter().chain(numbers.iter().map(String::as_str)))?;
        }
        out.into_inner().map_err(|e| csv::Error::from(e.into_error()).into())
    }
}

fn by_normals(skeleton: &Skeleton, tip: &Place) -> Result<Vec<DhRow>, FormatError> {
    let mut way: Vec<usize> = std::iter::successors(tip.on, |at| skeleton.joints[*at].parent).collect();
    way.reverse();
    let (mut end, mut lines) = (Pose::identity(), Vec::new());
    for bone in way.into_iter().map(|at| &skeleton.joints[at]) {
        end *= bone.origin;
        let Some(moving) = &bone.moves else { continue };
        if moving.follows.is_some() {
            let problem = format!("joint `{}` follows another one; urdf and mjcf can say that", bone.name);
            return Err(FormatError::CannotHold { format: Format::DhCsv, problem });
        }
        lines.push((bone.name.clone(), moving.motion, joint_line(&end, moving)));
    }
    end *= tip.link_end;
    let mut frame = Pose::identity();
    let mut rows = Vec::with_capacity(lines.len() + 2);
    let mut carried: Option<(String, Motion)> = None;
    let last = (
        String::new(),
        Motion::Revolute,
        (Point3::from(end.translation.vector), end.rotation * Vector3::z()),
    );
    for (name, motion, line) in lines.into_iter().chain([last]) {
        let row = common_normal_row(&frame, &line);
        frame *= row_transform(&row);
        let (own, moves) = carried.map_or(("base".to_owned(), None), |(name, motion)| (name, Some(motion)));
        rows.push(DhRow { name: own, motion: moves, ..row });
        carried = Some((name, motion));
    }
    // The last frame lies on the right line; what is left is a turn about it and a shift along it.
    let rest = frame.inverse() * end;
    let x = rest.rotation * Vector3::x();
    rows.push(fixed_row("end", x.y.atan2(x.x), rest.translation.z, 0.0, 0.0));
    rows.retain(|row| row.motion.is_some() || !is_nothing(row));
    Ok(rows)
}

/// A point and the direction of a line.
type Line = (Point3<f64>, Vector3<f64>);

fn joint_line(joint: &Pose, moving: &Moving) -> Line {
    (Point3::from(joint.translation.vector), joint.rotation * moving.axis)
}

/// The row from a frame, along its z, to a frame whose z is the line.
fn common_normal_row(frame: &Pose, (point, direction): &Line) -> DhRow {
    let (p, v) = (frame.inverse_transform_point(point).coords, frame.inverse_transform_vector(direction));
    let across = Vector3::z().cross(&v);
    let (mut x, d_m) = match across.norm() > PARALLEL_RAD {
        // Where the line is nearest to z: (point + s v) - d z is along x, which is perpendicular to both.
        true => (across.normalize(), p.z - v.z * (p.xy().dot(&v.xy()) / v.xy().norm_squared())),
        // Any normal will do, and the one through the frame is the shortest.
        false => (Vector3::new(p.x, p.y, 0.0).try_normalize(NOTHING).unwrap_or_else(Vector3::x), 0.0),
    };
    if x.x < 0.0 {
        x = -x;
    }
    let alpha_rad = across.dot(&x).atan2(v.z);
    fixed_row("", x.y.atan2(x.x), d_m, p.dot(&x), alpha_rad)
}

fn fixed_row(name: &str, theta_rad: f64, d_m: f64, a_m: f64, alpha_rad: f64) -> DhRow {
    DhRow { name: name.to_owned(), motion: None, theta_rad, d_m, a_m, alpha_rad, beta_rad: 0.0 }
}

fn is_nothing(row: &DhRow) -> bool {
    [row.theta_rad, row.d_m, row.a_m, row.alpha_rad].iter().all(|v| v.abs() < NOTHING)
}

/// `Rz(theta) Tz(d) Tx(a) Rx(alpha)`.
fn row_transform(row: &DhRow) -> Pose {
    let turn = |axis: Unit<Vector3<f64>>, rad: f64| UnitQuaternion::from_axis_angle(&axis, rad);
    let (s, c) = row.theta_rad.sin_cos();
    let at = Vector3::new(row.a_m * c, row.a_m * s, row.d_m);
    Pose::from_parts(
        at.into(),
        turn(Vector3::z_axis(), row.theta_rad) * turn(Vector3::x_axis(), row.alpha_rad),
    )
}
