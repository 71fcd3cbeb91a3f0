//! Rough alignments of tips and cavities, all that come into question, best first.
//!
//! A board of given pose: shifts and turns on a grid as wide as the model may be wrong. A board of unknown
//! pose: triplets and pairs of places matched with triplets and pairs of cavities by their distances.
//! Places are drawn by a low-discrepancy sequence (Roberts 2018), the same for the same input.

use super::at_least::sum_of_at_least;
use super::field::Field;
use super::problem::{Problem, Site};
use armcal_core::Pose;
use nalgebra::{Matrix3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};

/// Alignments kept.
const KEEP: usize = 48;
/// Alignments looked at to find that many different ones.
const LOOK: usize = 6000;
/// Alignments with less than this share of the best one's support are not kept.
const WORTH: f64 = 0.5;
/// A place further from every cavity than this share of their spacing does not support an alignment.
const REACH: f64 = 0.4;
/// Steps of the grid [m], [rad], and how many standard deviations it spans.
const GRID_M: f64 = 0.006;
const GRID_RAD: f64 = 0.05;
const GRID_SPAN: f64 = 3.0;
/// Triplets and pairs of places that are matched, and drawn at most.
const TRIPLETS: usize = 160;
const PAIRS: usize = 80;
const DRAWS: usize = 6000;
/// Alignments by triplets and pairs at most.
const MOST: usize = 80_000;
/// Distances of places match distances of cavities within a share of them, and a share of the spacing.
const STRETCH: f64 = 0.04;
const SLACK: f64 = 0.2;

/// Rough alignments in the pose given.
pub(super) fn around_pose(problem: &Problem, world_from_board: &Pose) -> Vec<Field> {
    let board_from_world = world_from_board.inverse();
    let middle_m = problem.middle_m(&board_from_world);
    let supposed = Field::none(board_from_world, middle_m);
    let sites: Vec<(Vector3<f64>, f64)> =
        problem.sites.iter().map(|s| (supposed.supposed_m(&s.at_m) - middle_m, s.weight)).collect();
    let shifts = symmetric_steps(GRID_SPAN * problem.prior.offset_m, GRID_M);
    let turns = symmetric_steps(GRID_SPAN * problem.config.rotation_sigma_deg.to_radians(), GRID_RAD);
    let turned = |turn_rad: &f64| -> Vec<(Vector3<f64>, f64)> {
        let rotation = Rotation3::from_axis_angle(&Vector3::z_axis(), *turn_rad);
        sites.iter().map(|(v, w)| (rotation * v + middle_m, *w)).collect()
    };
    let turned: Vec<_> = turns.iter().map(turned).collect();
    let (mut scored, mut highest) = (Vec::new(), f64::NEG_INFINITY);
    for (turn, sites) in turned.iter().enumerate() {
        for (score, shift) in score_shifts(problem, sites, &shifts) {
            if score >= WORTH * highest {
                highest = highest.max(score);
                scored.push((score, (turn, shift)));
            }
        }
    }
    let place = |(turn, shift): &(usize, Vector3<f64>), site: usize| turned[*turn][site].0 + shift;
    let field = |(turn, shift): &(usize, Vector3<f64>)| {
        let mut field = supposed.clone();
        field.turn_and_shift(turns[*turn], *shift);
        field
    };
    distinct_alignments(problem, scored, place, false).iter().map(field).collect()
}

