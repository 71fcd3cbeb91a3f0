//! Places that the tip came back to in other postures: sockets, where neither a board nor a sensor is there.
//!
//! Of every link that the tip may be, the pauses are put where the nominal arm has them; on the right one they lie in a few heaps.
//! How far the sockets are from each other is then what the calibration itself finds: the size at which it errs least.

use super::arm::Arm;
use super::read::{AllRead, Read};
use crate::error::InitError;
use armcal_core::Pose;
use armcal_core::robust::median;
use armcal_stages::Inputs;
use armcal_stages::links::fit_rigid_motion;
use armcal_table::{Board, Cavity};
use nalgebra::{Point3, Vector3};
use std::collections::BTreeMap;

/// Heaps are this many times further apart than their pauses are from each other.
const APART: f64 = 2.0;
/// Pauses in a heap, share of all pauses in heaps, joint motion within a heap [rad]: fewer, and they calibrate nothing.
const FEWEST: usize = 5;
const SHARE: f64 = 0.8;
const TURNS_RAD: f64 = 0.1;
/// Sockets at most; more are a board, which has a drawing.
const MOST: usize = 8;
/// Sizes that are tried about the nominal arm's, in thousandths, and when the search ends.
const SIZES: [f64; 2] = [0.8, 1.25];
const SETTLED: f64 = 5e-4;
/// What nobody can see of a socket, assumed [m].
const TOLERANCE_M: f64 = 1e-4;

/// Sockets of a fixture.
pub struct Sockets {
    /// The link of the tip, of a URDF.
    pub tip_link: Option<String>,
    /// The sockets in the order of their first visit.
    pub board: Board,
    /// Pauses of each.
    pub visits: Vec<usize>,
    /// Median distance of a pause from its socket with the nominal arm [m].
    pub scatter_m: f64,
    /// The same of the next best link; none where there was no choice.
    pub next_scatter_m: Option<(String, f64)>,
}

/// Where the tip was in each pause of a recording [m].
type Points = Vec<Vector3<f64>>;

/// The heaps of one recording: of each its pauses, in the order of first visits.
type Heaps = Vec<Vec<usize>>;

/// The pauses as they lie when the tip is on a link.
struct OnLink {
    scatter_m: f64,
    link: Option<String>,
    tips_m: Vec<Points>,
    heaps: Vec<Heaps>,
}

/// Finds the sockets of recordings in which nothing but the joints was seen.
pub fn find(arm: &Arm, read: &AllRead) -> Result<Option<Sockets>, InitError> {
    let mut found: Vec<OnLink> = Vec::new();
    let p = arm.model.nominal();
    let in_pauses =
        |r: &Read| r.dwells.iter().map(|d| arm.model.tip_in_base(&p, &d.joint_rad)).collect::<Vec<Pose>>();
    let firsts: Vec<Vec<Pose>> = read.recordings.iter().map(in_pauses).collect();
    for (link, place) in arm.tip_places()? {
        let place = Point3::from(place.translation.vector);
        let points = |firsts: &Vec<Pose>| firsts.iter().map(|first| (first * place).coords).collect();
        let tips_m: Vec<Points> = firsts.iter().map(points).collect();
        let Some(heaps) = in_all(&tips_m.iter().map(|tips_m| cluster_points(tips_m)).collect::<Vec<_>>())
        else {
            continue;
        };
        let turned = heaps.iter().zip(&read.recordings).all(|(heaps, r)| {
            heaps.iter().all(|heap| {
                (0..arm.carried.len()).any(|j| {
                    let q = heap.iter().map(|k| r.dwells[*k].joint_rad[j]);
                    let (low, high) =
                        q.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), q| (l.min(q), h.max(q)));
                    high - low > TURNS_RAD
                })
            })
        });
        if turned {
            let scatter: Vec<f64> = tips_m
                .iter()
                .zip(&heaps)
                .flat_map(|(tips_m, heaps)| {
                    heaps.iter().flat_map(|heap| off_m(tips_m, heap)).collect::<Vec<_>>()
                })
                .collect();
            found.push(OnLink { scatter_m: median(&scatter), link, tips_m, heaps });
        }
    }
    found.sort_by(|a, b| a.scatter_m.total_cmp(&b.scatter_m));
    let next_scatter_m = found.get(1).and_then(|next| Some((next.link.clone()?, next.scatter_m)));
    let Some(OnLink { scatter_m, link: tip_link, tips_m, heaps }) = found.into_iter().next() else {
        return Ok(None);
    };
    let visits = (0..heaps[0].len()).map(|s| heaps.iter().map(|heaps| heaps[s].len()).sum()).collect();
    Ok(socket_layout(&tips_m, &heaps).map(|in_board_m| Sockets {
        tip_link,
        board: socket_board(in_board_m),
        visits,
        scatter_m,
        next_scatter_m,
    }))
}

fn median_point(tips_m: &[Vector3<f64>], heap: &[usize]) -> Vector3<f64> {
    let axis = |k: usize| median(&heap.iter().map(|i| tips_m[*i][k]).collect::<Vec<_>>());
    Vector3::new(axis(0), axis(1), axis(2))
}

