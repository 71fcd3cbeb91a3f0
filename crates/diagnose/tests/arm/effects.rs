//! Effects of the test arm: those that are listed, and those that are not.

use super::{GEOMETRY, Pose, fk};
use armcal_core::Unit;
use armcal_diagnose::{DependsOn, EntersAt, Toggle};
use nalgebra::Vector3;
use std::sync::Arc;

/// Normalised gravity torques of joints 2 and 3.
pub fn torque(q: [f64; 3]) -> [f64; 3] {
    let (u2, u3) = (1.0, 0.55);
    let t3 = -u3 * (q[1] + q[2]).cos();
    [0.0, u2 * q[1].sin() + t3, t3]
}

/// A planted or listed effect: displacement of the tip for amplitudes `a` (SI).
pub type Effect = Arc<dyn Fn(&Pose, &[f64], f64) -> Vector3<f64>>;

fn at(q: [f64; 3], dq: [f64; 3]) -> Vector3<f64> {
    fk(std::array::from_fn(|k| q[k] + dq[k]), &[0.0; GEOMETRY]) - fk(q, &[0.0; GEOMETRY])
}

/// An effect on one joint.
pub fn on_joint(j: usize, f: impl Fn(&Pose, &[f64], f64) -> f64 + 'static) -> Effect {
    Arc::new(move |p, a, span| {
        let mut dq = [0.0; 3];
        dq[j] = f(p, a, span);
        at(p.q, dq)
    })
}

pub struct Listed {
    pub spec: String,
    pub family: &'static str,
    pub typical: Vec<f64>,
    pub unit: Unit,
    pub toggle: Toggle,
    pub effect: Effect,
}

