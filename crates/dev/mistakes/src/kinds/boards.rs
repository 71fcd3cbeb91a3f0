//! The calibration table: drawn, placed and tilted otherwise than it says.

use super::{BOARD, Kind, TABLE, kind, whole};
use crate::session::Session;
use crate::{Draw, Error};
use toml::{Table, Value};

pub const KINDS: &[Kind] = &[
    whole("board-drawn-from-below", "board-mirrored", BOARD, |s, _| change_cavities(s, |mm| mm[1] = -mm[1])),
    whole("board-x-mirrored", "board-mirrored", BOARD, |s, _| change_cavities(s, |mm| mm[0] = -mm[0])),
    whole("board-x-and-y-swapped", "board-mirrored", BOARD, |s, _| change_cavities(s, |mm| mm.swap(0, 1))),
    whole("board-turned-by-a-quarter", "board-turned", BOARD, |s, _| {
        change_cavities(s, |mm| *mm = [-mm[1], mm[0], mm[2]])
    }),
    whole("board-turned-by-a-half", "board-turned", BOARD, |s, _| {
        change_cavities(s, |mm| *mm = [-mm[0], -mm[1], mm[2]])
    }),
    whole("board-turned-a-little", "board-turned", BOARD, turned_a_little),
    whole("board-z-down", "board-turned", BOARD, |s, _| {
        change_cavities(s, |mm| *mm = [mm[0], -mm[1], -mm[2] - 12.0])
    }),
    whole("board-shrunk", "board-scale", BOARD, scale_board),
    whole("board-stretched-along-x", "board-scale", BOARD, stretch_board),
    whole("board-in-metres", "board-unit", BOARD, |s, _| {
        change_cavities(s, |mm| mm.iter_mut().for_each(|v| *v *= 1e-3))
    }),
    whole("board-in-inches", "board-unit", BOARD, |s, _| {
        change_cavities(s, |mm| mm.iter_mut().for_each(|v| *v /= 25.4))
    }),
    whole("board-of-another-pitch", "wrong-board", BOARD, another_pitch),
    whole("board-of-another-make", "wrong-board", BOARD, another_make),
    whole("board-origin-at-a-corner", "board-moved", BOARD, |s, _| {
        change_cavities(s, |mm| *mm = [mm[0] + 110.0, mm[1] + 150.0, mm[2]])
    }),
    whole("board-slid-under-its-markers", "board-moved", TABLE, slide_board),
    whole("seats-higher-than-drawn", "seat-height", BOARD, seat_height),
    whole("line-of-cavities-deeper", "seat-height", BOARD, line_deeper),
    kind("one-cavity-mistyped", "board-typo", BOARD, mistype_cavity),
    whole("two-cavities-swapped-in-the-file", "board-typo", BOARD, swap_cavities),
    whole("visiting-order-backwards", "visiting-order", BOARD, visiting_order),
    whole("tilt-of-the-other-sign", "tilt-declared-wrong", BOARD, |s, _| {
        change_tilts(s, |roll, pitch| [-roll, -pitch])
    }),
    whole("roll-and-pitch-swapped", "tilt-declared-wrong", BOARD, |s, _| {
        change_tilts(s, |roll, pitch| [pitch, roll])
    }),
    whole("tilt-in-radians", "tilt-declared-wrong", BOARD, |s, _| {
        change_tilts(s, |roll, pitch| [roll.to_radians(), pitch.to_radians()])
    }),
    whole("tilt-not-declared", "tilt-declared-wrong", BOARD, |s, _| change_tilts(s, |_, _| [0.0, 0.0])),
    whole("tilts-of-other-recordings", "tilt-declared-wrong", BOARD, tilts_shifted),
    whole("tilt-pivot-elsewhere", "tilt-declared-wrong", BOARD, move_pivot),
    whole("board-upside-down-placed", "board-turned", TABLE, placed_upside_down),
    whole("board-placed-beside-its-subject", "board-moved", TABLE, placed_beside),
];

fn change_cavities(session: &mut Session, change: fn(&mut [f64; 3])) {
    session.cavities(|_, mm| change(mm));
}

fn turned_a_little(session: &mut Session, draw: &mut Draw) {
    let (sin, cos) = draw.signed(6.0, 20.0).to_radians().sin_cos();
    session.cavities(|_, mm| *mm = [cos * mm[0] - sin * mm[1], sin * mm[0] + cos * mm[1], mm[2]]);
}

fn scale_board(session: &mut Session, draw: &mut Draw) {
    let factor = 1.0 + draw.signed(0.015, 0.05);
    session.cavities(|_, mm| mm.iter_mut().for_each(|v| *v *= factor));
}

fn stretch_board(session: &mut Session, draw: &mut Draw) {
    let factor = 1.0 + draw.signed(0.02, 0.06);
    session.cavities(|_, mm| mm[0] *= factor);
}

/// The next size of the same design: 30 mm apart instead of 25.
fn another_pitch(session: &mut Session, _: &mut Draw) {
    session.cavities(|_, mm| (mm[0], mm[1]) = (1.2 * mm[0], 1.2 * mm[1]));
}

