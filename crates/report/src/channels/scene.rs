//! What the 3D panel shows: boards, points, exaggerated error arrows, and both arms dwell by dwell.

use super::shapes::{Rgba, arrow, disc, entity, line_strip, note, sphere, text};
use super::{Messages, start_ns, timestamp};
use crate::points::Point;
use crate::run::Run;
use armcal_core::{Dwell, Pose};
use foxglove::messages as fox;
use nalgebra::{Translation3, Vector3};

const GREY: Rgba = [0.62, 0.62, 0.62, 0.6];
const GREEN: Rgba = [0.15, 0.65, 0.35, 0.9];
const WHITE: Rgba = [0.95, 0.95, 0.95, 1.0];
const HELD_OUT: Rgba = [0.25, 0.50, 0.95, 1.0];
const BOARD: Rgba = [0.80, 0.78, 0.70, 1.0];

/// Longest arrow worth drawing beside an arm [m]; the 95th percentile of a set is kept below.
const LONG_ARROW_M: f64 = 0.05;
const ARROW_THICKNESS_M: f64 = 0.0015;
const CAVITY_DIAMETER_M: f64 = 0.008;
const TEXT_HEIGHT_M: f64 = 0.012;

/// Board, points and errors of one recording; replaces those of the recording before.
pub(super) fn standing(run: &Run, recording: usize, own: &[&Point], all: &[Point], out: &mut Messages) {
    let time_ns = start_ns(&run.recordings[recording]);
    let drawing = Drawing::of(run, all);
    let mut entities = Vec::new();
    entities.extend(board(run, recording, time_ns));
    entities.push(measured_points(own, time_ns));
    entities.push(drawing.arrows("errors/nominal", time_ns, drawing.nominal_factor, own, |p| {
        (p.nominal_measured_m, p.residual.nominal_m)
    }));
    entities.push(drawing.arrows("errors/calibrated", time_ns, drawing.fitted_factor, own, |p| {
        (p.measured_m, p.residual.fitted_m)
    }));
    entities.extend(drawing.legend(own, time_ns));
    let deletions = vec![fox::SceneEntityDeletion {
        timestamp: Some(timestamp(time_ns)),
        r#type: fox::scene_entity_deletion::Type::All as i32,
        id: String::new(),
    }];
    out.put("/armcal/scene", time_ns, &fox::SceneUpdate { deletions, entities });
}

/// Both arms during one dwell, and the tip as it was measured.
pub(super) fn arms(run: &Run, dwell: &Dwell, own: &[&Point], out: &mut Messages) {
    if dwell.joint_rad.len() != run.model.joint_count() {
        return;
    }
    let time_ns = dwell.mid_ns();
    let fitted = run.calibration.fit.values();
    let mut entities = vec![
        arm(run, "arm/nominal", &run.calibration.nominal_values, GREY, dwell),
        arm(run, "arm/calibrated", &fitted, GREEN, dwell),
    ];
    let observed = own.iter().find(|p| p.observation.dwell == dwell.id).map(|p| p.measured_m);
    let mut measured = entity("tip/measured", time_ns);
    if let Some(tip_m) = observed.or(dwell.tip.as_ref().map(|t| t.position_m)) {
        measured.spheres.push(sphere(&tip_m, 0.008, WHITE));
    }
    entities.push(measured);
    out.put("/armcal/arms", time_ns, &fox::SceneUpdate { deletions: Vec::new(), entities });
}

/// Links as lines, joints as spheres, the predicted tip as a smaller one.
fn arm(run: &Run, id: &str, p: &[f64], rgba: Rgba, dwell: &Dwell) -> fox::SceneEntity {
    let world_from_base = run.model.base_in_world(p);
    let frames = run.model.link_frames_in_base(p, &dwell.joint_rad);
    let places_m: Vec<Vector3<f64>> =
        frames.iter().map(|(_, frame)| (world_from_base * frame).translation.vector).collect();
    let mut arm = entity(id, dwell.mid_ns());
    arm.lines.push(line_strip(&places_m, 0.006, rgba));
    if let Some((tip_m, joints_m)) = places_m.split_last() {
        arm.spheres.extend(joints_m.iter().map(|joint_m| sphere(joint_m, 0.025, rgba)));
        arm.spheres.push(sphere(tip_m, 0.006, rgba));
    }
    arm
}

/// The cavities at the calibrated pose of the (tilted) board.
fn board(run: &Run, recording: usize, time_ns: i64) -> Option<fox::SceneEntity> {
    let board = run.board.as_ref()?;
    let world_from_board = run.model.board_in_world(&run.calibration.fit.values(), recording)?;
    let mut entity = entity("board", time_ns);
    entity.metadata.push(note("board", &board.name));
    entity.metadata.push(note("recording", &run.recordings[recording].name));
    for cavity in &board.cavities {
        let place = world_from_board * Pose::from(Translation3::from(cavity.in_board_m));
        entity.cylinders.push(disc(&place, CAVITY_DIAMETER_M, 0.001, BOARD));
        let above_m = place * nalgebra::Point3::new(0.0, 0.0, 0.01);
        entity.texts.push(text(&above_m.coords, 0.004, BOARD, cavity.name.clone()));
    }
    Some(entity)
}

