//! Arms and observations in which every driver of every effect varies.

use super::super::{EffectSpec, EffectTable, Offered, Session, Target, catalogue};
use crate::tests::{RIGHT_ARM, UR10, dh, observation, urdf};
use crate::{Frame, Frames, Model};
use armcal_core::{Arrival, DwellId, Observation, Pose, Reference};
use nalgebra::{Translation3, UnitQuaternion, Vector3};

/// A small reproducible generator (Knuth's MMIX); uniform in [0, 1).
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Random {
        Random(seed)
    }

    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

fn pose(xyz: [f64; 3], rpy: [f64; 3]) -> Pose {
    Pose::from_parts(
        Translation3::from(Vector3::from(xyz)),
        UnitQuaternion::from_euler_angles(rpy[0], rpy[1], rpy[2]),
    )
}

fn framed(chain: crate::Chain, tool_m: [f64; 3]) -> Model {
    let board = |recording: usize| {
        let tilt = 0.2 * recording as f64;
        Frame::estimated(format!("board.{recording}"), pose([0.42, 0.02, 0.1], [tilt, -0.1, 0.3]))
    };
    let frames = Frames {
        base: Frame::estimated("base", pose([0.03, -0.02, 0.01], [0.02, -0.03, 0.4])),
        tip: Frame { free_rotation: false, ..Frame::estimated("tip", pose(tool_m, [0.0; 3])) },
        markers: Vec::new(),
        boards: (0..3).map(board).collect(),
    };
    Model::new(chain, frames).expect("frames without a fault")
}

/// The paper's three joints.
pub fn paper() -> Model {
    framed(dh(RIGHT_ARM), [0.0; 3])
}

/// Six joints.
pub fn ur10() -> Model {
    framed(dh(UR10), [0.02, 0.01, 0.1])
}

/// Turning, sliding, turning, in modified DH.
pub fn scara() -> Model {
    let row = |name: &str, joint: &str, a: f64, alpha: f64| {
        format!(
            "[[rows]]\nname = '{name}'\njoint = '{joint}'\ntheta_deg = 10.0\nd_mm = 30.0\na_mm = {a}\nalpha_deg = {alpha}\n"
        )
    };
    let rows = row("turn", "revolute", 0.0, 2.0) + &row("slide", "prismatic", 300.0, 90.0);
    let text =
        format!("name = 'scara'\nconvention = 'modified'\n{rows}{}", row("wrist", "revolute", 200.0, -85.0));
    framed(dh(&text), [0.1, 0.0, 0.05])
}

/// Seven joints of a URDF.
pub fn panda() -> Model {
    framed(urdf(PANDA, "panda_link0", "panda_link8"), [0.0, 0.02, 0.1])
}

const PANDA: &str = include_str!("../../tests/panda.urdf");

/// Wide poses in three recordings; half of the dwells tracked, half seated, unless `tracked_only`.
pub fn observations(model: &Model, count: usize, tracked_only: bool) -> Vec<Observation> {
    let mut random = Random::new(7);
    let n = model.joint_count();
    (0..count)
        .map(|i| {
            let joints: Vec<f64> = (0..n).map(|_| random.within(-1.2, 1.2)).collect();
            let reference = if tracked_only || i % 2 == 0 {
                Reference::Tracked {
                    position_m: Vector3::from_fn(|_, _| random.within(0.2, 0.5)),
                    orientation: (i % 4 == 0)
                        .then(|| UnitQuaternion::from_euler_angles(0.3, random.within(-1.0, 1.0), 0.2)),
                    orientation_sigma_rad: 1e-4,
                }
            } else {
                Reference::Seated {
                    cavity: format!("c{}", i % 10),
                    in_board_m: Vector3::from_fn(|_, _| random.within(-0.1, 0.1)),
                }
            };
            let mut o = observation(&joints, reference);
            let recording = 3 * i / count;
            o.dwell = DwellId { recording, dwell: i - (recording * count).div_ceil(3) };
            o.time_ns = i as i64 * 20_000_000_000;
            o.arrival = (0..n)
                .map(|_| if random.next() < 0.5 { Arrival::Positive } else { Arrival::Negative })
                .collect();
            o.path_memory_rad = (i % 3 == 0).then(|| {
                let memory = |(q, s): (&f64, &Arrival)| {
                    // The last leg is shorter than a wide gap now and then.
                    let last = random.within(0.001, 0.05) * s.sign();
                    vec![q + 0.3 * s.sign(), q - last, *q]
                };
                joints.iter().zip(&o.arrival).map(memory).collect()
            });
            o.effort_nm = Some((0..n).map(|_| random.within(-20.0, 20.0)).collect());
            o.moved_rad = (i > 0).then(|| (0..n).map(|_| random.within(-0.8, 0.8)).collect());
            o.joint_velocity_radps = Some((0..n).map(|_| random.within(-0.5, 0.5)).collect());
            o.temperature_c = Some(20.0 + 6.0 * random.next());
            o.load_kg = if random.next() < 0.5 { 0.0 } else { 0.5 };
            o
        })
        .collect()
}

