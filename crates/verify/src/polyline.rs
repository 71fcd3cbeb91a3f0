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

    /// Its corners [m].
    pub fn points_m(&self) -> &[Vector3<f64>] {
        &self.points_m
    }

    /// Length [m].
    pub fn length_m(&self) -> f64 {
        self.points_m.windows(2).map(|piece| (piece[1] - piece[0]).norm()).sum()
    }

    /// The path with no more corners than it takes to stay within a distance of every point (Douglas and Peucker,
    /// Cartographica 10, 1973): the jitter of sampling is no corner.
    pub fn simplified(&self, within_m: f64) -> Polyline {
        let n = self.points_m.len();
        let mut kept = vec![false; n];
        (kept[0], kept[n - 1]) = (true, true);
        let mut open = vec![(0, n - 1)];
        while let Some((from, to)) = open.pop() {
            let away = |i: &usize| {
                let at = &self.points_m[*i];
                (at - nearest_on_segment(at, &self.points_m[from], &self.points_m[to])).norm()
            };
            let farthest = (from + 1..to).max_by(|a, b| away(a).total_cmp(&away(b)));
            if let Some(corner) = farthest.filter(|i| away(i) > within_m) {
                kept[corner] = true;
                open.extend([(from, corner), (corner, to)]);
            }
        }
        let points = self.points_m.iter().zip(kept).filter(|(_, kept)| *kept);
        Polyline { points_m: points.map(|(m, _)| *m).collect() }
    }

    /// Whether another path is nowhere further away than this, place by place: at every tenth of the length.
    pub fn is_like(&self, other: &Polyline, within_m: f64) -> bool {
        (self.length_m() - other.length_m()).abs() < within_m
            && (0..=10).all(|tenth| {
                let share = f64::from(tenth) / 10.0;
                (self.at(share) - other.at(share)).norm() < within_m
            })
    }

    /// The place at a share of the length, 0 to 1.
    fn at(&self, share: f64) -> Vector3<f64> {
        let mut left_m = share * self.length_m();
        for piece in self.points_m.windows(2) {
            let piece_m = (piece[1] - piece[0]).norm();
            if piece_m > 0.0 && left_m <= piece_m {
                return piece[0].lerp(&piece[1], left_m / piece_m);
            }
            left_m -= piece_m;
        }
        self.points_m[self.points_m.len() - 1]
    }

    /// Distance of a point from the nearest place of the path, as seen in a plane [m].
    pub fn distance_m(&self, point_m: &Vector3<f64>, plane: Plane) -> f64 {
        let at = plane.seen(point_m);
        let first = self.points_m.first().map_or(f64::INFINITY, |p| (at - plane.seen(p)).norm());
        let pieces = self.points_m.windows(2).map(|piece| [plane.seen(&piece[0]), plane.seen(&piece[1])]);
        pieces.map(|[from, to]| (at - nearest_on_segment(&at, &from, &to)).norm()).fold(first, f64::min)
    }
}

/// The point of a straight piece nearest to another point.
fn nearest_on_segment(at: &Vector3<f64>, from: &Vector3<f64>, to: &Vector3<f64>) -> Vector3<f64> {
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

    #[test]
    fn the_same_way_sampled_otherwise_is_like_and_another_is_not() {
        let line = |n: usize, end: f64| {
            let points = (0..=n).map(|i| Vector3::new(end * i as f64 / n as f64, 0.0, 0.0)).collect();
            Polyline::through(points).expect("points")
        };
        assert!(line(7, 1.0).is_like(&line(40, 1.0), 1e-6));
        assert!(!line(7, 1.0).is_like(&line(7, 1.01), 1e-3));
        let back = Polyline::through(vec![Vector3::x(), Vector3::zeros()]).expect("points");
        assert!(!line(7, 1.0).is_like(&back, 1e-3));
        assert!((line(7, 1.5).length_m() - 1.5).abs() < 1e-12);
    }

    #[test]
    fn jitter_is_no_corner_and_a_corner_is() {
        let jitter = |i: usize| if i.is_multiple_of(2) { 5e-5 } else { -5e-5 };
        let mut points: Vec<Vector3<f64>> =
            (0..=100).map(|i| Vector3::new(i as f64 * 1e-3, jitter(i), 0.0)).collect();
        points.extend((1..=100).map(|i| Vector3::new(0.1 + jitter(i), i as f64 * 1e-3, 0.0)));
        let path = Polyline::through(points).expect("points").simplified(2e-4);
        assert_eq!(path.points_m().len(), 3);
        assert!((path.points_m()[1] - Vector3::new(0.1, 0.0, 0.0)).norm() < 2e-4);
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
