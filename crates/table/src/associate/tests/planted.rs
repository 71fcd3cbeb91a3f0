//! Recordings with planted truth: an arm whose real geometry differs from the model visits a board by hand.
//! The arm's kinematics and its inverse are the tests' own.

use crate::associate::{BoardStart, DwellTip};
use crate::{Board, Tilt};
use armcal_core::{DwellId, Pose};
use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};
use rand::seq::SliceRandom as _;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use std::path::Path;

/// What really happened in a dwell.
#[derive(Debug, Clone, PartialEq)]
pub enum Truth {
    Seated(String),
    Hovering(String),
    Free,
}

/// A recording to be associated, and its truth.
pub struct Planted {
    pub board: Board,
    pub world_from_board: Pose,
    pub tips: Vec<DwellTip>,
    pub truth: Vec<Truth>,
    /// Where the tip really was, world frame [m].
    pub true_m: Vec<Vector3<f64>>,
}

/// How a recording is made.
pub struct Plan {
    /// Mean error of the nominal model over the board [m]; `None` leaves DH errors of 5 mm and 2 deg alone.
    pub mean_error_m: Option<f64>,
    /// Cavities visited, in order.
    pub visits: Vec<usize>,
    /// Share of the visits with a pause above the cavity before and after.
    pub hovering: f64,
    /// Poses far from the board.
    pub free: usize,
    /// Scatter of the predicted tip from dwell to dwell, per axis [m].
    pub scatter_m: f64,
    pub tilt: Tilt,
}

pub fn paper() -> Board {
    let text = include_str!("../../../../../pipelines/boards/paper.toml");
    Board::from_toml(text, Path::new("paper.toml")).unwrap()
}

pub fn mukca() -> Board {
    let text = include_str!("../../../../../pipelines/boards/mukca.toml");
    Board::from_toml(text, Path::new("mukca.toml")).unwrap()
}

/// The ways of visiting that labs use: forward, backward, there and back, at random, repeated.
pub fn visits(rng: &mut ChaCha8Rng, board: &Board) -> Vec<usize> {
    let skipped = rng.random_range(0.0..0.5);
    let kept: Vec<usize> = (0..board.cavities.len()).filter(|_| rng.random::<f64>() >= skipped).collect();
    let mut all = Vec::new();
    for _ in 0..rng.random_range(1..=3) {
        let mut pass = kept.clone();
        match rng.random_range(0..4) {
            0 => pass.reverse(),
            1 => pass.shuffle(rng),
            2 => pass.extend(kept.iter().rev()),
            _ => {}
        }
        all.extend(pass);
    }
    all
}

impl Plan {
    /// A plan drawn at random, hovering and free space included.
    pub fn random(rng: &mut ChaCha8Rng, board: &Board, mean_error_m: Option<f64>) -> Plan {
        let tilts = [(0.0, 0.0), (11.7, 0.0), (0.0, 11.8), (-11.7, 0.0), (0.0, -11.8)];
        let (roll, pitch): (f64, f64) = tilts[rng.random_range(0..tilts.len())];
        Plan {
            mean_error_m,
            visits: visits(rng, board),
            hovering: [0.0, 0.2, 0.6][rng.random_range(0..3)],
            free: rng.random_range(0..12),
            scatter_m: [0.0, 0.0005, 0.0015][rng.random_range(0..3)],
            tilt: Tilt { roll_rad: roll.to_radians(), pitch_rad: pitch.to_radians() },
        }
    }
}

impl Planted {
    pub fn new(rng: &mut ChaCha8Rng, board: Board, plan: &Plan) -> Planted {
        let placed = Isometry3::from_parts(
            Translation3::new(0.42 + rng.random_range(-0.02..0.02), rng.random_range(-0.03..0.03), 0.10),
            UnitQuaternion::from_euler_angles(0.0, 0.0, rng.random_range(-0.1..0.1)),
        );
        let world_from_board = placed * board.tilted(plan.tilt).unwrap();
        let mut stops: Vec<(Truth, Vector3<f64>)> = Vec::new();
        for &k in &plan.visits {
            let cavity = &board.cavities[k];
            let above = |rng: &mut ChaCha8Rng| {
                if rng.random::<f64>() >= plan.hovering {
                    return None;
                }
                let aside = Vector3::new(
                    rng.random_range(-1.5..1.5),
                    rng.random_range(-1.5..1.5),
                    rng.random_range(10.0..30.0),
                );
                Some((Truth::Hovering(cavity.name.clone()), cavity.in_board_m + aside * 1e-3))
            };
            stops.extend(above(rng));
            stops.push((Truth::Seated(cavity.name.clone()), cavity.in_board_m));
            stops.extend(above(rng));
        }
        for _ in 0..plan.free {
            let at = Vector3::new(
                rng.random_range(-0.2..0.15),
                rng.random_range(-0.25..0.25),
                rng.random_range(0.12..0.25),
            );
            stops.insert(rng.random_range(0..=stops.len()), (Truth::Free, at));
        }
        let true_m: Vec<Vector3<f64>> =
            stops.iter().map(|s| world_from_board.transform_point(&s.1.into()).coords).collect();
        let predicted_m = arms_view(rng, &true_m, plan);
        let tips = predicted_m.iter().enumerate().map(|(i, p)| tip(i, *p)).collect();
        Planted { board, world_from_board, tips, truth: stops.into_iter().map(|s| s.0).collect(), true_m }
    }

