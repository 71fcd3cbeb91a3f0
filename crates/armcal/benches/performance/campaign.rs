//! A campaign of many poses: a 6-axis arm before a laser tracker that stands elsewhere in each of four series, three joints with
//! the ripple of their gears. By a seed, of any number of poses; its kinematics are its own.

use crate::{Options, Result};
use armcal_recording::output::McapOutput;
use armcal_recording::ros2::{self, Header};
use nalgebra::{Isometry3, Rotation3, Translation3, UnitQuaternion, Vector3};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};
use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Series of the campaign, each a recording with a tracker pose of its own.
pub const SERIES: usize = 4;
/// theta, d, a, alpha [rad, m] of a UR10's rows.
const ROWS: [[f64; 4]; 6] = [
    [0.0, 0.1273, 0.0, FRAC_PI_2],
    [0.0, 0.0, -0.612, 0.0],
    [0.0, 0.0, -0.5723, 0.0],
    [0.0, 0.163_941, 0.0, FRAC_PI_2],
    [0.0, 0.1157, 0.0, -FRAC_PI_2],
    [0.0, 0.0922, 0.0, 0.0],
];
const NAMES: [&str; 6] = [
    "shoulder_pan_joint",
    "shoulder_lift_joint",
    "elbow_joint",
    "wrist_1_joint",
    "wrist_2_joint",
    "wrist_3_joint",
];
/// How far the built arm is from those, one standard deviation.
const LENGTH_M: f64 = 5e-4;
const ANGLE_RAD: f64 = 1e-3;
/// Joint, amplitude [rad], periods per turn and phase [rad] of the hidden ripples.
const RIPPLES: [(usize, f64, f64, f64); 3] = [(1, 4e-4, 2.0, 0.4), (2, 3e-4, 1.0, 2.1), (4, 5e-4, 3.0, 1.0)];
/// Noise of the tracker [m] and of an encoder [rad].
const TRACKER_M: f64 = 2e-5;
const ENCODER_RAD: f64 = 2e-5;
const RATE_HZ: f64 = 50.0;
/// Rows of a pose: at rest, then on the way to the next.
const REST_ROWS: usize = 35;
const MOVE_ROWS: usize = 30;
const START_NS: i64 = 1_760_000_000_000_000_000;

/// How many of a campaign's poses a diagnosis weighs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Weighed {
    /// There is no diagnosis.
    None,
    /// As many as a pipeline that does not say.
    Default,
    /// Every one.
    All,
}

impl Weighed {
    /// In words.
    pub fn word(self) -> &'static str {
        match self {
            Weighed::None => "no diagnosis",
            Weighed::Default => "400 weighed",
            Weighed::All => "all weighed",
        }
    }
}

/// Writes the recordings and a pipeline of so many poses, unless they are there; gives the pipeline.
pub fn place(options: &Options, poses: usize, weighed: Weighed) -> Result<PathBuf> {
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../pipelines/models").canonicalize()?;
    let folder = options.data.join(format!("campaign-{poses}"));
    std::fs::create_dir_all(&folder)?;
    let mut random = ChaCha8Rng::seed_from_u64(2038);
    let arm = Arm::built(&mut random);
    let mut recordings = String::new();
    for series in 0..SERIES {
        let own = poses * (series + 1) / SERIES - poses * series / SERIES;
        let path = folder.join(format!("series{series}.mcap"));
        let mut random = ChaCha8Rng::seed_from_u64(3000 + series as u64);
        if !path.exists() {
            arm.record(&path, own, series, &mut random)?;
        }
        // Writing to a string cannot fail.
        let _ = write!(recordings, "[[recordings]]\npaths = [\"{}\"]\n\n", path.display());
    }
    let names = NAMES.map(|name| format!("\"{name}\"")).join(", ");
    let diagnosis = match weighed {
        Weighed::None => "enabled = false".to_owned(),
        Weighed::Default => "enabled = true".to_owned(),
        Weighed::All => format!("max_weighed = {poses}"),
    };
    let text = format!(
        "name = \"campaign\"\n\n{recordings}[streams.joints]\ntopic = \"/joint_states\"\nnames = [{names}]\n\n\
         [streams.tip]\ntopic = \"/tracker/tip\"\n\n[streams.base]\ntopic = \"/tracker/base\"\n\n\
         [model]\ndh = \"{}\"\n\n[frames.base]\npose = \"measured\"\nsigma_mm = 0.02\nsigma_deg = 0.001\n\n\
         [frames.tip]\npose = \"estimated\"\nat = {{ xyz_m = [0.0, 0.0, 0.1] }}\n\n\
         [pool]\nper_recording = [\"base.*\"]\n\n[holdout]\nkind = \"cavity-folds\"\nk = 10\n\n[diagnosis]\n{diagnosis}\n",
        models.join("ur10.toml").display()
    );
    let pipeline = folder.join(format!("pipeline-{weighed:?}.toml"));
    std::fs::write(&pipeline, text)?;
    Ok(pipeline)
}