/// Where the tip was measured; held-out points in blue.
fn measured_points(own: &[&Point], time_ns: i64) -> fox::SceneEntity {
    let mut entity = entity("points", time_ns);
    entity.spheres.extend(own.iter().filter(|p| p.measured_m.iter().all(|x| x.is_finite())).map(|p| {
        let rgba = if p.residual.held_out { HELD_OUT } else { WHITE };
        sphere(&p.measured_m, 0.003, rgba)
    }));
    entity
}

/// How errors of this run are drawn: the same for all its recordings.
struct Drawing {
    nominal_factor: f64,
    fitted_factor: f64,
    /// Error drawn in green [m].
    small_m: f64,
    /// Error drawn in red [m].
    large_m: f64,
}

impl Drawing {
    fn of(run: &Run, all: &[Point]) -> Drawing {
        let nominal_m: Vec<f64> = all.iter().map(|p| p.residual.nominal_m.norm()).collect();
        let fitted_m: Vec<f64> = all.iter().map(|p| p.residual.fitted_m.norm()).collect();
        let positive = |x: f64| if x.is_finite() && x > 0.0 { x } else { 1e-6 };
        let small_m = positive(run.calibration.noise_floor_m);
        let p95_m = |norms_m: &[f64]| positive(armcal_core::robust::percentile(norms_m, 0.95));
        Drawing {
            nominal_factor: exaggeration(p95_m(&nominal_m)),
            fitted_factor: exaggeration(p95_m(&fitted_m)),
            small_m,
            large_m: p95_m(&nominal_m).max(10.0 * small_m),
        }
    }

    /// Arrows from where the tip was towards where the model puts it; `error` gives the place and measured minus
    /// predicted.
    fn arrows(
        &self,
        id: &str,
        time_ns: i64,
        factor: f64,
        own: &[&Point],
        error: impl Fn(&Point) -> (Vector3<f64>, Vector3<f64>),
    ) -> fox::SceneEntity {
        let mut entity = entity(id, time_ns);
        entity.metadata.push(note("exaggeration", factor));
        entity.arrows.extend(own.iter().filter_map(|p| {
            let (measured_m, error_m) = error(p);
            arrow(&measured_m, &(-error_m * factor), ARROW_THICKNESS_M, self.ramp(error_m.norm()))
        }));
        entity
    }

    /// Green at the noise floor, yellow between, red at the large nominal errors; logarithmic.
    fn ramp(&self, error_m: f64) -> Rgba {
        let t = ((error_m / self.small_m).ln() / (self.large_m / self.small_m).ln()).clamp(0.0, 1.0);
        if t < 0.5 { [2.0 * t, 0.75, 0.15, 1.0] } else { [1.0, 1.5 * (1.0 - t), 0.15, 1.0] }
    }

    /// The scale in words, above the points.
    fn legend(&self, own: &[&Point], time_ns: i64) -> Option<fox::SceneEntity> {
        let seen: Vec<&Vector3<f64>> =
            own.iter().map(|p| &p.measured_m).filter(|m| m.iter().all(|x| x.is_finite())).collect();
        let mut place_m = seen.iter().copied().sum::<Vector3<f64>>() / seen.len() as f64;
        place_m.z = seen.iter().map(|m| m.z).reduce(f64::max)? + 0.1;
        let words = format!(
            "arrows: from the measured tip towards the predicted one\n\
             nominal errors x {}, calibrated errors x {}\n\
             green {} mm, red {} mm and more; blue points are held out",
            self.nominal_factor,
            self.fitted_factor,
            crate::text::millimetres(self.small_m),
            crate::text::millimetres(self.large_m)
        );
        let mut legend = entity("scale", time_ns);
        legend.texts.push(text(&place_m, TEXT_HEIGHT_M, WHITE, words));
        Some(legend)
    }
}

/// The largest of 1, 2, 5, 10, ... 10000 that keeps an error of this size below [`LONG_ARROW_M`].
fn exaggeration(error_m: f64) -> f64 {
    const LADDER: [f64; 13] = [10e3, 5e3, 2e3, 1e3, 500.0, 200.0, 100.0, 50.0, 20.0, 10.0, 5.0, 2.0, 1.0];
    LADDER.into_iter().find(|factor| factor * error_m <= LONG_ARROW_M).unwrap_or(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exaggeration_is_a_round_number_that_fits() {
        assert_eq!(exaggeration(0.0213), 2.0);
        assert_eq!(exaggeration(0.000_3), 100.0);
        assert_eq!(exaggeration(0.2), 1.0);
        assert_eq!(exaggeration(1e-12), 10_000.0);
    }

    #[test]
    fn colours_go_from_green_to_red() {
        let drawing = Drawing { nominal_factor: 1.0, fitted_factor: 1.0, small_m: 1e-4, large_m: 1e-2 };
        let (green, red) = (drawing.ramp(0.0), drawing.ramp(1.0));
        assert!(green[0] < 0.1 && green[1] > 0.7);
        assert!(red[0] > 0.9 && red[1] < 0.1);
        assert_eq!(drawing.ramp(1e-3)[0], 1.0);
    }
}