fn off_m(tips_m: &[Vector3<f64>], heap: &[usize]) -> Vec<f64> {
    let middle = median_point(tips_m, heap);
    heap.iter().map(|i| (tips_m[*i] - middle).norm()).collect()
}

/// The same number of heaps in every recording: of several the one that stands out most, a single one where there are not. A
/// stray pause is further from all sockets than these from each other, and would make them one.
fn in_all(recordings: &[BTreeMap<usize, (f64, Heaps)>]) -> Option<Vec<Heaps>> {
    let falls = |count: usize| recordings.iter().map(|r| Some(r.get(&count)?.0.ln())).sum::<Option<f64>>();
    let all = (1..=MOST).filter_map(|count| Some((count, falls(count)? / recordings.len() as f64)));
    let clear = all.filter(|(_, fall)| *fall > APART.ln());
    let (count, _) = clear.max_by(|a, b| (a.0 > 1).cmp(&(b.0 > 1)).then(a.1.total_cmp(&b.1)))?;
    Some(recordings.iter().map(|r| r[&count].1.clone()).collect())
}

/// Heaps of points, by their number: what the longest edges of their spanning tree part, and how many times longer these are
/// than those that are left.
fn cluster_points(points_m: &[Vector3<f64>]) -> BTreeMap<usize, (f64, Heaps)> {
    let edges = spanning_tree(points_m);
    let mut found: BTreeMap<usize, (f64, Heaps)> = BTreeMap::new();
    // Beside the edges between heaps there may be some to pauses elsewhere.
    for cut in 1..(2 * MOST).min(edges.len()) {
        let fall = edges[cut - 1].2 / edges[cut].2.max(1e-6);
        let heaps = connected_components(points_m.len(), &edges[cut..]);
        let inside: usize = heaps.iter().map(Vec::len).sum();
        let enough = inside as f64 >= SHARE * points_m.len() as f64;
        if enough && found.get(&heaps.len()).is_none_or(|(best, _)| fall > *best) {
            found.insert(heaps.len(), (fall, heaps));
        }
    }
    found
}

/// The points that these edges join, in the order of their first.
fn connected_components(points: usize, edges: &[(usize, usize, f64)]) -> Heaps {
    let mut group: Vec<usize> = (0..points).collect();
    for (a, b, _) in edges {
        let [from, to] = [group[*a], group[*b]];
        group.iter_mut().filter(|g| **g == from).for_each(|g| *g = to);
    }
    let mut heaps: Heaps = Vec::new();
    for (i, own) in group.iter().enumerate() {
        match heaps.iter_mut().find(|heap| group[heap[0]] == *own) {
            Some(heap) => heap.push(i),
            None => heaps.push(vec![i]),
        }
    }
    heaps.retain(|heap| heap.len() >= FEWEST);
    heaps
}

/// Edges of the shortest tree that joins all points, longest first (Prim 1957).
fn spanning_tree(points_m: &[Vector3<f64>]) -> Vec<(usize, usize, f64)> {
    let Some(first) = points_m.first() else { return Vec::new() };
    let mut nearest: Vec<(usize, f64)> = points_m.iter().map(|p| (0, (p - first).norm())).collect();
    let mut inside = vec![false; points_m.len()];
    let mut edges = Vec::new();
    let mut at = 0;
    for _ in 1..points_m.len() {
        inside[at] = true;
        for (i, near) in nearest.iter_mut().enumerate() {
            let length = (points_m[i] - points_m[at]).norm();
            if length < near.1 {
                *near = (at, length);
            }
        }
        let outside = (0..points_m.len()).filter(|i| !inside[*i]);
        let Some(next) = outside.min_by(|a, b| nearest[*a].1.total_cmp(&nearest[*b].1)) else { break };
        edges.push((nearest[next].0, next, nearest[next].1));
        at = next;
    }
    edges.sort_by(|a, b| b.2.total_cmp(&a.2));
    edges
}

/// Where the sockets are on their fixture: the mean over the recordings, each laid onto the first; the first socket at the
/// origin, the second on the x axis.
fn socket_layout(tips_m: &[Vec<Vector3<f64>>], heaps: &[Heaps]) -> Option<Vec<Vector3<f64>>> {
    let middles: Vec<Vec<Vector3<f64>>> = tips_m
        .iter()
        .zip(heaps)
        .map(|(tips_m, heaps)| heaps.iter().map(|heap| median_point(tips_m, heap)).collect())
        .collect();
    let count = middles[0].len();
    let [a, b] = [0, 1.min(count - 1)];
    let distance = |all: &[Vector3<f64>]| (all[b] - all[a]).norm();
    if count < 3 {
        let mean = middles.iter().map(|m| distance(m)).sum::<f64>() / middles.len() as f64;
        return Some((0..count).map(|s| Vector3::x() * (mean * s as f64)).collect());
    }
    let mut mean = vec![Vector3::zeros(); count];
    for own in &middles {
        let onto = fit_rigid_motion(own, &middles[0])?;
        mean.iter_mut()
            .zip(own)
            .for_each(|(sum, p)| *sum += onto.transform_point(&(*p).into()).coords / middles.len() as f64);
    }
    let x = (mean[1] - mean[0]).try_normalize(1e-6)?;
    let furthest = mean
        .iter()
        .map(|p| (p - mean[0]) - x * (p - mean[0]).dot(&x))
        .max_by(|a, b| a.norm().total_cmp(&b.norm()))?;
    let y = furthest
        .try_normalize(1e-6)
        .unwrap_or_else(|| x.cross(&Vector3::z()).try_normalize(1e-6).unwrap_or(Vector3::y()));
    let z = x.cross(&y);
    Some(mean.iter().map(|p| p - mean[0]).map(|p| Vector3::new(p.dot(&x), p.dot(&y), p.dot(&z))).collect())
}

