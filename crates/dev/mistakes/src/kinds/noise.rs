//! Noise that is not what is declared.

use super::{BOARD, Kind, POSES, SEEN, about_anything, kind, whole};
use crate::rigs::{Body, Source};
use crate::{Draw, Error, Session};
use toml::Value;

pub const KINDS: &[Kind] = &[
    whole("board-tolerance-underdeclared", "noise-underdeclared", BOARD, |s, d| {
        scale_tolerances(s, d.uniform(0.02, 0.1))
    }),
    whole("board-tolerance-overdeclared", "noise-overdeclared", BOARD, |s, d| {
        scale_tolerances(s, d.uniform(8.0, 30.0))
    }),
    kind("seats-worn-out", "noise-underdeclared", BOARD, wear_cavities),
    whole("sensor-noise-underdeclared", "noise-underdeclared", SEEN, sway_mount),
    whole("sensor-noise-overdeclared", "noise-overdeclared", POSES, overdeclare_noise),
];

fn scale_tolerances(session: &mut Session, factor: f64) {
    for key in ["cavity_sigma_mm", "seat_sigma_mm"] {
        if let Some(Value::Float(sigma)) = session.board.as_mut().and_then(|b| b.get_mut(key)) {
            *sigma *= factor;
        }
    }
}

/// Cavities that were used for years: half a millimetre off their drawing.
fn wear_cavities(session: &mut Session, draw: &mut Draw) -> Result<Vec<String>, Error> {
    let Source::Lab(config) = &session.source else { return about_anything() };
    let mut config = config.clone();
    config.board.true_cavity_sigma_mm = Some(draw.uniform(0.4, 0.9));
    *session = Session::of_lab(session.rig, *config)?;
    about_anything()
}

/// A mount that sways: an error that is constant through a rest and another in the next.
fn sway_mount(session: &mut Session, draw: &mut Draw) {
    let size_m = draw.uniform(0.6e-3, 1.5e-3);
    let ends: Vec<Vec<i64>> = session
        .recordings
        .iter()
        .map(|r| r.rests.iter().map(|rest| rest.end_ns + 150_000_000).collect())
        .collect();
    let offsets: Vec<Vec<_>> = ends
        .iter()
        .map(|ends| (0..=ends.len()).map(|_| draw.direction() * (size_m * draw.normal())).collect())
        .collect();
    session.poses(Body::Tip, |at, p, _| {
        *p += offsets[at.recording][ends[at.recording].partition_point(|end| *end <= at.stamp_ns)];
    });
}

fn overdeclare_noise(session: &mut Session, draw: &mut Draw) {
    session.set(&["observations", "sensor_sigma_mm"], draw.uniform(1.0, 3.0));
    session.set(&["observations", "sensor_sigma_deg"], draw.uniform(0.1, 0.3));
}
