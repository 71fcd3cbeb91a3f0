//! Which columns of a table are points and poses: by their names, or, of lists and of columns without names, by what only a pose
//! can be (a quaternion of length one, a matrix that turns).

use super::names::{Named, Part, parse};
use super::rotations::{Turns, is_quaternion, of_matrix, of_three};
use super::{Column, Table, Values};
use std::collections::BTreeMap;

/// Points or poses, one a row; NaN where there is none.
#[derive(Debug, Default)]
pub(super) struct Track {
    pub name: String,
    pub position: Vec<[f64; 3]>,
    /// As x, y, z, w.
    pub orientation: Option<Vec<[f64; 4]>>,
}

/// Words in the names of lists that say that six numbers are a pose.
const POSES: [&str; 6] = ["pose", "tcp", "cart", "ee", "transform", "tool"];
/// A share of rows that must be what only a pose can be.
const MOST: f64 = 0.9;

/// Takes the columns that make poses out of a table.
pub(super) fn take_poses(table: &mut Table) -> Vec<Track> {
    let (mut tracks, mut used) = (Vec::new(), Vec::new());
    named_poses(table, &mut tracks, &mut used);
    listed_poses(table, &mut tracks, &mut used);
    if tracks.is_empty() {
        unnamed_pose(table, &mut tracks, &mut used);
    }
    let mut at = 0;
    table.columns.retain(|_| {
        at += 1;
        !used.contains(&(at - 1))
    });
    tracks
}

/// The numbers of a column.
fn numbers(table: &Table, column: usize) -> Option<&[f64]> {
    match &table.columns.get(column)?.values {
        Values::Numbers(values) => Some(values),
        _ => None,
    }
}

/// Columns side by side.
fn rows_of<const N: usize>(table: &Table, columns: [usize; N]) -> Option<Vec<[f64; N]>> {
    let columns: Vec<&[f64]> = columns.iter().map(|k| numbers(table, *k)).collect::<Option<_>>()?;
    Some((0..table.rows()).map(|i| std::array::from_fn(|k| columns[k][i])).collect())
}

fn named_poses(table: &mut Table, tracks: &mut Vec<Track>, used: &mut Vec<usize>) {
    let mut groups: BTreeMap<String, BTreeMap<Part, (usize, Option<f64>)>> = BTreeMap::new();
    for (at, column) in table.columns.iter().enumerate() {
        if let (Values::Numbers(_), Some((group, Named { part, unit }))) =
            (&column.values, parse(&column.name))
        {
            groups.entry(group).or_default().entry(part).or_insert((at, unit));
        }
    }
    for (group, parts) in groups {
        let all = |of: &[Part]| -> Option<Vec<(usize, Option<f64>)>> {
            of.iter().map(|part| parts.get(part).copied()).collect()
        };
        let three = |part: fn(u8) -> Part| all(&[0, 1, 2].map(part));
        let columns = |of: &[(usize, Option<f64>)]| -> Vec<usize> { of.iter().map(|(at, _)| *at).collect() };
        let array = |of: &[(usize, Option<f64>)]| -> [usize; 3] { [of[0].0, of[1].0, of[2].0] };
        let Some(point) = three(Part::Position) else { continue };
        let Some(mut position) = rows_of(table, array(&point)) else { continue };
        let to_m = point[0].1.unwrap_or(1.0);
        position.iter_mut().flatten().for_each(|x| *x *= to_m);
        used.extend(columns(&point));
        let name = if group.is_empty() { "tip".to_owned() } else { group };
        let mut orientation = None;
        let quaternion = all(&[0, 1, 2, 3].map(Part::Quaternion));
        // `orientation.x` is of a quaternion where `orientation.w` is beside it.
        let beside = || all(&[Part::Vector(0), Part::Vector(1), Part::Vector(2), Part::Quaternion(3)]);
        let quaternion = quaternion.or_else(beside);
        let matrix = |first: u8| {
            let all_of = (0..9).map(|k| Part::Matrix(first + k / 3, first + k % 3)).collect::<Vec<_>>();
            all(&all_of)
        };
        if let Some(q) = quaternion {
            orientation = rows_of(table, [q[0].0, q[1].0, q[2].0, q[3].0]);
            used.extend(columns(&q));
        } else if let Some(m) = matrix(1).or_else(|| matrix(0)) {
            let nine = columns(&m).try_into().ok().and_then(|nine: [usize; 9]| rows_of(table, nine));
            orientation =
                nine.map(|rows| rows.iter().map(|row| of_matrix(row).unwrap_or([f64::NAN; 4])).collect());
            used.extend(columns(&m));
        } else {
            let ways = [
                (three(Part::Vector), Turns::Vector),
                (three(Part::Fixed), Turns::Fixed),
                (three(Part::Kuka), Turns::Kuka),
            ];
            if let Some((own, turns)) = ways.into_iter().find_map(|(own, turns)| Some((own?, turns)))
                && let Some(rows) = rows_of(table, array(&own))
            {
                let (read, words) = of_three(&rows, turns, own[0].1);
                let called: Vec<&str> = own.iter().map(|(at, _)| table.columns[*at].name.as_str()).collect();
                table.notes.push(format!("{} are read as {words}", called.join(", ")));
                orientation = Some(read);
                used.extend(columns(&own));
            }
        }
        tracks.push(Track { name, position, orientation });
    }
}

