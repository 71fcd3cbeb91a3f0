//! Planned paths: Cartesian cubic splines through waypoints (the paper's eq. 3).
//!
//! Each section is `s(t) = a0 + a1 t + a2 t^2 + a3 t^3` with position and velocity given at both ends.

use nalgebra::Vector3;

/// A path through waypoints, at rest at both ends.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    sections: Vec<Section>,
}

/// One section between two waypoints.
#[derive(Debug, Clone, PartialEq)]
pub struct Section {
    coefficients: [Vector3<f64>; 4],
    duration_s: f64,
}

impl Section {
    /// Solves the four end conditions: position [m] and velocity [m/s] at either end.
    pub fn new(position_m: [Vector3<f64>; 2], velocity_m_s: [Vector3<f64>; 2], duration_s: f64) -> Section {
        let ([p0, p1], [v0, v1], t) = (position_m, velocity_m_s, duration_s);
        let a2 = (p1 - p0) * (3.0 / (t * t)) - (v0 * 2.0 + v1) / t;
        let a3 = (p0 - p1) * (2.0 / (t * t * t)) + (v0 + v1) / (t * t);
        Section { coefficients: [p0, v0, a2, a3], duration_s }
    }

    /// Position at time `t_s` of the section [m].
    pub fn position(&self, t_s: f64) -> Vector3<f64> {
        let [a0, a1, a2, a3] = &self.coefficients;
        a0 + (a1 + (a2 + a3 * t_s) * t_s) * t_s
    }

    /// Velocity at time `t_s` of the section [m/s].
    pub fn velocity(&self, t_s: f64) -> Vector3<f64> {
        let [_, a1, a2, a3] = &self.coefficients;
        a1 + (a2 * 2.0 + a3 * (3.0 * t_s)) * t_s
    }
}

impl Path {
    /// A path through `waypoints_m` at about `speed_m_s`, never quicker than `shortest_s` for a section. The
    /// velocity at an inner waypoint is the mean velocity between its neighbours; the ends are at rest.
    pub fn through(waypoints_m: &[Vector3<f64>], speed_m_s: f64, shortest_s: f64) -> Path {
        let durations: Vec<f64> = waypoints_m
            .windows(2)
            // A cubic from rest to rest peaks at 1.5 times its mean speed.
            .map(|w| (1.5 * (w[1] - w[0]).norm() / speed_m_s).max(shortest_s))
            .collect();
        let velocity = |i: usize| {
            if i == 0 || i + 1 == waypoints_m.len() {
                return Vector3::zeros();
            }
            (waypoints_m[i + 1] - waypoints_m[i - 1]) / (durations[i - 1] + durations[i])
        };
        let sections = durations
            .iter()
            .enumerate()
            .map(|(i, &t)| {
                Section::new([waypoints_m[i], waypoints_m[i + 1]], [velocity(i), velocity(i + 1)], t)
            })
            .collect();
        Path { sections }
    }

    /// How long it takes [s].
    pub fn duration_s(&self) -> f64 {
        self.sections.iter().map(|section| section.duration_s).sum()
    }

    /// Position at time `t_s` of the path, its end afterwards [m]. `None` for a path without sections.
    pub fn position(&self, t_s: f64) -> Option<Vector3<f64>> {
        let mut rest_s = t_s;
        for section in &self.sections {
            if rest_s < section.duration_s {
                return Some(section.position(rest_s.max(0.0)));
            }
            rest_s -= section.duration_s;
        }
        self.sections.last().map(|last| last.position(last.duration_s))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn vector() -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-1.0..1.0f64).prop_map(Vector3::from)
    }

    proptest! {
        #[test]
        fn a_section_meets_its_end_conditions(
            p in prop::array::uniform2(vector()), v in prop::array::uniform2(vector()), t in 0.1..5.0f64,
        ) {
            let section = Section::new(p, v, t);
            prop_assert!((section.position(0.0) - p[0]).norm() < 1e-12);
            prop_assert!((section.velocity(0.0) - v[0]).norm() < 1e-12);
            prop_assert!((section.position(t) - p[1]).norm() < 1e-11);
            prop_assert!((section.velocity(t) - v[1]).norm() < 1e-10);
        }

        #[test]
        fn a_path_passes_its_waypoints_without_a_jump_in_velocity(points in prop::collection::vec(vector(), 2..6)) {
            let path = Path::through(&points, 0.3, 0.2);
            let mut t = 0.0;
            for (i, pair) in path.sections.windows(2).enumerate() {
                t += pair[0].duration_s;
                prop_assert!((path.position(t).unwrap() - points[i + 1]).norm() < 1e-9);
                let jump = pair[0].velocity(pair[0].duration_s) - pair[1].velocity(0.0);
                prop_assert!(jump.norm() < 1e-9);
            }
            prop_assert!(path.sections[0].velocity(0.0).norm() < 1e-12);
            prop_assert!((path.position(1e9).unwrap() - points[points.len() - 1]).norm() < 1e-9);
        }
    }
}