/// Every spec worth a test: the candidates and some members of every scan.
pub fn specs(model: &Model, observations: &[Observation]) -> Vec<EffectSpec> {
    let session = Session::of(observations);
    let mut specs = model.candidates(&session);
    for (_, members) in model.scans(&session, observations) {
        specs.push(members[0].clone());
        specs.extend((members.len() > 1).then(|| members[members.len() / 2].clone()));
    }
    let placed = |spec: &EffectSpec| model.with_effects(std::slice::from_ref(spec), &session).is_ok();
    let unoffered = catalogue().iter().filter(|kind| kind.offered == Offered::Never);
    let somewhere = unoffered.map(|kind| EffectSpec {
        target: (kind.target == Target::Joint).then_some(0),
        ..EffectSpec::new(kind.name)
    });
    specs.extend(somewhere.filter(placed));
    specs.extend(EXPRESSIONS.iter().map(|text| table(text, model)));
    specs
}

/// Formulas on a joint, a parameter, the world and all lengths, with every driver among them.
pub const EXPRESSIONS: [&str; 4] = [
    "kind = 'expression'
     name = 'cable'
     formula = 'k * sin(q1) * tanh(tau2 / (T + 4)) + 0.3 * s3 * k'
     acts_on = 'q3'
     parameters.k = { unit = 'deg', prior = 0.3 }
     parameters.T = { unit = 'N*m', bound = 3.0, prior = 0.5 }",
    "kind = 'expression'
     name = 'creep'
     formula = 'a * (temperature - 20) + b * load'
     acts_on = 'tip.x'
     parameters.a = { unit = 'mm/K', prior = 0.05 }
     parameters.b = { unit = 'm/kg', bound = 0.01 }",
    "kind = 'expression'
     name = 'sway'
     formula = 'c * t * abs(effort2) * sqrt(load + 1)^2 / 1000'
     acts_on = 'world.z'
     parameters.c = { prior = 1e-6 }",
    "kind = 'expression'
     name = 'room'
     formula = 'g * sin(t / 60)'
     acts_on = 'lengths'
     parameters.g = { unit = '1', prior = 1e-3 }",
];

/// The spec of an `[[effects]]` table.
pub fn table(text: &str, model: &Model) -> EffectSpec {
    let table: EffectTable = toml::from_str(text).expect("a table");
    table.spec(model.chain().joint_names()).expect("a spec")
}

/// A parameter vector with every free parameter away from its nominal value by about its prior.
pub fn displaced(model: &Model, seed: u64, size: f64) -> Vec<f64> {
    let mut random = Random::new(seed);
    let displaced = |p: &armcal_core::Parameter| {
        let away = p.prior_sigma.unwrap_or(0.0).min(0.02) * random.within(0.5, 1.5) * size;
        let sign = if random.next() < 0.5 { -1.0 } else { 1.0 };
        p.nominal + if p.free { sign * away } else { 0.0 }
    };
    model.parameters().iter().map(displaced).collect()
}

/// Makes the model at `truth` predict every observation exactly.
pub fn observe(model: &Model, truth: &[f64], observations: &mut [Observation]) {
    for o in observations {
        // Only positions are planted.
        if let Reference::Tracked { orientation, .. } = &mut o.reference {
            *orientation = None;
        }
        for _ in 0..4 {
            let residual = model.residual(truth, o).position_m;
            let board = model.board_in_world(truth, o.dwell.recording);
            match (&mut o.reference, board) {
                (Reference::Tracked { position_m, .. }, _) => *position_m -= residual,
                (Reference::Seated { in_board_m, .. }, Some(board)) => {
                    *in_board_m -= board.rotation.inverse() * residual;
                }
                _ => {}
            }
        }
    }
}