/// The catalogue of the test arm.
pub fn catalogue(poses: &[Pose]) -> Vec<Listed> {
    let deg = std::f64::consts::PI / 180.0;
    let mut all: Vec<Listed> = Vec::new();
    let mut add = |spec: String, family, typical: &[f64], unit, toggle, effect: Effect| {
        all.push(Listed { spec, family, typical: typical.to_vec(), unit, toggle, effect });
    };
    use Toggle::*;
    for j in 0..3 {
        let n = j + 1;
        add(
            format!("backlash:{n}"),
            "backlash",
            &[0.5 * deg],
            Unit::Radian,
            Direction,
            on_joint(j, move |p, a, _| -0.5 * a[0] * p.s[j]),
        );
        add(
            format!("eccentricity:{n}"),
            "eccentricity",
            &[0.5 * deg; 2],
            Unit::Radian,
            None,
            on_joint(j, move |p, a, _| a[0] * p.q[j].sin() + a[1] * p.q[j].cos()),
        );
        add(
            format!("two_per_turn:{n}"),
            "two_per_turn",
            &[0.25 * deg; 2],
            Unit::Radian,
            None,
            on_joint(j, move |p, a, _| a[0] * (2.0 * p.q[j]).sin() + a[1] * (2.0 * p.q[j]).cos()),
        );
        add(
            format!("scale:{n}"),
            "scale",
            &[0.01],
            Unit::One,
            None,
            on_joint(j, move |p, a, _| a[0] * p.q[j]),
        );
        add(
            format!("zero_drift:{n}"),
            "zero_drift",
            &[0.4 * deg],
            Unit::Radian,
            Time,
            on_joint(j, move |p, a, span| a[0] * p.time / span),
        );
    }
    for j in 1..3 {
        let n = j + 1;
        add(
            format!("friction_windup:{n}"),
            "friction_windup",
            &[0.4 * deg],
            Unit::Radian,
            Direction,
            on_joint(j, move |p, a, _| -a[0] * torque(p.q)[j].abs() * p.s[j]),
        );
        add(
            format!("compliance:{n}"),
            "compliance",
            &[0.4 * deg],
            Unit::Radian,
            None,
            on_joint(j, move |p, a, _| a[0] * torque(p.q)[j]),
        );
    }
    add("coupling:3".into(), "coupling", &[0.015], Unit::One, None, on_joint(2, |p, a, _| a[0] * p.q[1]));
    add(
        "base_compliance".into(),
        "base_compliance",
        &[0.3 * deg],
        Unit::Radian,
        None,
        Arc::new(|p, a, _| {
            let w = Vector3::new(p.q[0].sin(), -p.q[0].cos(), 0.0) * (a[0] * torque(p.q)[1]);
            w.cross(&fk(p.q, &[0.0; GEOMETRY]))
        }),
    );
    add(
        "thermal".into(),
        "thermal",
        &[0.002],
        Unit::One,
        Time,
        Arc::new(|p, a, span| {
            let mut g = [0.0; GEOMETRY];
            let grown = a[0] * (1.0 - (-3.0 * p.time / span).exp());
            (g[6], g[14]) = (0.4 * grown, 0.3543 * grown);
            fk(p.q, &g) - fk(p.q, &[0.0; GEOMETRY])
        }),
    );
    add(
        "frame_drift".into(),
        "frame_drift",
        &[1e-3; 3],
        Unit::Metre,
        Time,
        Arc::new(|p, a, span| Vector3::new(a[0], a[1], a[2]) * (p.time / span)),
    );
    let recordings = poses.iter().map(|p| p.recording).max().unwrap_or(0);
    for r in 1..=recordings {
        for j in 0..3 {
            add(
                format!("zero_slip:{}@{r}", j + 1),
                "zero_slip",
                &[0.3 * deg],
                Unit::Radian,
                Recording,
                on_joint(j, move |p, a, _| if p.recording == r { a[0] } else { 0.0 }),
            );
        }
        add(
            format!("tool_shift@{r}"),
            "tool_shift",
            &[1.5e-3; 3],
            Unit::Metre,
            Recording,
            Arc::new(move |p, a, _| {
                let mut g = [0.0; GEOMETRY];
                g[12..15].copy_from_slice(a);
                if p.recording == r { fk(p.q, &g) - fk(p.q, &[0.0; GEOMETRY]) } else { Vector3::zeros() }
            }),
        );
        add(
            format!("frame_shift@{r}"),
            "frame_shift",
            &[1.5e-3, 1.5e-3, 1.5e-3, 0.15 * deg, 0.15 * deg, 0.15 * deg],
            Unit::Metre,
            Recording,
            Arc::new(move |p, a, _| {
                if p.recording == r {
                    let x = fk(p.q, &[0.0; GEOMETRY]) - Vector3::new(0.42, 0.0, 0.1);
                    Vector3::new(a[0], a[1], a[2]) + Vector3::new(a[3], a[4], a[5]).cross(&x)
                } else {
                    Vector3::zeros()
                }
            }),
        );
    }
    all
}

/// Effects outside the catalogue, with the channel and driver that are right.
pub fn outside(deg_scale: f64) -> Vec<(&'static str, EntersAt, DependsOn, Effect)> {
    use DependsOn::{Angle, Direction, SessionTime};
    use EntersAt::Joint;
    let deg = std::f64::consts::PI / 180.0 * deg_scale;
    vec![
        ("cable", Joint(1), Angle(0), on_joint(1, move |p, _, _| 0.4 * deg * ((p.q[0] - 0.1) / 0.06).tanh())),
        (
            "worn",
            Joint(0),
            Direction(0),
            on_joint(0, move |p, _, _| -0.3 * deg * p.s[0] * (1.0 + 4.0 * p.q[0])),
        ),
        ("crossed", Joint(2), Direction(1), on_joint(2, move |p, _, _| -0.3 * deg * p.s[1])),
        (
            "cycling",
            Joint(1),
            SessionTime,
            on_joint(1, move |p, _, span| 0.3 * deg * (12.0 * p.time / span).sin()),
        ),
        (
            "bump",
            Joint(0),
            Angle(0),
            on_joint(0, move |p, _, _| 0.5 * deg * (-((p.q[0] - 0.05) / 0.05).powi(2)).exp()),
        ),
        ("twist", Joint(2), Angle(0), on_joint(2, move |p, _, _| 0.4 * deg * (9.0 * p.q[0]).sin())),
    ]
}