/// Support of the sites (place on the board, weight) at every shift of the grid, less what a far shift costs.
///
/// Site by site and cavity by cavity: each supports the few shifts that bring the one to the other.
fn score_shifts(
    problem: &Problem,
    sites: &[(Vector3<f64>, f64)],
    shifts: &[f64],
) -> impl Iterator<Item = (f64, Vector3<f64>)> {
    let (n, reach_m) = (shifts.len(), REACH * problem.layout.spacing_m);
    let grid = (0..n * n).map(|at| Vector3::new(shifts[at / n], shifts[at % n], 0.0));
    let grid: Vec<Vector3<f64>> = grid.collect();
    let far = |s: &Vector3<f64>| 0.1 * (s.x * s.x + s.y * s.y) / problem.prior.offset_m.powi(2);
    let mut scores: Vec<f64> = grid.iter().map(|s| -far(s)).collect();
    let mut best = vec![0.0; n * n];
    // Indices of the shifts that bring `from` within reach of `to`.
    let within = |from: f64, to: f64| {
        let at = |side: f64| ((to - from + side - shifts[0]) / GRID_M).clamp(0.0, n as f64);
        at(-reach_m).floor() as usize..(at(reach_m).ceil() as usize + 1).min(n)
    };
    let mut across = Vec::new();
    for (p, weight) in sites {
        best.fill(0.0);
        for cavity in &problem.layout.points_m {
            let along = within(p.y, cavity.y);
            across.clear();
            across.extend(shifts[along.clone()].iter().map(|shift| (p.y + shift - cavity.y).powi(2)));
            for x in within(p.x, cavity.x) {
                let beside = (p.x + shifts[x] - cavity.x).powi(2);
                for (best, across) in best[x * n..][along.clone()].iter_mut().zip(&across) {
                    *best = f64::max(*best, 1.0 - (beside + across) / (reach_m * reach_m));
                }
            }
        }
        scores.iter_mut().zip(&best).for_each(|(score, support)| *score += weight * support);
    }
    scores.into_iter().zip(grid)
}

/// Rough alignments without a pose.
pub(super) fn without_pose(problem: &Problem) -> Vec<Field> {
    let up = Unit::new_normalize(Vector3::from(problem.config.normal_in_world));
    let mut poses = by_triplets(problem, &up);
    poses.extend(by_pairs(problem, &up));
    let (mut scored, mut highest) = (Vec::new(), 0.0);
    for pose in poses {
        if let Some(score) = support_of_all(problem, &pose, WORTH * highest) {
            highest = f64::max(highest, score);
            scored.push((score, pose));
        }
    }
    let n = problem.layout.len() as f64;
    let centre_m = problem.layout.points_m.iter().sum::<Vector3<f64>>() / n;
    let place = |pose: &Pose, site: usize| pose.transform_point(&problem.sites[site].at_m.into()).coords;
    distinct_alignments(problem, scored, place, true)
        .into_iter()
        .map(|pose| Field::none(pose, centre_m))
        .collect()
}

/// How much all places support an alignment; none where that is less than `least`.
pub(super) fn support_of_all(problem: &Problem, board_from_world: &Pose, least: f64) -> Option<f64> {
    let (rotation, shift) =
        (board_from_world.rotation.to_rotation_matrix(), &board_from_world.translation.vector);
    let of = |site: &Site| (site.weight, cavity_support(problem, &(rotation * site.at_m + shift), true).1);
    sum_of_at_least(least, (problem.sites_weight, 1.0), problem.sites.iter().map(of))
}

/// How many places an alignment brings to a cavity, seen along the board's normal.
pub(super) fn count_supporters(problem: &Problem, field: &Field) -> usize {
    let supports = |s: &&Site| cavity_support(problem, &field.aligned_m(&s.at_m), false).1 > 0.0;
    problem.sites.iter().filter(supports).count()
}

/// The cavity that supports a place, and how much, from 0 to 1.
fn cavity_support(problem: &Problem, at_m: &Vector3<f64>, in_space: bool) -> (u32, f64) {
    let reach_m = REACH * problem.layout.spacing_m;
    let [low_m, high_m] = problem.layout.heights_m;
    if in_space && (at_m.z > high_m + reach_m || at_m.z < low_m - reach_m) {
        return (u32::MAX, 0.0);
    }
    let Some(&k) = problem.layout.near(at_m).first() else { return (u32::MAX, 0.0) };
    let gap = at_m - problem.layout.points_m[k as usize];
    let square = if in_space { gap.norm_squared() } else { gap.x * gap.x + gap.y * gap.y };
    let support = 1.0 - square / (reach_m * reach_m);
    if support > 0.0 { (k, support) } else { (u32::MAX, 0.0) }
}

