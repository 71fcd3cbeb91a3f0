//! A six-axis arm under a laser tracker, of the size of a UR10.
//!
//! Its joints are lines in space, turned about one after the other from the flange to the base: no formula is shared with
//! the models that are fitted. The built arm's lines lie a little off the drawn ones.

use super::hidden::Hidden;
use super::{Body, JOINTS, Recorded, Rest, Rig, body_topic, joints_toml};
use armcal_lab::hand::minimum_jerk;
use armcal_lab::random::{Purpose, Stream};
use armcal_lab::screw::Line;
use armcal_lab::sensors::{Kind, Log, Message, Payload, SensorClock};
use nalgebra::{Isometry3, Rotation3, Translation3, UnitQuaternion, Vector3};
use std::f64::consts::TAU;

/// The manufacturer's table, as shipped.
pub const ARM: &str = include_str!("../../../../../pipelines/models/ur10.toml");

/// Names of the joints.
pub const NAMES: [&str; 6] = [
    "shoulder_pan_joint",
    "shoulder_lift_joint",
    "elbow_joint",
    "wrist_1_joint",
    "wrist_2_joint",
    "wrist_3_joint",
];

/// Joint lines of the drawn arm with all joints at zero, in the base frame: a point [m] and a direction.
const DRAWN: [([f64; 3], [f64; 3]); 6] = [
    ([0.0, 0.0, 0.0], [0.0, 0.0, 1.0]),
    ([0.0, 0.0, 0.1273], [0.0, -1.0, 0.0]),
    ([-0.612, 0.0, 0.1273], [0.0, -1.0, 0.0]),
    ([-1.1843, 0.0, 0.1273], [0.0, -1.0, 0.0]),
    ([-1.1843, -0.163941, 0.1273], [0.0, 0.0, -1.0]),
    ([-1.1843, -0.163941, 0.0116], [0.0, -1.0, 0.0]),
];

/// The drawn flange at joint zero: its origin [m]; its z points along -y of the base.
const FLANGE_M: [f64; 3] = [-1.1843, -0.256141, 0.0116];

/// What each joint moves through [deg].
const RANGE_DEG: [[f64; 2]; 6] =
    [[-110.0, 110.0], [-150.0, -30.0], [-130.0, 130.0], [-170.0, 10.0], [-120.0, 120.0], [-160.0, 160.0]];

const POSES: usize = 44;
const REST_S: f64 = 1.0;
const MOVE_S: f64 = 1.1;
const RATE_HZ: f64 = 50.0;
const START_NS: i64 = 1_760_000_000_000_000_000;
const INTERVAL_NS: i64 = 900_000_000_000;
/// One count of the encoders [rad].
const COUNT_RAD: f64 = TAU / 131_072.0;
/// Noise of one tracker reading and, constant through a rest, of its surroundings, 1 sigma per axis [m].
const WHITE_M: f64 = 0.03e-3;
const SYSTEMATIC_M: f64 = 0.03e-3;
const WHITE_RAD: f64 = 5e-5;
const SYSTEMATIC_RAD: f64 = 5e-5;

/// The rig: what of it is drawn, and what may be changed between recordings.
#[derive(Debug, Clone, PartialEq)]
pub struct Lab {
    /// Seed of the built arm, of the motion and of all noise.
    pub seed: u64,
    /// The robot's base in the tracker's frame.
    pub world_from_base: Isometry3<f64>,
    /// The target on the flange.
    pub flange_from_target: Isometry3<f64>,
    /// What is hidden between the encoders and the links.
    pub hidden: Option<Hidden>,
}

