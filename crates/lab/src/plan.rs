//! What a recording will do: the order of the cavities and the free poses, before anything moves.

use crate::LabError;
use crate::arm::AxisArm;
use crate::config::{FreeConfig, LabConfig, Order, TaskConfig};
use crate::random::{Purpose, Stream};
use crate::rig::{BoardPlace, Rig};
use nalgebra::Vector3;

/// The programme of one recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Waypoints of the fast path, nominal, base frame [m].
    pub sweep_m: Vec<Vector3<f64>>,
    /// Visits, in order.
    pub visits: Vec<Visit>,
    /// Free poses, as joint angles [rad].
    pub free_rad: Vec<Vec<f64>>,
}

/// One visit to a cavity.
#[derive(Debug, Clone, PartialEq)]
pub struct Visit {
    /// Index of the cavity.
    pub cavity: usize,
    /// Index of the pass.
    pub pass: usize,
}

impl Plan {
    /// Draws the programme of a recording.
    pub fn draw(
        config: &LabConfig,
        rig: &Rig,
        place: &BoardPlace,
        recording: usize,
    ) -> Result<Plan, LabError> {
        let mut draw = Stream::new(config.seed, Purpose::Task, 2 * recording);
        let visits = draw_visits(&config.task, rig.board.cavities.len(), &mut draw);
        // A stream of its own, so that another number of visits leaves the free poses as they were.
        let mut draw = Stream::new(config.seed, Purpose::Task, 2 * recording + 1);
        let sweep_m = draw_sweep(config.task.sweep.points, place, &mut draw);
        let free_rad = free_poses(&config.task.free, &rig.nominal, place, &mut draw).map_err(|found| {
            LabError::NoFreePose {
                recording: config.recordings[recording].name.clone(),
                found,
                wanted: config.task.free.poses,
            }
        })?;
        Ok(Plan { sweep_m, visits, free_rad })
    }
}

fn draw_visits(task: &TaskConfig, cavities: usize, draw: &mut Stream) -> Vec<Visit> {
    let mut visits = Vec::new();
    for (pass, config) in task.passes.iter().enumerate() {
        let mut order: Vec<usize> = (0..cavities).collect();
        match config.order {
            Order::Forward => {}
            Order::Backward => order.reverse(),
            Order::Random => draw.shuffle(&mut order),
        }
        order.truncate((config.share * cavities as f64).round() as usize);
        order.retain(|_| !draw.chance(task.skip_share));
        let mut i = 1;
        while i < order.len() {
            if draw.chance(task.swap_share) {
                order.swap(i - 1, i);
                i += 1;
            }
            i += 1;
        }
        visits.extend(order.into_iter().map(|cavity| Visit { cavity, pass }));
    }
    visits
}

/// Waypoints 80 to 200 mm above the board, spread over it.
fn draw_sweep(points: usize, place: &BoardPlace, draw: &mut Stream) -> Vec<Vector3<f64>> {
    let mut waypoint = || {
        let across =
            Vector3::new(draw.uniform([-0.1, 0.1]), draw.uniform([-0.18, 0.18]), draw.uniform([0.08, 0.2]));
        place.base_from_board * nalgebra::Point3::from(across)
    };
    (0..points).map(|_| waypoint().coords).collect()
}

/// Poses within the joint ranges whose tip keeps clear of the board, of the floor and of the arm's own axis;
/// each next one is the nearest left, so that the paths between them are short. `Err` is how many were found.
fn free_poses(
    free: &FreeConfig,
    nominal: &AxisArm,
    place: &BoardPlace,
    draw: &mut Stream,
) -> Result<Vec<Vec<f64>>, usize> {
    let mut poses: Vec<Vec<f64>> = Vec::new();
    for _ in 0..1000 * free.poses {
        if poses.len() == free.poses {
            break;
        }
        let pose: Vec<f64> = free.range_deg.iter().map(|range| draw.uniform(*range).to_radians()).collect();
        if keeps_clear(&nominal.tip(&pose), place) {
            poses.push(pose);
        }
    }
    if poses.len() < free.poses {
        return Err(poses.len());
    }
    for done in 1..poses.len() {
        let distance = |pose: &[f64]| -> f64 {
            pose.iter().zip(&poses[done - 1]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        let nearest =
            (done..poses.len()).min_by(|&a, &b| distance(&poses[a]).total_cmp(&distance(&poses[b])));
        poses.swap(done, nearest.unwrap_or(done));
    }
    Ok(poses)
}

fn keeps_clear(tip_m: &Vector3<f64>, place: &BoardPlace) -> bool {
    let on_board = place.base_from_board.inverse() * nalgebra::Point3::from(*tip_m);
    let beside_board = on_board.x.abs() > 0.25 || on_board.y.abs() > 0.30;
    tip_m.xy().norm() > 0.15 && if beside_board { tip_m.z > 0.05 } else { on_board.z > 0.12 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::PassConfig;

    #[test]
    fn passes_go_forward_backward_and_at_random() {
        let mut task = TaskConfig { skip_share: 0.0, swap_share: 0.0, ..TaskConfig::default() };
        task.passes.push(PassConfig { order: Order::Random, share: 0.3 });
        let mut draw = Stream::new(3, Purpose::Task, 0);
        let drawn = draw_visits(&task, 10, &mut draw);
        let of = |pass| drawn.iter().filter(|v| v.pass == pass).map(|v| v.cavity).collect::<Vec<_>>();
        assert_eq!(of(0), (0..10).collect::<Vec<_>>());
        assert_eq!(of(1), (0..10).rev().collect::<Vec<_>>());
        assert_eq!(of(2).len(), 3);
    }

    #[test]
    fn some_visits_are_skipped_and_some_swapped_but_none_doubled() {
        let task = TaskConfig { skip_share: 0.1, swap_share: 0.1, ..TaskConfig::default() };
        let mut draw = Stream::new(3, Purpose::Task, 0);
        let drawn = draw_visits(&task, 500, &mut draw);
        let mut forward: Vec<usize> = drawn.iter().filter(|v| v.pass == 0).map(|v| v.cavity).collect();
        assert!((420..480).contains(&forward.len()), "{}", forward.len());
        let swapped = forward.windows(2).filter(|w| w[0] > w[1]).count();
        assert!((20..80).contains(&swapped), "{swapped}");
        forward.sort_unstable();
        forward.dedup();
        assert_eq!(forward.len(), drawn.iter().filter(|v| v.pass == 0).count());
    }
}