/// The best alignments of which each puts at least some places into other cavities than those before it; `place_of` is where on the
/// board an alignment puts a site.
fn distinct_alignments<T>(
    problem: &Problem,
    mut scored: Vec<(f64, T)>,
    place_of: impl Fn(&T, usize) -> Vector3<f64>,
    in_space: bool,
) -> Vec<T> {
    scored.sort_by(|a, b| b.0.total_cmp(&a.0));
    let least = WORTH * scored.first().map_or(0.0, |s| s.0);
    let enough = (problem.sites.len() / 8).max(1);
    let mut kept: Vec<(T, Vec<u32>)> = Vec::new();
    for (_, rough) in scored.into_iter().take(LOOK).take_while(|s| s.0 >= least) {
        let cavity = |site: usize| cavity_support(problem, &place_of(&rough, site), in_space).0;
        let cavities: Vec<u32> = (0..problem.sites.len()).map(cavity).collect();
        let differs = |other: &Vec<u32>| cavities.iter().zip(other).filter(|(a, b)| a != b).count() >= enough;
        if kept.iter().all(|(_, other)| differs(other)) {
            kept.push((rough, cavities));
            if kept.len() == KEEP {
                break;
            }
        }
    }
    kept.into_iter().map(|(rough, _)| rough).collect()
}

fn by_triplets(problem: &Problem, up: &Unit<Vector3<f64>>) -> Vec<Pose> {
    let pairs = Pairs::of(&problem.layout.points_m);
    let (cavities, sites) = (&problem.layout.points_m, &problem.sites);
    let apart_m = &pairs.apart_m;
    let cos_limit = problem.config.max_normal_deg.min(180.0).to_radians().cos();
    let far_m = 1.5 * problem.layout.spacing_m;
    let mut poses = Vec::new();
    let mut matched = 0;
    for draw in 0..DRAWS {
        let [a, b, c] = draw_triplet(draw, sites.len()).map(|i| sites[i].at_m);
        let [ab, ac, bc] = [(b - a).norm(), (c - a).norm(), (c - b).norm()];
        let height = (b - a).cross(&(c - a)).norm() / ab.max(ac).max(bc).max(1e-9);
        if ab.min(ac).min(bc) < far_m || height < 0.5 * far_m {
            continue;
        }
        let Some(in_world) = frame_from_points(&a, &b, &c) else { continue };
        let before = poses.len();
        let [of_ac, of_bc] = [ac, bc].map(|distance_m| distance_tolerance_m(problem, distance_m));
        // As far from each cavity as c is from a.
        let like_ac =
            |i: usize| (0..cavities.len()).filter(move |k| *k != i && (apart_m[i][*k] - ac).abs() < of_ac);
        let thirds: Vec<Vec<usize>> = (0..cavities.len()).map(|i| like_ac(i).collect()).collect();
        for &(_, i, j) in pairs.like(ab, distance_tolerance_m(problem, ab)) {
            for &k in thirds[i].iter().filter(|k| **k != j && (apart_m[j][**k] - bc).abs() < of_bc) {
                if let Some(on_board) = frame_from_points(&cavities[i], &cavities[j], &cavities[k]) {
                    let world_from_board = in_world * on_board.inverse();
                    if (world_from_board.rotation * Vector3::z()).dot(up) >= cos_limit {
                        poses.push(world_from_board.inverse());
                    }
                }
            }
        }
        matched += usize::from(poses.len() > before);
        if matched == TRIPLETS || poses.len() > MOST {
            break;
        }
    }
    poses
}

/// Pairs leave the turn about their line open: the board's normal is as near to `up` as it can be.
fn by_pairs(problem: &Problem, up: &Unit<Vector3<f64>>) -> Vec<Pose> {
    let pairs = Pairs::of(&problem.layout.points_m);
    let (cavities, sites) = (&problem.layout.points_m, &problem.sites);
    let far_m = 0.6 * problem.layout.spacing_m;
    let mut poses = Vec::new();
    let mut matched = 0;
    for draw in 0..DRAWS {
        let [a, b, _] = draw_triplet(draw, sites.len()).map(|i| sites[i].at_m);
        let ab = (b - a).norm();
        if ab < far_m {
            continue;
        }
        let in_world = upright_frame(&a, &b, up);
        let before = poses.len();
        for &(_, i, j) in pairs.like(ab, distance_tolerance_m(problem, ab)) {
            let on_board = upright_frame(&cavities[i], &cavities[j], &Vector3::z_axis());
            let world_from_board = in_world * on_board.inverse();
            poses.push(world_from_board.inverse());
        }
        matched += usize::from(poses.len() > before);
        if matched == PAIRS || poses.len() > MOST {
            break;
        }
    }
    poses
}

