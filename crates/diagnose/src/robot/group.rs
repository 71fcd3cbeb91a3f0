//! One family at all joints together: a cause that is likely to be in every joint, such as a make of gear.

use crate::problem::columns::Functions;
use crate::problem::{Amplitude, Candidate, Columns, DwellRow, Scan};
use crate::weigh::evidence::screening_score;
use armcal_model::{Offered, catalogue};
use nalgebra::{DVector, DVectorView};

/// The family whose frequency gears of one make share.
const PERIODIC: &str = "periodic";
/// Frequencies of all joints together that are weighed in full.
const WEIGHED: usize = 12;
/// Largest difference of frequencies that are one [1/turn].
const ONE_FREQUENCY: f64 = 0.5;

/// The candidates, and for gears of one make all joints together: each joint alone may be hidden by the others.
pub(crate) fn with_groups(mut all: Vec<Candidate>) -> Vec<Candidate> {
    for kind in catalogue().iter().filter(|kind| kind.of_a_make && kind.offered != Offered::Scanned) {
        let members: Vec<&Candidate> = all.iter().filter(|c| c.family == kind.name).collect();
        if members.len() < 2 {
            continue;
        }
        let group = combine_members(&members);
        all.push(group);
    }
    all
}

/// Periodic errors of one frequency at all joints that have one, at the frequencies where they promise most.
pub(crate) fn one_frequency(scans: &[Scan], dwells: &[DwellRow], residual: &DVector<f64>) -> Option<Scan> {
    let joints: Vec<&Scan> =
        scans.iter().filter(|s| s.points.first().is_some_and(|p| p.family == PERIODIC)).collect();
    if joints.len() < 2 {
        return None;
    }
    let joints: Vec<Vec<Point<'_>>> =
        joints.into_iter().map(|scan| Point::all(scan, dwells, residual)).collect();
    let finest = joints.iter().max_by_key(|points| points.len())?;
    let at = |frequency: f64| {
        let members: Vec<&Point<'_>> =
            joints.iter().filter_map(|points| nearest(points, frequency)).collect();
        (members.len() > 1).then(|| (members.iter().map(|p| p.promise).sum::<f64>(), members))
    };
    let mut tried: Vec<(f64, Vec<&Point<'_>>)> = finest.iter().filter_map(|p| at(p.frequency)).collect();
    tried.sort_by(|a, b| b.0.total_cmp(&a.0));
    let group =
        |members: Vec<&Point<'_>>| combine_members(&members.iter().map(|p| p.candidate).collect::<Vec<_>>());
    let points: Vec<Candidate> = tried.into_iter().take(WEIGHED).map(|(_, members)| group(members)).collect();
    (!points.is_empty()).then(|| Scan {
        name: format!("{PERIODIC} of one frequency at all joints"),
        tried: finest.len(),
        points,
    })
}

/// A point of the scan of one joint.
struct Point<'s> {
    /// Periods a turn.
    frequency: f64,
    promise: f64,
    candidate: &'s Candidate,
}

impl<'s> Point<'s> {
    /// Those of the scan of one joint, which share its column.
    fn all(scan: &'s Scan, dwells: &[DwellRow], residual: &DVector<f64>) -> Vec<Point<'s>> {
        let Some(base) = scan.points.first().and_then(|p| p.columns.base()) else { return Vec::new() };
        let of_dwell = |a: DVectorView<'_, f64>, b: DVectorView<'_, f64>| -> Vec<f64> {
            dwells.iter().map(|d| d.range().map(|row| a[row] * b[row]).sum()).collect()
        };
        let with: Vec<[Vec<f64>; 2]> =
            base.column_iter().map(|x| [of_dwell(x, residual.as_view()), of_dwell(x, x)]).collect();
        let functions = Columns::functions(scan.points.iter().map(|p| &p.columns));
        let of = |(candidate, basis): (&'s Candidate, Functions<'_>)| {
            let sums = with.iter().flat_map(|[with_residual, square]| {
                basis.column_iter().map(move |f| {
                    let weighted = f.iter().zip(with_residual.iter().zip(square));
                    weighted
                        .fold([0.0, 0.0], |[r, s], (f, (with, square))| [r + f * with, s + f * f * square])
                })
            });
            Some(Point { frequency: candidate.per_turn?, promise: screening_score(sums), candidate })
        };
        scan.points.iter().zip(functions).filter_map(of).collect()
    }
}

/// The point of a joint at a frequency; joints have grids of their own.
fn nearest<'p, 's>(points: &'p [Point<'s>], frequency: f64) -> Option<&'p Point<'s>> {
    let off = |p: &Point<'_>| (p.frequency - frequency).abs();
    points.iter().min_by(|a, b| off(a).total_cmp(&off(b))).filter(|p| off(p) <= ONE_FREQUENCY)
}

/// All of them as one, each with amplitudes of its own.
fn combine_members(members: &[&Candidate]) -> Candidate {
    Candidate {
        spec: members.iter().map(|c| c.spec.as_str()).collect::<Vec<_>>().join(Candidate::AND),
        target: "all joints".to_owned(),
        known: None,
        amplitudes: members.iter().flat_map(|c| qualified_amplitudes(c)).collect(),
        columns: Columns::Together(members.iter().map(|c| c.columns.clone()).collect()),
        ..members[0].clone()
    }
}

/// Its amplitudes, told apart from those of the other members.
fn qualified_amplitudes(c: &Candidate) -> Vec<Amplitude> {
    let full = |a: &Amplitude| Amplitude { name: format!("{}.{}", c.spec, a.name), ..a.clone() };
    c.amplitudes.iter().map(full).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::arm::{Noise, design, problem, rng};

    #[test]
    fn gears_of_one_make_err_at_one_frequency() {
        let mut r = rng(5);
        let poses = design(0, &mut r);
        let mut p = problem(&poses, &[], Noise::White, &mut r, true);
        // A typical error at every joint, 23 times a turn, none of it large.
        for scan in p.scans.iter().filter(|s| s.points[0].family == PERIODIC) {
            let own = scan.points.iter().find(|c| c.per_turn == Some(23.0));
            p.residual += own.expect("a point of the grid").columns.dense(&p.dwells, 1.0)
                * DVector::from_vec(vec![0.8, -0.6]);
        }
        let fitted = crate::weigh::crossval::left_out(&p, None, &[], 1.0);
        let all = one_frequency(&p.scans, &p.dwells, &fitted).expect("three joints");
        assert_eq!(
            all.points[0].spec,
            "periodic:1,frequency=23+periodic:2,frequency=23+periodic:3,frequency=23"
        );
        assert_eq!((all.points[0].amplitudes.len(), all.points.len(), all.tried), (6, WEIGHED, 77));
        assert_eq!(all.points[0].amplitudes[5].name, "periodic:3,frequency=23.a1");
        p.scans.retain(|s| s.name == "periodic:2");
        assert!(one_frequency(&p.scans, &p.dwells, &p.residual).is_none(), "one joint is no make");
    }
}