/// The arm as it was built, and the target on its flange.
pub struct Arm {
    rows: [[f64; 4]; 6],
    target_m: Vector3<f64>,
}

impl Arm {
    pub fn built(random: &mut ChaCha8Rng) -> Arm {
        let mut rows = ROWS;
        for row in &mut rows {
            for (k, value) in row.iter_mut().enumerate() {
                *value += normal(random) * if k % 3 == 0 { ANGLE_RAD } else { LENGTH_M };
            }
        }
        Arm { rows, target_m: Vector3::new(0.03, -0.02, 0.11) }
    }

    /// The target in the base's frame [m] where encoders count `joint_rad`.
    pub fn target_m(&self, joint_rad: &[f64; 6]) -> Vector3<f64> {
        let mut turned = *joint_rad;
        for (joint, amplitude_rad, periods, phase_rad) in RIPPLES {
            turned[joint] += amplitude_rad * (periods * joint_rad[joint] + phase_rad).sin();
        }
        let mut point = self.target_m;
        for ([theta, d, a, alpha], q) in self.rows.iter().zip(turned).rev() {
            let about_x = Rotation3::from_axis_angle(&Vector3::x_axis(), *alpha) * point;
            point = Rotation3::from_axis_angle(&Vector3::z_axis(), theta + q)
                * (about_x + Vector3::new(*a, 0.0, 0.0))
                + Vector3::new(0.0, 0.0, *d);
        }
        point
    }

    fn record(&self, path: &Path, poses: usize, series: usize, random: &mut ChaCha8Rng) -> Result<()> {
        let turn = UnitQuaternion::from_euler_angles(0.02, -0.01, 0.8 * series as f64);
        let tracker_from_base =
            Isometry3::from_parts(Translation3::new(2.5, 0.3 * series as f64, -0.4), turn);
        let mut out = McapOutput::create(path, "ros2")?;
        let mut channel = |topic: &str, schema: &ros2::Schema| -> Result<u16> {
            let schema = (schema.name, ros2::SCHEMA_ENCODING, schema.text.as_bytes());
            Ok(out.add_channel(topic, Some(schema), ros2::MESSAGE_ENCODING, &BTreeMap::new())?)
        };
        let joints = channel("/joint_states", &ros2::JOINT_STATE)?;
        let [tip, base] =
            [channel("/tracker/tip", &ros2::POSE_STAMPED)?, channel("/tracker/base", &ros2::POSE_STAMPED)?];
        let (mut from, mut row) = (drawn(random), 0_u32);
        for pose in 0..poses {
            let to = drawn(random);
            for step in 0..REST_ROWS + MOVE_ROWS {
                let u = step.saturating_sub(REST_ROWS) as f64 / MOVE_ROWS as f64;
                let at = if pose + 1 < poses { between(&from, &to, u) } else { from };
                let stamp_ns =
                    START_NS + series as i64 * 100_000_000_000_000 + (f64::from(row) / RATE_HZ * 1e9) as i64;
                let seen_m = tracker_from_base * nalgebra::Point3::from(self.target_m(&at));
                let mut put =
                    |channel: u16, data: &[u8]| out.put(channel, row, stamp_ns as u64, stamp_ns as u64, data);
                let read = at.map(|q| q + ENCODER_RAD * normal(random));
                let header = |frame_id| Header { stamp_ns, frame_id };
                put(joints, &ros2::joint_state(header(""), &NAMES, &read, &[], &[]))?;
                let position_m: [f64; 3] = std::array::from_fn(|k| seen_m[k] + TRACKER_M * normal(random));
                put(tip, &ros2::pose_stamped(header("tracker"), position_m, [0.0, 0.0, 0.0, 1.0]))?;
                if row % 10 == 0 {
                    let t = tracker_from_base.translation.vector;
                    let position_m: [f64; 3] = std::array::from_fn(|k| t[k] + TRACKER_M * normal(random));
                    let q = turn.coords;
                    put(base, &ros2::pose_stamped(header("tracker"), position_m, [q.x, q.y, q.z, q.w]))?;
                }
                row += 1;
            }
            from = to;
        }
        Ok(out.finish()?)
    }
}

/// On the way from one pose to the next, without jerk at both ends (Flash and Hogan 1985).
pub fn between(from: &[f64; 6], to: &[f64; 6], u: f64) -> [f64; 6] {
    let share = u * u * u * (10.0 - 15.0 * u + 6.0 * u * u);
    std::array::from_fn(|k| from[k] + share * (to[k] - from[k]))
}

/// A pose before the arm [rad].
pub fn drawn(random: &mut ChaCha8Rng) -> [f64; 6] {
    let ranges = [(-2.5, 2.5), (-2.2, -0.6), (0.4, 2.2), (-2.5, 2.5), (-2.5, 2.5), (-2.5, 2.5)];
    ranges.map(|(low, high)| random.random_range(low..high))
}

pub fn normal(random: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(random)
}