fn distance_tolerance_m(problem: &Problem, distance_m: f64) -> f64 {
    STRETCH * distance_m + SLACK * problem.layout.spacing_m
}

/// Distances of cavities.
struct Pairs {
    /// From each to each.
    apart_m: Vec<Vec<f64>>,
    /// Ordered pairs by their distance.
    by_distance: Vec<(f64, usize, usize)>,
}

impl Pairs {
    fn of(points: &[Vector3<f64>]) -> Pairs {
        let from = |a: &Vector3<f64>| points.iter().map(|b| (a - b).norm()).collect();
        let apart_m: Vec<Vec<f64>> = points.iter().map(from).collect();
        let all = (0..points.len()).flat_map(|i| (0..points.len()).map(move |j| (i, j)));
        let mut by_distance: Vec<(f64, usize, usize)> =
            all.filter(|(i, j)| i != j).map(|(i, j)| (apart_m[i][j], i, j)).collect();
        by_distance.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
        Pairs { apart_m, by_distance }
    }

    fn like(&self, distance_m: f64, tolerance_m: f64) -> &[(f64, usize, usize)] {
        let pairs = &self.by_distance;
        let from = pairs.partition_point(|p| p.0 < distance_m - tolerance_m);
        let to = pairs.partition_point(|p| p.0 <= distance_m + tolerance_m);
        &pairs[from..to.max(from)]
    }
}

/// The frame with origin `a`, x towards `b`, and `c` in the upper half of the xy plane.
fn frame_from_points(a: &Vector3<f64>, b: &Vector3<f64>, c: &Vector3<f64>) -> Option<Pose> {
    let x = (b - a).try_normalize(1e-9)?;
    let z = x.cross(&(c - a)).try_normalize(1e-9)?;
    Some(pose_of(a, &x, &z))
}

/// The frame with origin `a`, x towards `b`, and z as near to `up` as that allows.
fn upright_frame(a: &Vector3<f64>, b: &Vector3<f64>, up: &Unit<Vector3<f64>>) -> Pose {
    let x = (b - a).try_normalize(1e-9).unwrap_or_else(Vector3::x);
    let beside = |v: &Vector3<f64>| (v - x * x.dot(v)).try_normalize(0.05);
    let z = beside(up).or_else(|| beside(&Vector3::x())).or_else(|| beside(&Vector3::y()));
    pose_of(a, &x, &z.unwrap_or_else(Vector3::z))
}

fn pose_of(origin: &Vector3<f64>, x: &Vector3<f64>, z: &Vector3<f64>) -> Pose {
    let matrix = Matrix3::from_columns(&[*x, z.cross(x), *z]);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix));
    Pose::from_parts(Translation3::from(*origin), rotation)
}

/// Three indices below `n`, evenly spread over all of them as `draw` counts up (R3 sequence, with the inverse
/// powers of the root of x^4 = x + 1).
fn draw_triplet(draw: usize, n: usize) -> [usize; 3] {
    const STEP: [f64; 3] = [0.819_172_513_396_164_4, 0.671_043_606_703_789_3, 0.549_700_477_901_970_3];
    STEP.map(|step| {
        let at = (0.5 + step * (draw + 1) as f64).fract();
        ((at * n as f64) as usize).min(n.saturating_sub(1))
    })
}

/// From `-span` to `span` in steps, zero among them.
fn symmetric_steps(span: f64, step: f64) -> Vec<f64> {
    let half = (span / step).round() as i32;
    (-half..=half).map(|i| f64::from(i) * step).collect()
}