/// Lists of 3, 6, 7, 9, 12 and 16 numbers a row that are points, poses or matrices.
fn listed_poses(table: &mut Table, tracks: &mut Vec<Track>, used: &mut Vec<usize>) {
    let mut turned: Option<(usize, Vec<[f64; 4]>)> = None;
    let mut points: Vec<usize> = Vec::new();
    for (at, Column { name, values }) in table.columns.iter().enumerate() {
        let Values::Lists { length, flat, .. } = values else { continue };
        let rows = || flat.chunks_exact(*length);
        let mostly = |is: &dyn Fn(&[f64]) -> bool| {
            rows().filter(|row| is(row)).count() as f64 > MOST * table.rows() as f64
        };
        let called = name.to_lowercase();
        let mut track = |place: [usize; 3], orientation: Vec<[f64; 4]>| {
            let position = rows().map(|row| place.map(|k| row[k])).collect();
            tracks.push(Track { name: name.clone(), position, orientation: Some(orientation) });
            used.push(at);
        };
        match length {
            16 | 12 if mostly(&|row| matrix_in(row).is_some()) => {
                track([3, 7, 11], rows().map(|row| matrix_in(row).unwrap_or([f64::NAN; 4])).collect());
            }
            9 if mostly(&|row| row.try_into().is_ok_and(|row| of_matrix(row).is_some())) => {
                let of = |row: &[f64]| row.try_into().ok().and_then(of_matrix).unwrap_or([f64::NAN; 4]);
                turned = Some((at, rows().map(of).collect()));
            }
            4 if mostly(&is_quaternion) => {
                turned = Some((at, rows().map(|row| quaternion_in(row, &called)).collect()));
            }
            7 if mostly(&|row| is_quaternion(&row[3..])) => {
                track([0, 1, 2], rows().map(|row| quaternion_in(&row[3..], &called)).collect());
            }
            6 if POSES.iter().any(|word| called.contains(word)) => {
                let three: Vec<[f64; 3]> = rows().map(|row| [row[3], row[4], row[5]]).collect();
                let (orientation, words) = of_three(&three, Turns::Vector, None);
                table.notes.push(format!("the last three numbers of {name} are read as {words}"));
                track([0, 1, 2], orientation);
            }
            3 => points.push(at),
            _ => {}
        }
    }
    for at in &points {
        let Column { name, values: Values::Lists { flat, .. } } = &table.columns[*at] else { continue };
        let position = flat.chunks_exact(3).map(|row| [row[0], row[1], row[2]]).collect();
        let orientation = turned.as_ref().filter(|_| points.len() == 1).map(|(_, turned)| turned.clone());
        tracks.push(Track { name: name.clone(), position, orientation });
        used.push(*at);
    }
    used.extend(turned.filter(|_| points.len() == 1).map(|(at, _)| at));
}

/// The rotation of a matrix of three or four rows of four.
fn matrix_in(row: &[f64]) -> Option<[f64; 4]> {
    let last = row.get(12..).unwrap_or_default();
    let is_affine = last.is_empty() || last == [0.0, 0.0, 0.0, 1.0];
    let turn = [row[0], row[1], row[2], row[4], row[5], row[6], row[8], row[9], row[10]];
    is_affine.then(|| of_matrix(&turn)).flatten()
}

/// As x, y, z, w, unless the name says that w is the first.
fn quaternion_in(row: &[f64], called: &str) -> [f64; 4] {
    match called.contains("wxyz") {
        true => [row[1], row[2], row[3], row[0]],
        false => [row[0], row[1], row[2], row[3]],
    }
}

/// Of columns without names: four that are a quaternion behind three others are a pose; of seven to ten without one, the last three
/// are a point.
fn unnamed_pose(table: &mut Table, tracks: &mut Vec<Track>, used: &mut Vec<usize>) {
    let width = table.columns.len();
    if !table.columns.iter().all(|column| column.name.starts_with("column_")) {
        return;
    }
    let is_turn = |first: &usize| {
        let rows = rows_of(table, [*first, first + 1, first + 2, first + 3]).unwrap_or_default();
        rows.iter().filter(|row| is_quaternion(&row[..])).count() as f64 > MOST * table.rows() as f64
    };
    let turn = (3..width.saturating_sub(3)).find(is_turn);
    let first = turn.map(|turn| turn - 3).or_else(|| (5..=10).contains(&width).then(|| width - 3));
    let Some(position) = first.and_then(|first| rows_of(table, [first, first + 1, first + 2])) else {
        return;
    };
    let orientation = turn.and_then(|turn| rows_of(table, [turn, turn + 1, turn + 2, turn + 3]));
    let behind = first.unwrap_or(0)..first.unwrap_or(0) + if turn.is_some() { 7 } else { 3 };
    table.notes.push(format!(
        "it has no header: columns {} to {} are taken for the {}",
        behind.start + 1,
        behind.end,
        if turn.is_some() { "pose, with its quaternion as x, y, z, w" } else { "point" }
    ));
    used.extend(behind);
    tracks.push(Track { name: "tip".to_owned(), position, orientation });
}