fn socket_board(in_board_m: Vec<Vector3<f64>>) -> Board {
    let cavity =
        |(at, in_board_m): (usize, Vector3<f64>)| Cavity { name: format!("socket_{}", at + 1), in_board_m };
    Board {
        name: "sockets".to_owned(),
        cavity_sigma_m: TOLERANCE_M,
        seat_sigma_m: TOLERANCE_M,
        mechanism: None,
        cavities: in_board_m.into_iter().enumerate().map(cavity).collect(),
    }
}

impl Sockets {
    /// The same with all distances so many times as large.
    pub fn scaled(&self, times: f64) -> Board {
        let cavities =
            self.board.cavities.iter().map(|c| Cavity { in_board_m: c.in_board_m * times, ..c.clone() });
        Board { cavities: cavities.collect(), ..self.board.clone() }
    }

    /// Finds the size at which the calibration of these inputs errs least, by golden sections (Kiefer 1953).
    pub fn sized(&mut self, inputs: &Inputs) {
        let error = |times: f64| {
            let inputs = Inputs { board: Some(self.scaled(times)), ..inputs.clone() };
            inputs.fit().map_or(f64::INFINITY, |fitted| fitted.calibration.train.fitted.rms_m)
        };
        let golden = (5f64.sqrt() - 1.0) / 2.0;
        let [mut low, mut high] = SIZES;
        let (mut a, mut b) = (high - golden * (high - low), low + golden * (high - low));
        let (mut at_a, mut at_b) = (error(a), error(b));
        while high - low > SETTLED {
            if at_a <= at_b {
                (high, b, at_b) = (b, a, at_a);
                a = high - golden * (high - low);
                at_a = error(a);
            } else {
                (low, a, at_a) = (a, b, at_b);
                b = low + golden * (high - low);
                at_b = error(b);
            }
        }
        self.board = self.scaled(0.5 * (low + high));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn heap(centre: [f64; 3], radius: f64, count: usize, phase: f64) -> Vec<Vector3<f64>> {
        let at = |i: usize| {
            Vector3::new((3.1 * i as f64 + phase).sin(), (2.3 * i as f64).cos(), (1.7 * i as f64).sin())
        };
        (0..count).map(|i| Vector3::from(centre) + at(i) * radius).collect()
    }

    #[test]
    fn heaps_are_found_in_the_order_of_their_visits_and_a_cloud_is_none() {
        let mut points = heap([0.5, 0.0, 0.1], 0.006, 12, 0.0);
        points.extend(heap([0.55, 0.0, 0.1], 0.006, 9, 1.0));
        points.extend(heap([0.5, 0.06, 0.1], 0.006, 10, 2.0));
        points.push(Vector3::new(0.1, 0.4, 0.6));
        let found = in_all(&[cluster_points(&points)]).expect("three heaps").remove(0);
        assert_eq!(found.iter().map(Vec::len).collect::<Vec<_>>(), [12, 9, 10]);
        assert_eq!(found[1], (12..21).collect::<Vec<_>>());
        assert!(in_all(&[cluster_points(&heap([0.0; 3], 0.3, 40, 0.0))]).is_none());
    }

    #[test]
    fn a_fixture_that_was_moved_has_one_layout() {
        let fixture = [[0.0, 0.0, 0.0], [0.05, 0.0, 0.0], [0.01, 0.04, 0.0]].map(Vector3::from);
        let moved = nalgebra::Isometry3::new(Vector3::new(0.4, 0.2, 0.1), Vector3::new(0.3, -0.2, 1.0));
        let tips: Vec<Vec<Vector3<f64>>> = [nalgebra::Isometry3::identity(), moved]
            .iter()
            .map(|m| fixture.iter().map(|p| m.transform_point(&(*p).into()).coords).collect())
            .collect();
        let heaps: Vec<Heaps> = vec![(0..3).map(|k| vec![k]).collect(); 2];
        let found = socket_layout(&tips, &heaps).expect("a layout");
        for (found, planted) in found.iter().zip(&fixture) {
            assert!((found - planted).norm() < 1e-9, "{found:?}");
        }
    }
}