/// A grid of 6 by 5, 40 mm apart.
fn another_make(session: &mut Session, _: &mut Draw) {
    let cavity = |i: usize| {
        let xyz = [40.0 * (i % 6) as f64 - 100.0, 40.0 * (i / 6) as f64 - 80.0, 0.0];
        let keys =
            [("name", format!("grid{i:02}").into()), ("xyz_mm", xyz.map(Value::Float).to_vec().into())];
        Value::Table(keys.map(|(k, v): (&str, Value)| (k.to_owned(), v)).into_iter().collect())
    };
    if let Some(board) = &mut session.board {
        board.insert("cavities".into(), (0..30).map(cavity).collect::<Vec<_>>().into());
    }
}

/// The plate with the markers was knocked between recordings; the board stands where it stood.
fn slide_board(session: &mut Session, draw: &mut Draw) {
    let offset = draw.direction() * draw.uniform(0.008, 0.025);
    session.poses(crate::rigs::Body::Table, |at, p, _| {
        if at.recording >= 1 {
            *p += offset;
        }
    });
}

fn seat_height(session: &mut Session, draw: &mut Draw) {
    let height = draw.signed(5.0, 12.0);
    session.cavities(|_, mm| mm[2] += height);
}

fn line_deeper(session: &mut Session, draw: &mut Draw) {
    let height = draw.signed(3.0, 8.0);
    session.cavities(|i, mm| mm[2] += if i >= 20 { height } else { 0.0 });
}

fn mistype_cavity(session: &mut Session, draw: &mut Draw) -> Result<Vec<String>, Error> {
    let (cavity, axis) = (draw.pick(33), draw.pick(2));
    let error = draw.signed(4.0, 9.0);
    session.cavities(|i, mm| mm[axis] += if i == cavity { error } else { 0.0 });
    let name =
        if cavity < 20 { format!("circle{:02}", cavity + 1) } else { format!("line{:02}", cavity - 19) };
    Ok(vec![name])
}

fn swap_cavities(session: &mut Session, draw: &mut Draw) {
    let first = draw.pick(19);
    let mut all = Vec::new();
    session.cavities(|_, mm| all.push(*mm));
    all.swap(first, first + 1);
    session.cavities(|i, mm| *mm = all[i]);
}

fn visiting_order(session: &mut Session, _: &mut Draw) {
    let name = |i: usize| if i < 20 { format!("circle{:02}", i + 1) } else { format!("line{:02}", i - 19) };
    let order: Vec<Value> = (0..33).rev().map(|i| Value::String(name(i))).collect();
    session.set(&["table", "association", "visiting_order"], order);
}

fn change_tilts(session: &mut Session, change: fn(f64, f64) -> [f64; 2]) {
    for entry in session.entries().iter_mut().filter_map(Value::as_table_mut) {
        let tilt = |key: &str| entry["tilt"].get(key).and_then(Value::as_float).unwrap_or_default();
        let [roll, pitch] = change(tilt("roll_deg"), tilt("pitch_deg"));
        let keys = [("roll_deg", roll), ("pitch_deg", pitch)];
        let tilt: Table = keys.into_iter().map(|(k, v)| (k.to_owned(), Value::Float(v))).collect();
        entry.insert("tilt".into(), tilt.into());
    }
}

fn tilts_shifted(session: &mut Session, _: &mut Draw) {
    let mut tilts: Vec<Value> = session.entries().iter().map(|entry| entry["tilt"].clone()).collect();
    tilts.rotate_left(1);
    for (entry, tilt) in session.entries().iter_mut().filter_map(Value::as_table_mut).zip(tilts) {
        entry.insert("tilt".into(), tilt);
    }
}

fn move_pivot(session: &mut Session, draw: &mut Draw) {
    let z = -60.0 + draw.signed(30.0, 60.0);
    let xyz: Vec<Value> = [draw.signed(10.0, 40.0), 0.0, z].map(Value::Float).to_vec();
    if let Some(Value::Table(mechanism)) = session.board.as_mut().and_then(|b| b.get_mut("mechanism")) {
        mechanism.insert("pivot_xyz_mm".into(), xyz.into());
    }
}

fn place_board(session: &mut Session, xyz_m: [f64; 3], rpy_deg: [f64; 3]) {
    session.set(&["table", "at", "xyz_m"], xyz_m.map(Value::Float).to_vec());
    session.set(&["table", "at", "rpy_deg"], rpy_deg.map(Value::Float).to_vec());
}

fn placed_upside_down(session: &mut Session, _: &mut Draw) {
    place_board(session, [0.0; 3], [180.0, 0.0, 0.0]);
}

fn placed_beside(session: &mut Session, draw: &mut Draw) {
    let xyz = [draw.signed(0.02, 0.08), draw.signed(0.02, 0.08), draw.signed(0.005, 0.02)];
    place_board(session, xyz, [0.0; 3]);
}
