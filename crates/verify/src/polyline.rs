//! A path as a chain of straight pieces, and how far points lie from it.

use crate::plane::Plane;
use nalgebra::Vector3;

/// A path through points [m].
#[derive(Debug, Clone, PartialEq)]
pub struct Polyline {
    points_m: Vec<Vector3<f64>>,
}

impl Polyline {
    /// A path through at least one point; `None` without any.
    pub fn through(points_m: Vec<Vector3<f64>>) -> Option<Polyline> {
        (!points_m.is_empty()).then_some(Polyline { points_m })
    }

    /// Distance of a point from the nearest place of the path, as seen in a plane [m].
    pub fn distance_m(&self, point_m: &Vector3<f64>, plane: Plane) -> f64 {
        let at = plane.seen(point_m);
        let seen: Vec<Vector3<f64>> = self.points_m.iter().map(|p| plane.seen(p)).collect();
        let first = seen.first().map_or(f64::INFINITY, |p| (at - p).norm());
        seen.windows(2).map(|piece| (at - nearest(&at, &piece[0], &piece[1])).norm()).fold(first, f64::min)
    }
}

/// The point of a straight piece nearest to another point.
fn nearest(at: &Vector3<f64>, from: &Vector3<f64>, to: &Vector3<f64>) -> Vector3<f64> {
    let along = to - from;
    let length_square = along.norm_squared();
    if length_square == 0.0 {
        return *from;
    }
    from + along * ((at - from).dot(&along) / length_square).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_circle_is_as_far_from_its_centre_as_its_radius() {
        let circle: Vec<Vector3<f64>> = (0..=3600)
            .map(|i| (f64::from(i) * 0.1).to_radians())
            .map(|a| Vector3::new(a.cos(), a.sin(), 0.0))
            .collect();
        let path = Polyline::through(circle).expect("points");
        assert!((path.distance_m(&Vector3::zeros(), Plane::Space) - 1.0).abs() < 1e-5);
        let above = Vector3::new(1.0, 0.0, 0.4);
        assert!((path.distance_m(&above, Plane::Space) - 0.4).abs() < 1e-9);
        assert!(path.distance_m(&above, Plane::Xy) < 1e-9);
        // Seen along x the circle is the piece -1..1 of the y axis.
        assert!((path.distance_m(&above, Plane::Yz) - 0.4).abs() < 1e-9);
    }

    proptest! {
        #[test]
        fn no_sample_of_the_path_is_nearer_than_its_distance(
            points in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), 1..8),
            at in prop::array::uniform3(-2.0..2.0_f64),
        ) {
            let points: Vec<Vector3<f64>> = points.into_iter().map(Vector3::from).collect();
            let at = Vector3::from(at);
            let path = Polyline::through(points.clone()).expect("points");
            for plane in Plane::ALL {
                let distance_m = path.distance_m(&at, plane);
                let mut nearest_m = (plane.seen(&at) - plane.seen(&points[0])).norm();
                for piece in points.windows(2) {
                    for k in 0..=200 {
                        let on = piece[0].lerp(&piece[1], f64::from(k) / 200.0);
                        nearest_m = nearest_m.min((plane.seen(&at) - plane.seen(&on)).norm());
                    }
                }
                prop_assert!(distance_m <= nearest_m + 1e-12 && nearest_m <= distance_m + 0.02);
            }
        }
    }
}