impl Lab {
    /// The rig of a seed.
    pub fn new(seed: u64) -> Lab {
        let mut draw = Stream::new(seed, Purpose::Mounting, 0);
        let place = draw.normal3();
        let yaw = draw.uniform([-3.0, 3.0]);
        let target = Vector3::new(0.004 * draw.normal(), 0.004 * draw.normal(), 0.109);
        Lab {
            seed,
            hidden: None,
            world_from_base: Isometry3::from_parts(
                Translation3::from(Vector3::new(2.6, -0.8, 0.4) + 0.1 * place),
                UnitQuaternion::from_euler_angles(0.005 * draw.normal(), 0.005 * draw.normal(), yaw),
            ),
            flange_from_target: Isometry3::from_parts(
                Translation3::from(target),
                UnitQuaternion::from_euler_angles(
                    0.01 * draw.normal(),
                    0.01 * draw.normal(),
                    draw.uniform([-0.4, 0.4]),
                ),
            ),
        }
    }

    /// Two recordings of the same rig.
    pub fn record(&self) -> Vec<Recorded> {
        let arm = Arm::build(self.seed);
        (0..2).map(|recording| self.one(&arm, recording)).collect()
    }

    fn one(&self, arm: &Arm, recording: usize) -> Recorded {
        let start_ns = START_NS + recording as i64 * INTERVAL_NS;
        let clock = SensorClock { offset_s: 0.031, latency_s: 0.004, drift: 12e-6, reference_ns: start_ns };
        let path = Path::draw(self.seed, recording);
        let mut noise = Stream::new(self.seed, Purpose::ViconTip, recording);
        let mut counting = Stream::new(self.seed, Purpose::Encoder, recording);
        let mut transport = Stream::new(self.seed, Purpose::TransportTip, recording);
        let systematic: Vec<_> = (0..=POSES).map(|_| (noise.normal3(), noise.normal3())).collect();
        let still = Isometry3::translation(1.9, 0.6, 0.2);
        let mut log = Log::new(clock);
        log.channel(JOINTS, Kind::JointState, "", &NAMES.map(str::to_owned));
        for body in [Body::Tip, Body::Still] {
            log.channel(body_topic(Rig::Poses, body), Kind::PoseStamped, "tracker", &[]);
        }
        for sequence in 0..(path.end_s() * RATE_HZ) as u32 {
            let time_s = f64::from(sequence) / RATE_HZ;
            let stamp_ns = start_ns + (time_s * 1e9) as i64;
            let q = path.at(time_s);
            let read = q.map(|q| ((q / COUNT_RAD + 0.3 * counting.normal()).round()) * COUNT_RAD);
            let joints = Payload::Joints { position: read.to_vec(), velocity: Vec::new() };
            let late = |draw: &mut Stream| (1e9 * (0.002 + draw.exponential(0.0005))) as i64;
            let log_ns = stamp_ns + late(&mut transport);
            log.messages.push(Message { channel: 0, sequence, stamp_ns, log_ns, payload: joints });

            let (offset, turn) = systematic[path.rest_near(time_s)];
            let mut links = q;
            if let Some(hidden) = self.hidden {
                hidden.act(&mut links, path.before(time_s));
            }
            let seen = self.world_from_base * arm.flange(&links) * self.flange_from_target;
            for (channel, pose) in [(1, seen), (2, still)] {
                let position_m = pose.translation.vector + SYSTEMATIC_M * offset + WHITE_M * noise.normal3();
                let small = SYSTEMATIC_RAD * turn + WHITE_RAD * noise.normal3();
                let orientation = *(UnitQuaternion::from_scaled_axis(small) * pose.rotation).quaternion();
                let (stamp_ns, log_ns) =
                    (clock.stamp_ns(stamp_ns), stamp_ns + 4_000_000 + late(&mut transport));
                let payload = Payload::Pose { position_m, orientation };
                log.messages.push(Message { channel, sequence, stamp_ns, log_ns, payload });
            }
        }
        let name = ["first", "second"][recording].to_owned();
        Recorded { name, log: log.in_order(), rests: path.rests(start_ns) }
    }
}

/// The built arm.
struct Arm {
    axes: [Line; 6],
    zeros_rad: [f64; 6],
    flange: Isometry3<f64>,
}