    pub fn known(&self) -> BoardStart {
        BoardStart::Known(self.world_from_board)
    }
}

pub fn tip(i: usize, predicted_m: Vector3<f64>) -> DwellTip {
    let start_ns = 2_000_000_000 * i as i64;
    let dwell = DwellId { recording: 0, dwell: i };
    DwellTip { dwell, start_ns, end_ns: start_ns + 1_000_000_000, predicted_m, measured_m: None }
}

/// Where the nominal model sees a tip that really is at `true_m`: encoders by inverse kinematics of the real
/// arm, then the nominal arm's forward kinematics. An arm that cannot reach all points is drawn again.
fn arms_view(rng: &mut ChaCha8Rng, true_m: &[Vector3<f64>], plan: &Plan) -> Vec<Vector3<f64>> {
    loop {
        let deviation: [[f64; 4]; 4] = std::array::from_fn(|_| {
            std::array::from_fn(|column| {
                let size = if column == 0 || column == 3 { 2.0_f64.to_radians() } else { 0.005 };
                rng.random_range(-size..size)
            })
        });
        let view = |scale: f64| -> Option<Vec<Vector3<f64>>> {
            let mut q = [0.0, -0.3, -0.6];
            let real = arm(&deviation, scale);
            true_m
                .iter()
                .map(|p| inverse(&real, p, &mut q).map(|q| forward(&arm(&deviation, 0.0), &q)))
                .collect()
        };
        let error = |seen: &[Vector3<f64>]| {
            seen.iter().zip(true_m).map(|(a, b)| (a - b).norm()).sum::<f64>() / true_m.len() as f64
        };
        let Some(mut seen) = view(1.0) else { continue };
        if let Some(wanted_m) = plan.mean_error_m {
            let Some(scaled) = view(wanted_m / error(&seen)) else { continue };
            if (error(&scaled) / wanted_m - 1.0).abs() > 0.3 {
                continue;
            }
            seen = scaled;
        }
        for p in &mut seen {
            *p += Vector3::from_fn(|_, _| {
                plan.scatter_m * (0..12).map(|_| rng.random::<f64>() - 0.5).sum::<f64>()
            });
        }
        return seen;
    }
}

type Rows = [[f64; 4]; 4];

/// The paper's right arm with `scale` times a deviation: rows theta, d, a, alpha.
fn arm(deviation: &Rows, scale: f64) -> Rows {
    let right = std::f64::consts::FRAC_PI_2;
    let mut rows = [
        [0.0, 0.076, 0.0, right],
        [right, 0.0, 0.4, 0.0],
        [0.0, -0.012, 0.0, right],
        [0.0, 0.3543, 0.0, right],
    ];
    rows.iter_mut().flatten().zip(deviation.iter().flatten()).for_each(|(r, d)| *r += scale * d);
    rows
}

fn forward(rows: &Rows, q: &[f64; 3]) -> Vector3<f64> {
    let mut pose = Pose::identity();
    for (i, [theta, d, a, alpha]) in rows.iter().enumerate() {
        let turn = UnitQuaternion::from_euler_angles(0.0, 0.0, theta + q.get(i).unwrap_or(&0.0));
        pose *= Translation3::new(0.0, 0.0, *d) * turn * Translation3::new(*a, 0.0, 0.0);
        pose *= UnitQuaternion::from_euler_angles(*alpha, 0.0, 0.0);
    }
    pose.translation.vector
}

/// Newton with central differences from the last solution, which keeps to one branch.
fn inverse(rows: &Rows, target_m: &Vector3<f64>, q: &mut [f64; 3]) -> Option<[f64; 3]> {
    for _ in 0..60 {
        let gap = target_m - forward(rows, q);
        if gap.norm() < 1e-9 {
            return Some(*q);
        }
        let column = |j: usize| {
            let moved = |h: f64| {
                let mut q = *q;
                q[j] += h;
                forward(rows, &q)
            };
            (moved(1e-6) - moved(-1e-6)) / 2e-6
        };
        let step = Matrix3::from_columns(&[column(0), column(1), column(2)]).try_inverse()? * gap;
        let shrink = (0.2 / step.norm()).min(1.0);
        (0..3).for_each(|j| q[j] += shrink * step[j]);
    }
    *q = [0.0, -0.3, -0.6];
    None
}

pub fn rng(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}
