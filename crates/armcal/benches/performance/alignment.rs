//! Cost of aligning the clocks of one recording over its length, and how near the planted offset it comes.

use crate::campaign::{self, Arm, between, drawn, normal};
use crate::clock::{Spent, median, spent};
use crate::page::{Bar, Section, Table};
use crate::{Options, Result};
use armcal_config::Pipeline;
use armcal_core::{FeatureId, JointSamples, PoseSamples};
use armcal_dwell::align_clocks;
use armcal_stages::doubts::Doubts;
use armcal_stages::frames;
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;

/// Lengths of the recording, in words and in poses; one takes [`POSE_S`].
const LENGTHS: [(&str, usize); 4] =
    [("1 min", 46), ("10 min", 462), ("2 h", 5538), ("8 h, a tenth of the rates", 22154)];
/// Rates of encoders and tracker [Hz]; a tenth of both in the last one, which would not fit into memory.
const RATES_HZ: [(f64, f64); 4] = [(1000.0, 250.0), (1000.0, 250.0), (1000.0, 250.0), (100.0, 25.0)];
/// At rest, and with the move to the next pose [s].
const REST_S: f64 = 0.7;
const POSE_S: f64 = 1.3;
/// Noise of an encoder [rad] and of the tracker [m], and how late the tracker's stamps are [s]: at first, and more per second.
const ENCODER_RAD: f64 = 2e-5;
const TRACKER_M: f64 = 2e-5;
const LATE_S: f64 = 0.043;
const DRIFT: f64 = 2e-5;
const START_NS: i64 = 1_760_000_000_000_000_000;
/// Times each is aligned.
const TIMES: usize = 5;
/// Time on a processor that may take [s].
const CPU_S: f64 = 0.15;

pub fn section(options: &Options) -> Result<Section> {
    let pipeline = Pipeline::load(&campaign::place(options, 200, campaign::Weighed::None)?)?;
    let (_, chain) = frames::nominal_chain(&pipeline)?;
    let model = frames::bare_model(&chain, frames::markers(&pipeline))?;
    let doubts = Doubts::of(&pipeline, &model, FeatureId::TIP);
    let mut section = Section::new("Clocks");
    section.say(
        "Offset and drift between encoders and tracker of one recording, aligned by the motion both saw: the arm of the campaign, \
         nominal by its file, samples in memory. Off is the error at the middle of the recording.",
    );
    let mut table =
        Table::new(&["recording", "joint rows", "tip rows", "CPU [s]", "off [us]", "standard error [us]"]);
    let mut most_s = 0.0;
    for ((length, poses), rates_hz) in LENGTHS.into_iter().zip(RATES_HZ) {
        let (joints, tip) = samples(poses, rates_hz);
        let mut costs: Vec<Spent> = Vec::new();
        let mut found = None;
        for _ in 0..TIMES {
            let (aligned, cost) = spent(|| align_clocks(&joints, &tip, &doubts, &pipeline.clock));
            found = Some(aligned?.0);
            costs.push(cost);
        }
        let found = found.ok_or("nothing was aligned")?;
        let cpu_s = median(&costs).cpu_s;
        let middle_s = 0.5 * poses as f64 * POSE_S;
        let (robot_ns, sensor_ns) = (stamp_ns(middle_s), stamp_ns(late(middle_s)));
        table.row([
            length.to_owned(),
            joints.len().to_string(),
            tip.len().to_string(),
            format!("{cpu_s:.3}"),
            format!("{:+.1}", (found.to_robot_ns(sensor_ns) - robot_ns) as f64 * 1e-3),
            format!("{:.1}", found.sigma_s(sensor_ns) * 1e6),
        ]);
        most_s = f64::max(most_s, cpu_s);
    }
    section.table(table);
    section.bar(Bar {
        what: "aligning the clocks of a recording, of any of these lengths".into(),
        limit: format!("<= {CPU_S} CPU s"),
        measured: format!("{most_s:.3} s"),
        met: most_s <= CPU_S,
    });
    Ok(section)
}

/// What encoders and tracker say of so many random poses.
fn samples(poses: usize, (joint_hz, tip_hz): (f64, f64)) -> (JointSamples, PoseSamples) {
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let arm = Arm::built(&mut random);
    let drawn: Vec<[f64; 6]> = (0..=poses).map(|_| drawn(&mut random)).collect();
    let at = |t_s: f64| {
        let pose = (t_s / POSE_S) as usize;
        let u = (t_s - pose as f64 * POSE_S - REST_S).max(0.0) / (POSE_S - REST_S);
        between(&drawn[pose], &drawn[pose + 1], u)
    };
    let rows = |hz: f64| (0..(poses as f64 * POSE_S * hz) as usize).map(move |row| row as f64 / hz);
    let mut joints = JointSamples { joint_rad: vec![Vec::new(); 6], ..JointSamples::default() };
    for t_s in rows(joint_hz) {
        joints.time_ns.push(stamp_ns(t_s));
        for (column, q) in joints.joint_rad.iter_mut().zip(at(t_s)) {
            column.push(q + ENCODER_RAD * normal(&mut random));
        }
    }
    let mut tip = PoseSamples::default();
    for t_s in rows(tip_hz) {
        tip.time_ns.push(stamp_ns(late(t_s)));
        let noise_m = nalgebra::Vector3::from_fn(|_, _| TRACKER_M * normal(&mut random));
        tip.position_m.push(arm.target_m(&at(t_s)) + noise_m);
    }
    (joints, tip)
}

fn late(robot_s: f64) -> f64 {
    robot_s + LATE_S + DRIFT * robot_s
}

fn stamp_ns(t_s: f64) -> i64 {
    START_NS + (t_s * 1e9).round() as i64
}
