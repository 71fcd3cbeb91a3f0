//! The board: mirrored, turned, scaled, drawn at another height, fixed to other markers; tilts that are declared wrong.

use super::Hypothesis;
use armcal_config::{BoardPose, MarkersOn};
use armcal_core::Code;
use armcal_stages::Inputs;
use armcal_table::{Board, Tilt};
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeSet;

const FILE: &str = "mend the board file or take the right one";
const TILT: &str = "mend `tilt` of the recordings";
const MARKERS: &str = "mend `markers_on` or `at` of [table]";

/// Scales that are tried, the first and the last only as neighbours; beyond three in a hundred neither heat nor printing
/// explains one.
const SCALES: [f64; 13] = [0.7, 0.8, 0.87, 0.92, 0.96, 1.0, 1.04, 1.08, 1.13, 1.2, 1.3, 1.5, 1.8];
const FAR_SCALE: f64 = 0.03;
/// Slips of units.
const UNITS: [f64; 4] = [0.1, 10.0, 25.4, 1.0 / 25.4];
/// Cavities that share a name but for its number are drawn together: of more groups than this, none is tried alone.
const MOST_GROUPS: usize = 4;
const GROUP_HEIGHTS_MM: [f64; 9] = [-20.0, -10.0, -5.0, -2.5, 0.0, 2.5, 5.0, 10.0, 20.0];
const FAR_GROUP_MM: f64 = 1.0;
/// Heights of a seated tip's centre above the drawn one [mm]; beyond 2 mm it is no seat.
const HEIGHTS_MM: [f64; 13] = [-80.0, -40.0, -20.0, -10.0, -5.0, -2.5, 0.0, 2.5, 5.0, 10.0, 20.0, 40.0, 80.0];
const FAR_HEIGHT_MM: f64 = 2.0;

pub fn hypotheses(inputs: &Inputs) -> Vec<Hypothesis> {
    let (Some(_), Some(table)) = (&inputs.board, &inputs.pipeline.table) else { return Vec::new() };
    let mut all = Vec::new();
    for (matrix, words, code) in symmetries() {
        let change = format!("the board {words}");
        all.push(Hypothesis::new(code, "the board", change, FILE, move |i| map_cavities(i, |p| matrix * p)));
    }
    all.extend(UNITS.map(scaled_board));
    all.extend(Hypothesis::of_each(&SCALES, 1.0, FAR_SCALE, scaled_board));
    if !takes_any_height(inputs) {
        all.extend(Hypothesis::of_each(&HEIGHTS_MM, 0.0, FAR_HEIGHT_MM, raised_seats));
    }
    for group in cavity_groups(&inputs.board) {
        let at = move |height_mm| raised_alone(&group, height_mm);
        all.extend(Hypothesis::of_each(&GROUP_HEIGHTS_MM, 0.0, FAR_GROUP_MM, at));
    }
    if table.pose == BoardPose::Measured {
        let (other, words) = match table.markers_on {
            MarkersOn::Board => (MarkersOn::Frame, "the frame below the tilting mechanism"),
            MarkersOn::Frame => (MarkersOn::Board, "the board itself"),
        };
        let change = format!("the table's markers on {words}");
        all.push(Hypothesis::new(Code::MarkersOn, "the table", change, MARKERS, move |i| {
            if let Some(table) = &mut i.pipeline.table {
                table.markers_on = other;
            }
        }));
    }
    all.extend(tilt_hypotheses(inputs));
    all
}

/// A board drawn from its other side: the outline mirrored, and the seats measured from another face. Rarer.
pub fn from_the_other_side(inputs: &Inputs) -> Vec<Hypothesis> {
    let Some(board) = inputs.board.as_ref().filter(|_| !takes_any_height(inputs)) else { return Vec::new() };
    let is_flat = board.cavities.iter().all(|c| c.in_board_m.z == 0.0);
    // One axis of the outline reversed, whatever becomes of the heights: of a board that has none, it is mirrored.
    let outlines = symmetries().into_iter().filter(|(matrix, ..)| matrix.m11 * matrix.m22 < 0.0);
    let mirrored = outlines.filter(|(matrix, ..)| !is_flat || matrix.m33 > 0.0);
    let of_each = |(matrix, words, code): (Matrix3<f64>, &'static str, Code)| {
        let at = move |height_mm: f64| {
            let change = format!("the board {words} and its seats {}", describe_height(height_mm));
            Hypothesis::new(code, "the board", change, FILE, move |i| {
                map_cavities(i, |p| matrix * p + vertical_shift_m(height_mm));
            })
        };
        Hypothesis::of_each(&HEIGHTS_MM, 0.0, FAR_HEIGHT_MM, at)
    };
    mirrored.flat_map(of_each).collect()
}

/// Whether the height of all seats changes nothing: there are none, or the pose of their board is estimated in every recording.
fn takes_any_height(inputs: &Inputs) -> bool {
    inputs.pipeline.table.as_ref().is_none_or(|table| table.pose == BoardPose::Estimated)
}

/// Names of cavities without their numbers, where there is more than one.
fn cavity_groups(board: &Option<Board>) -> Vec<String> {
    let names = board.iter().flat_map(|b| &b.cavities).map(|c| group_of(&c.name).to_owned());
    let all: BTreeSet<String> = names.collect();
    if (2..=MOST_GROUPS).contains(&all.len()) { all.into_iter().collect() } else { Vec::new() }
}

