//! What stands and moves in the 3D panel: board and points of a recording, and both arms dwell by dwell.

use super::arrows::{Drawing, delete_all};
use super::shapes::{Rgba, billboard_text, disc, key_value, line_strip, plate, scene_entity, sphere};
use super::{Messages, start_ns};
use armcal_core::{Dwell, Pose};
use armcal_model::Model;
use armcal_result::{Point, Run, extent};
use armcal_table::Cavity;
use foxglove::messages as fox;
use nalgebra::{Translation3, Vector3};

/// Nominal arms.
pub(super) const GREY: Rgba = [0.62, 0.62, 0.62, 0.6];
/// Calibrated arms.
pub(super) const GREEN: Rgba = [0.15, 0.65, 0.35, 0.9];
const WHITE: Rgba = [0.95, 0.95, 0.95, 1.0];
const HELD_OUT: Rgba = [0.25, 0.50, 0.95, 1.0];
pub(super) const PLATE: Rgba = [0.45, 0.45, 0.50, 0.5];
pub(super) const CAVITY: Rgba = [0.80, 0.78, 0.70, 1.0];

pub(super) const CAVITY_DIAMETER_M: f64 = 0.008;
/// The plate under the cavities: thickness, and how far it reaches beyond them.
const PLATE_M: f64 = 0.004;
const PLATE_MARGIN_M: f64 = 0.02;

/// Board, points and scale of one recording; replaces those of the recording before.
pub(super) fn put_standing(
    run: &Run,
    recording: usize,
    own: &[&Point],
    drawing: &Drawing,
    out: &mut Messages,
) {
    let time_ns = start_ns(&run.recordings[recording]);
    let mut entities = Vec::new();
    entities.extend(board_entity(run, recording, time_ns));
    entities.push(measured_points(own, time_ns));
    entities.extend(drawing.legend(time_ns));
    out.put("/armcal/scene", time_ns, &fox::SceneUpdate { deletions: vec![delete_all(time_ns)], entities });
}

/// Both arms in the pose of a dwell, and the tip as it was measured.
pub(super) fn put_arms(run: &Run, dwell: &Dwell, own: &[&Point], time_ns: i64, out: &mut Messages) {
    let fitted = run.calibration.fit.values();
    let drawn = |id: &str, p: &[f64], rgba: Rgba| {
        let (model, p) = run.model.in_recording(dwell.id.recording, p);
        arm_entity(id, model, &p, rgba, time_ns, &dwell.joint_rad)
    };
    let nominal = &run.calibration.nominal_values;
    let mut entities = vec![drawn("arm/nominal", nominal, GREY), drawn("arm/calibrated", &fitted, GREEN)];
    let of_tip = |p: &&&Point| p.observation.dwell == dwell.id && p.observation.feature.is_tip();
    let observed = own.iter().find(of_tip).map(|p| p.measured_m);
    let mut measured = scene_entity("tip/measured", time_ns);
    if let Some(tip_m) = observed.or(dwell.tip.as_ref().map(|t| t.position_m)) {
        measured.spheres.push(sphere(&tip_m, 0.008, WHITE));
    }
    entities.push(measured);
    out.put("/armcal/arms", time_ns, &fox::SceneUpdate { deletions: Vec::new(), entities });
}

/// Links as lines, joints as spheres, predicted tips as smaller ones.
fn arm_entity(
    id: &str,
    model: &Model,
    p: &[f64],
    rgba: Rgba,
    time_ns: i64,
    joint_rad: &[f64],
) -> fox::SceneEntity {
    let world_from_base = model.base_in_world(p);
    let frames = model.link_frames(p, joint_rad);
    let places_m: Vec<Vector3<f64>> =
        frames.iter().map(|frame| (world_from_base * frame.in_base).translation.vector).collect();
    let mut arm = scene_entity(id, time_ns);
    // One line as long as each frame hangs on the one before it.
    let mut line: Vec<usize> = Vec::new();
    let mut draw = |line: &[usize]| {
        let places_m: Vec<Vector3<f64>> = line.iter().map(|k| places_m[*k]).collect();
        arm.lines.extend((places_m.len() > 1).then(|| line_strip(&places_m, 0.006, rgba)));
    };
    for (k, frame) in frames.iter().enumerate() {
        if k > 0 && frame.parent != Some(k - 1) {
            draw(&line);
            line = frame.parent.into_iter().collect();
        }
        line.push(k);
    }
    draw(&line);
    let is_end = |k: &usize| !frames.iter().any(|frame| frame.parent == Some(*k));
    let (ends, joints): (Vec<usize>, Vec<usize>) = (0..frames.len()).partition(is_end);
    arm.spheres.extend(joints.iter().map(|k| sphere(&places_m[*k], 0.025, rgba)));
    arm.spheres.extend(ends.iter().map(|k| sphere(&places_m[*k], 0.006, rgba)));
    arm
}

/// Plate and cavities at the calibrated pose of the (tilted) board.
fn board_entity(run: &Run, recording: usize, time_ns: i64) -> Option<fox::SceneEntity> {
    let board = run.board.as_ref()?;
    let world_from_board = run.model.board_in_world(&run.calibration.fit.values(), recording)?;
    let mut entity = scene_entity("board", time_ns);
    entity.metadata.push(key_value("board", &board.name));
    entity.metadata.push(key_value("recording", &run.recordings[recording].name));
    entity.cubes.extend(base_plate(&board.cavities, &world_from_board));
    for cavity in &board.cavities {
        let place = world_from_board * Pose::from(Translation3::from(cavity.in_board_m));
        entity.cylinders.push(disc(&place, CAVITY_DIAMETER_M, 0.001, CAVITY));
        let above_m = place * nalgebra::Point3::new(0.0, 0.0, 0.01);
        entity.texts.push(billboard_text(&above_m.coords, 0.004, CAVITY, cavity.name.clone()));
    }
    Some(entity)
}

fn base_plate(cavities: &[Cavity], world_from_board: &Pose) -> Option<fox::CubePrimitive> {
    let (in_board, size_m) = plate_of(cavities)?;
    Some(plate(&(world_from_board * in_board), &size_m, PLATE))
}

/// A plate under the cavities, below the lowest: its centre in the frame of the board, and its sides [m].
pub(super) fn plate_of(cavities: &[Cavity]) -> Option<(Pose, Vector3<f64>)> {
    let (low, high) = extent(cavities.iter().map(|c| c.in_board_m))?;
    let mut centre = (low + high) / 2.0;
    centre.z = low.z - PLATE_M;
    let size_m = (high - low + Vector3::repeat(2.0 * PLATE_MARGIN_M)).xy().push(PLATE_M);
    Some((Pose::from(Translation3::from(centre)), size_m))
}

/// Where the tip was measured; held-out points in blue.
fn measured_points(own: &[&Point], time_ns: i64) -> fox::SceneEntity {
    let mut entity = scene_entity("points", time_ns);
    entity.spheres.extend(own.iter().filter(|p| p.measured_m.iter().all(|x| x.is_finite())).map(|p| {
        let rgba = if p.residual.held_out { HELD_OUT } else { WHITE };
        sphere(&p.measured_m, 0.003, rgba)
    }));
    entity
}