impl Arm {
    fn build(seed: u64) -> Arm {
        let mut draw = Stream::new(seed, Purpose::Geometry, 0);
        let axes = DRAWN.map(|(point, direction)| {
            let point_m = Vector3::from(point) + 0.8e-3 * draw.normal3();
            let direction = (Vector3::from(direction) + 1.5e-3 * draw.normal3()).normalize();
            Line { point_m, direction }
        });
        let zeros_rad = [(); 6].map(|()| 4e-3 * draw.normal());
        let rotation = Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
        let flange = Isometry3::from_parts(Translation3::from(Vector3::from(FLANGE_M)), rotation.into());
        Arm { axes, zeros_rad, flange }
    }

    /// The flange in the base frame: turned about each line, the last one first.
    fn flange(&self, q: &[f64; 6]) -> Isometry3<f64> {
        let mut pose = self.flange;
        for (joint, line) in self.axes.iter().enumerate().rev() {
            let angle = q[joint] + self.zeros_rad[joint];
            let turned = line.turn_point(&pose.translation.vector, angle);
            let rotation = UnitQuaternion::from_scaled_axis(line.direction * angle) * pose.rotation;
            pose = Isometry3::from_parts(Translation3::from(turned), rotation);
        }
        pose
    }
}

/// Poses drawn within the ranges, held, and joined by smooth moves.
struct Path {
    poses: Vec<[f64; 6]>,
}

impl Path {
    fn draw(seed: u64, recording: usize) -> Path {
        let mut draw = Stream::new(seed, Purpose::Task, recording);
        let poses = (0..POSES).map(|_| RANGE_DEG.map(|range| draw.uniform(range).to_radians())).collect();
        Path { poses }
    }

    fn end_s(&self) -> f64 {
        self.poses.len() as f64 * (REST_S + MOVE_S) - MOVE_S
    }

    fn at(&self, time_s: f64) -> [f64; 6] {
        let k = self.rest_at(time_s);
        let into_s = time_s - k as f64 * (REST_S + MOVE_S) - REST_S;
        let (here, next) = (&self.poses[k], self.poses.get(k + 1).unwrap_or(&self.poses[k]));
        let s = minimum_jerk(into_s / MOVE_S);
        std::array::from_fn(|j| here[j] + s * (next[j] - here[j]))
    }

    fn rest_at(&self, time_s: f64) -> usize {
        ((time_s / (REST_S + MOVE_S)) as usize).min(self.poses.len() - 1)
    }

    /// The pose that the arm left last.
    fn before(&self, time_s: f64) -> &[f64; 6] {
        &self.poses[self.rest_near(time_s).saturating_sub(1)]
    }

    /// The rest whose middle is nearest: what is constant through a rest changes half way to the next.
    fn rest_near(&self, time_s: f64) -> usize {
        self.rest_at(time_s + 0.5 * MOVE_S)
    }

    fn rests(&self, start_ns: i64) -> Vec<Rest> {
        let at = |s: f64| start_ns + (s * 1e9) as i64;
        (0..self.poses.len())
            .map(|k| k as f64 * (REST_S + MOVE_S))
            .map(|s| Rest { start_ns: at(s), end_ns: at(s + REST_S) })
            .collect()
    }
}

/// The pipeline with which these recordings are calibrated.
pub fn pipeline_toml(recordings: &[Recorded]) -> String {
    let files: String =
        recordings.iter().map(|r| format!("[[recordings]]\npaths = [\"{}.mcap\"]\n\n", r.name)).collect();
    format!(
        "name = \"poses\"\n\n{files}{}[streams.tip]\ntopic = \"{}\"\n\n[model]\ndh = \"arm.toml\"\n\n\
         [frames.base]\npose = \"estimated\"\n\n[frames.tip]\npose = \"estimated\"\nat = {{ xyz_m = [0.0, 0.0, 0.1] }}\n\n\
         [observations]\nsensor_sigma_mm = 0.03\nsensor_sigma_deg = 0.003\n\n[fit]\nuse_orientation = true\n\n\
         [holdout]\nkind = \"cavity-folds\"\nk = 5\n",
        joints_toml(&NAMES.map(str::to_owned)),
        body_topic(Rig::Poses, Body::Tip),
    )
}
