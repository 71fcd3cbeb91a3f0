//! The command path: a polyline of poses, dense where it is curved, measured by its arc length.

use crate::IsoError;
use crate::tip_pose::TipPose;
use nalgebra::{Unit, Vector3};

/// A command path with its arc length.
#[derive(Debug, Clone, PartialEq)]
pub struct CommandPath {
    points: Vec<TipPose>,
    along_m: Vec<f64>,
}

/// A measuring plane: it stands on the command path at `pose`, normal to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// The commanded pose on the plane.
    pub pose: TipPose,
    /// Direction of the command path: the plane's normal.
    pub normal: Unit<Vector3<f64>>,
    /// Arc length of the command path up to here [m].
    pub along_m: f64,
}

/// A corner of the command path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// The corner [m].
    pub position_m: Vector3<f64>,
    /// Direction in which the command arrives.
    pub arriving: Unit<Vector3<f64>>,
    /// Direction in which the command leaves.
    pub leaving: Unit<Vector3<f64>>,
    /// How far the command then goes straight [m].
    pub straight_m: f64,
}

/// A leg counts as straight up to here: a turn that a polyline of a circle exceeds, and rounding does not.
const STRAIGHT_RAD: f64 = 1e-3;

impl CommandPath {
    /// The path through `points`; points that coincide with the one before are left out.
    ///
    /// Fails where a point is not finite, or where all coincide.
    pub fn new(points: &[TipPose]) -> Result<CommandPath, IsoError> {
        if let Some(index) = points.iter().position(|p| !p.is_finite()) {
            return Err(IsoError::NotFinite { what: "points of the command path".into(), index });
        }
        let mut path = CommandPath { points: Vec::new(), along_m: Vec::new() };
        for point in points {
            let step_m = path.points.last().map(|last| (point.position_m - last.position_m).norm());
            if step_m != Some(0.0) {
                path.along_m.push(path.length_m() + step_m.unwrap_or(0.0));
                path.points.push(*point);
            }
        }
        if path.points.len() < 2 { Err(IsoError::NoLength) } else { Ok(path) }
    }

    /// Arc length [m].
    pub fn length_m(&self) -> f64 {
        self.along_m.last().copied().unwrap_or(0.0)
    }

    /// `count` planes at equal distances along the path, half a distance from its ends: at the very ends the arm is
    /// at rest and crosses nothing.
    pub fn planes(&self, count: usize) -> Vec<Plane> {
        (0..count).map(|i| self.plane(self.length_m() * (i as f64 + 0.5) / count as f64)).collect()
    }

    fn plane(&self, along_m: f64) -> Plane {
        let last = self.points.len() - 1;
        let end = self.along_m.partition_point(|&at| at <= along_m).clamp(1, last);
        let s = (along_m - self.along_m[end - 1]) / (self.along_m[end] - self.along_m[end - 1]);
        let pose = self.points[end - 1].towards(&self.points[end], s);
        Plane { pose, normal: self.direction(end - 1), along_m }
    }

    /// Direction of the straight piece that begins at point `from`.
    fn direction(&self, from: usize) -> Unit<Vector3<f64>> {
        Unit::new_normalize(self.points[from + 1].position_m - self.points[from].position_m)
    }

    /// The points at which the command turns by more than `least_rad` [rad].
    pub fn corners(&self, least_rad: f64) -> Vec<Corner> {
        let inner = 1..self.points.len() - 1;
        inner
            .filter(|&at| self.direction(at - 1).angle(&self.direction(at)) > least_rad)
            .map(|at| Corner {
                position_m: self.points[at].position_m,
                arriving: self.direction(at - 1),
                leaving: self.direction(at),
                straight_m: self.straight_m(at),
            })
            .collect()
    }

    /// How far the path goes straight from point `from` [m].
    fn straight_m(&self, from: usize) -> f64 {
        let pieces = from..self.points.len() - 1;
        let bend =
            pieces.into_iter().find(|&at| self.direction(from).angle(&self.direction(at)) > STRAIGHT_RAD);
        self.along_m[bend.unwrap_or(self.points.len() - 1)] - self.along_m[from]
    }

    /// The largest turn of the commanded orientation from that at the start [rad]; none where none is commanded.
    pub fn reorientation_rad(&self) -> Option<f64> {
        let turns_rad = self.points.iter().map(|p| p.turn_from_rad(&self.points[0]).map(|turn| turn.norm()));
        turns_rad.collect::<Option<Vec<_>>>().map(crate::stats::largest)
    }
}