fn group_of(name: &str) -> &str {
    name.trim_end_matches(|c: char| c.is_ascii_digit())
}

fn scaled_board(scale: f64) -> Hypothesis {
    let change = format!("the board {scale:.4} times as large");
    Hypothesis::new(Code::BoardScale, "the board", change, FILE, move |i| map_cavities(i, |p| scale * p))
}

fn raised_seats(height_mm: f64) -> Hypothesis {
    let change = format!("seated points {} than drawn", describe_height(height_mm));
    Hypothesis::new(Code::SeatHeight, "the board", change, FILE, move |i| {
        map_cavities(i, |p| p + vertical_shift_m(height_mm));
    })
}

fn raised_alone(group: &str, height_mm: f64) -> Hypothesis {
    let (subject, group) = (format!("cavities `{group}…`"), group.to_owned());
    let change = format!("the seats of the {subject} {} than drawn", describe_height(height_mm));
    Hypothesis::new(Code::SeatHeight, subject, change, FILE, move |i| {
        let own = i.board.iter_mut().flat_map(|b| &mut b.cavities).filter(|c| group_of(&c.name) == group);
        own.for_each(|c| c.in_board_m += vertical_shift_m(height_mm));
    })
}

fn vertical_shift_m(height_mm: f64) -> Vector3<f64> {
    Vector3::new(0.0, 0.0, height_mm * 1e-3)
}

/// `2.50 mm higher`.
fn describe_height(height_mm: f64) -> String {
    let side = if height_mm > 0.0 { "higher" } else { "lower" };
    format!("{:.2} mm {side}", height_mm.abs())
}

/// Boards that look alike to whoever draws them.
fn symmetries() -> Vec<(Matrix3<f64>, &'static str, Code)> {
    let rows = |a: [f64; 9]| Matrix3::from_row_slice(&a);
    vec![
        (rows([-1., 0., 0., 0., 1., 0., 0., 0., 1.]), "mirrored (x reversed)", Code::BoardMirrored),
        (rows([1., 0., 0., 0., -1., 0., 0., 0., 1.]), "mirrored (y reversed)", Code::BoardMirrored),
        (rows([0., 1., 0., 1., 0., 0., 0., 0., 1.]), "with x and y exchanged", Code::BoardMirrored),
        (rows([0., -1., 0., 1., 0., 0., 0., 0., 1.]), "turned by 90 deg", Code::BoardTurned),
        (rows([-1., 0., 0., 0., -1., 0., 0., 0., 1.]), "turned by 180 deg", Code::BoardTurned),
        (rows([0., 1., 0., -1., 0., 0., 0., 0., 1.]), "turned by 270 deg", Code::BoardTurned),
        (rows([1., 0., 0., 0., -1., 0., 0., 0., -1.]), "upside down (about x)", Code::BoardTurned),
        (rows([-1., 0., 0., 0., 1., 0., 0., 0., -1.]), "upside down (about y)", Code::BoardTurned),
    ]
}

fn map_cavities(inputs: &mut Inputs, of: impl Fn(Vector3<f64>) -> Vector3<f64>) {
    let cavities = inputs.board.iter_mut().flat_map(|b| &mut b.cavities);
    cavities.for_each(|c| c.in_board_m = of(c.in_board_m));
}

/// Tilts with another sign, exchanged, left out, or of another recording.
fn tilt_hypotheses(inputs: &Inputs) -> Vec<Hypothesis> {
    let declared: Vec<Tilt> = inputs.pipeline.recordings.iter().map(|r| r.tilt).collect();
    let mut all: Vec<(Vec<Tilt>, String)> = Vec::new();
    let each = |of: fn(Tilt) -> Tilt| declared.iter().map(|t| of(*t)).collect::<Vec<Tilt>>();
    type Turned = fn(Tilt) -> Tilt;
    let changes: [(Turned, &str); 6] = [
        (|t| Tilt { roll_rad: -t.roll_rad, ..t }, "the sign of every roll reversed"),
        (|t| Tilt { pitch_rad: -t.pitch_rad, ..t }, "the sign of every pitch reversed"),
        (|t| Tilt { roll_rad: -t.roll_rad, pitch_rad: -t.pitch_rad }, "the sign of every tilt reversed"),
        (|t| Tilt { roll_rad: t.pitch_rad, pitch_rad: t.roll_rad }, "roll and pitch exchanged"),
        (
            |t| Tilt { roll_rad: t.pitch_rad, pitch_rad: -t.roll_rad },
            "roll and pitch exchanged, one reversed",
        ),
        (|_| Tilt { roll_rad: 0.0, pitch_rad: 0.0 }, "no tilt"),
    ];
    all.extend(changes.into_iter().map(|(of, words)| (each(of), words.to_owned())));
    for a in 0..declared.len() {
        for b in a + 1..declared.len() {
            let mut swapped = declared.clone();
            swapped.swap(a, b);
            let name = |r: usize| inputs.pipeline.recordings[r].name();
            all.push((swapped, format!("the tilts of `{}` and `{}` exchanged", name(a), name(b))));
        }
    }
    let new = all.into_iter().filter(|(tilts, _)| *tilts != declared);
    new.map(|(tilts, words)| {
        Hypothesis::new(Code::TiltDeclared, "the board's tilt", words, TILT, move |i| {
            i.pipeline.recordings.iter_mut().zip(&tilts).for_each(|(r, tilt)| r.tilt = *tilt);
        })
    })
    .collect()
}
