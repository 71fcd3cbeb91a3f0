//! The sealed truth of a session. Only assertions read it.

use crate::arm::DhRow;
use crate::config::LabConfig;
use crate::rig::Rig;
use crate::scenario::{Hidden, Scenario};
use crate::sensors::gauge::Standing;
use crate::sensors::{Occlusion, SensorClock};
use crate::session::{Due, Session};
use crate::trace::{Rest, RestKind, Trace};
use crate::{LabError, Mechanism};
use armcal_core::Pose;
use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A joint arrived in the direction of its last motion of at least this size: 0.3 deg [rad].
pub const ARRIVAL_RAD: f64 = 0.3 * std::f64::consts::PI / 180.0;

/// The tip rests while it stays this close to where it ends up [m].
const STILL_M: f64 = 0.15e-3;

/// Everything that was true.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// Format of this file: `armcal.truth/1`.
    pub schema: String,
    /// The configuration, seed included.
    pub config: LabConfig,
    /// The table the built arm was laid out from.
    pub rows: Vec<DhRow>,
    /// Its deviations from nominal, SI, under the model's parameter names (`joint2.theta`, [rad] and [m]).
    pub deviations: Vec<Deviation>,
    /// The robot's base in the world.
    pub world_from_base: PoseTruth,
    /// The base's marker plate relative to the base.
    pub base_from_plate: PoseTruth,
    /// The untilted board in the world.
    pub world_from_table: PoseTruth,
    /// The cavities.
    pub cavities: Vec<CavityTruth>,
    /// Noise of one coordinate of one Vicon frame, 1 sigma [m].
    pub vicon_sigma_m: f64,
    /// One count of the encoders [rad].
    pub count_rad: f64,
    /// The scenario it comes from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scenario: Option<Scenario>,
    /// What a scenario hides, as a scorer needs to know it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub hidden: Vec<Hidden>,
    /// Where the instruments stand, in their order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub gauges: Vec<GaugeTruth>,
    /// The recordings.
    pub recordings: Vec<RecordingTruth>,
}

/// Where an instrument stands.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct GaugeTruth {
    /// In the base frame.
    pub in_base: PoseTruth,
    /// Distance at which it reads zero [m].
    pub zero_m: f64,
}

/// One planted deviation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Deviation {
    /// `<row>.<theta|d|a|alpha>`.
    pub name: String,
    /// Nominal value, SI.
    pub nominal: f64,
    /// True value, SI.
    pub value: f64,
}

/// A pose as numbers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PoseTruth {
    /// Position [m].
    pub xyz_m: [f64; 3],
    /// Unit quaternion x, y, z, w.
    pub quaternion_xyzw: [f64; 4],
}

/// One cavity in the frame of the board.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CavityTruth {
    /// Its name.
    pub name: String,
    /// Where the drawing has it [m].
    pub drawn_m: [f64; 3],
    /// Where it is [m].
    pub true_m: [f64; 3],
}

/// One recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecordingTruth {
    /// Its name.
    pub name: String,
    /// Its file, relative to this one.
    pub file: String,
    /// Robot clock at its start [ns].
    pub start_ns: i64,
    /// Its duration [s].
    pub duration_s: f64,
    /// Tilt reached, roll and pitch [deg].
    pub tilt_deg: [f64; 2],
    /// The board in the world at the start.
    pub world_from_board: PoseTruth,
    /// Load at the tip [kg].
    pub load_kg: f64,
    /// The sensor's clock.
    pub clock: SensorClock,
    /// What each mechanism has to say, by name.
    pub mechanisms: Vec<MechanismTruth>,
    /// Every rest, in order of time.
    pub dwells: Vec<DwellTruth>,
    /// When which subject was occluded.
    pub occlusions: Vec<Occlusion>,
    /// Every set-point from a file, in their order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub set_points: Vec<SetPointTruth>,
}

/// What came of a set-point from a file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SetPointTruth {
    /// When it was due [ns], robot clock; of a stop, the middle.
    pub time_ns: i64,
    /// The set-point [rad].
    pub set_point_rad: Vec<f64>,
    /// What the encoders read then, before noise and counting [rad].
    pub reading_rad: Vec<f64>,
    /// The true tip in the world [m].
    pub tip_world_m: [f64; 3],
}

/// One mechanism.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MechanismTruth {
    /// Its name.
    pub name: String,
    /// Nothing so far.
    pub truth: serde_json::Value,
}

/// One rest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DwellTruth {
    /// Start on the robot's clock, settling over [ns].
    pub start_ns: i64,
    /// End on the robot's clock [ns].
    pub end_ns: i64,
    /// What it was.
    pub kind: RestKind,
    /// The cavity it is about.
    pub cavity: Option<String>,
    /// The pass it belongs to.
    pub pass: Option<usize>,
    /// Where in the clearance the tip sat, board frame [m].
    pub seat_m: Option<[f64; 3]>,
    /// Mean true tip in the world [m].
    pub tip_world_m: [f64; 3],
    /// Mean true tip on the board [m].
    pub tip_board_m: [f64; 3],
    /// Mean link-side joint angles [rad].
    pub link_rad: Vec<f64>,
    /// Mean motor-side joint angles [rad].
    pub motor_rad: Vec<f64>,
    /// Where the nominal arm believes the tip to be for the encoders' reading, base frame [m].
    pub nominal_tip_base_m: [f64; 3],
    /// Distance between that and the true tip [m].
    pub nominal_error_m: f64,
    /// Direction from which each link arrived: +1, -1, or 0 when it had not moved by [`ARRIVAL_RAD`] yet.
    pub arrival: Vec<i8>,
    /// Temperature of the arm [degC].
    pub temperature_c: f64,
}

impl Truth {
    /// What the whole session shares; recordings are added as they are made.
    pub fn of_rig(config: &LabConfig, rig: &Rig) -> Truth {
        Truth {
            schema: "armcal.truth/1".into(),
            config: config.clone(),
            rows: rig.built_rows.clone(),
            deviations: row_deviations(&config.arm.rows, &rig.built_rows),
            world_from_base: (&rig.world_from_base).into(),
            base_from_plate: (&rig.base_from_plate).into(),
            world_from_table: (&rig.world_from_table).into(),
            cavities: rig
                .board
                .cavities
                .iter()
                .map(|c| CavityTruth {
                    name: c.name.clone(),
                    drawn_m: c.drawn_m.into(),
                    true_m: c.true_m.into(),
                })
                .collect(),
            vicon_sigma_m: config.vicon.sigma_m(),
            count_rad: config.joints.count_rad(),
            scenario: None,
            hidden: Vec::new(),
            gauges: (0..config.gauges.len()).map(|gauge| GaugeTruth::of(config, gauge)).collect(),
            recordings: Vec::new(),
        }
    }
}

/// Writes a truth as JSON, atomically.
pub(crate) fn write_json(truth: &impl Serialize, path: &Path) -> Result<(), LabError> {
    let failed = |why: String| LabError::Truth { path: path.to_owned(), why };
    let mut text = serde_json::to_vec_pretty(truth).map_err(|e| failed(e.to_string()))?;
    text.push(b'\n');
    armcal_recording::atomic::write(path, &text).map_err(|e| failed(e.to_string()))
}

impl RecordingTruth {
    /// What was true in one recording.
    pub fn of_session(
        config: &LabConfig,
        rig: &Rig,
        recording: usize,
        session: &Session,
        clock: SensorClock,
        occlusions: Vec<Occlusion>,
    ) -> RecordingTruth {
        let name = config.recordings[recording].name.clone();
        let start_ns = config.start_ns(recording);
        let set_point = |due: &Due| SetPointTruth::of_due(&session.trace, due, start_ns);
        let dwell = |rest: &Rest| DwellTruth::of_rest(rig, &session.trace, rest, start_ns);
        let mechanism =
            |m: &dyn Mechanism| MechanismTruth { name: m.name().into(), truth: serde_json::Value::Null };
        RecordingTruth {
            file: crate::recording_file(&name),
            name,
            start_ns,
            duration_s: session.trace.duration_s(),
            tilt_deg: session.place.reached_deg,
            world_from_board: (&session.place.world_from_board).into(),
            load_kg: config.recordings[recording].load_kg,
            clock,
            mechanisms: session.mechanisms.iter().map(|m| mechanism(m.as_ref())).collect(),
            dwells: session.rests.iter().map(dwell).collect(),
            occlusions,
            set_points: session.due.iter().map(set_point).collect(),
        }
    }
}

impl DwellTruth {
    fn of_rest(rig: &Rig, trace: &Trace, rest: &Rest, recording_start_ns: i64) -> DwellTruth {
        let first = first_still_step(trace, rest);
        let rows = first..=rest.last;
        let tip_at = |i: usize| trace.world_from_tip[i].translation.vector;
        let on_board =
            |i: usize| trace.world_from_board[i].inverse_transform_point(&Point3::from(tip_at(i))).coords;
        let in_base =
            |i: usize| trace.world_from_base[i].inverse_transform_point(&Point3::from(tip_at(i))).coords;
        let names = |cavity: usize| rig.board.cavities[cavity].name.clone();
        let nominal = rig.nominal.tip(&mean_row(&trace.reading_rad[rows.clone()]));
        let time_ns = |step: usize| recording_start_ns + (trace.time_s[step] * 1e9).round() as i64;
        DwellTruth {
            start_ns: time_ns(first),
            end_ns: time_ns(rest.last),
            kind: rest.kind,
            cavity: rest.cavity.map(names),
            pass: rest.pass,
            seat_m: rest.seat_m.map(Into::into),
            tip_world_m: mean_vector(rows.clone().map(tip_at)).into(),
            tip_board_m: mean_vector(rows.clone().map(on_board)).into(),
            link_rad: mean_row(&trace.link_rad[rows.clone()]),
            motor_rad: mean_row(&trace.motor_rad[rows.clone()]),
            nominal_tip_base_m: nominal.into(),
            nominal_error_m: (nominal - mean_vector(rows.map(in_base))).norm(),
            arrival: arrival_signs(trace, first),
            temperature_c: trace.temperature_c[first],
        }
    }
}

impl SetPointTruth {
    fn of_due(trace: &Trace, due: &Due, recording_start_ns: i64) -> SetPointTruth {
        let tip_at = |i: usize| trace.world_from_tip[i].translation.vector;
        SetPointTruth {
            time_ns: recording_start_ns + (trace.time_s[due.first] * 1e9).round() as i64,
            set_point_rad: due.joint_rad.clone(),
            reading_rad: mean_row(&trace.reading_rad[due.first..=due.last]),
            tip_world_m: mean_vector((due.first..=due.last).map(tip_at)).into(),
        }
    }
}

impl GaugeTruth {
    fn of(config: &LabConfig, gauge: usize) -> GaugeTruth {
        let Standing { in_base, zero_m } = Standing::draw(config, gauge);
        GaugeTruth { in_base: PoseTruth::from(&in_base), zero_m }
    }
}

impl From<&Pose> for PoseTruth {
    fn from(pose: &Pose) -> PoseTruth {
        let q = pose.rotation.coords;
        PoseTruth { xyz_m: pose.translation.vector.into(), quaternion_xyzw: [q.x, q.y, q.z, q.w] }
    }
}

/// The first step of a rest from which on the tip stays where it ends up.
fn first_still_step(trace: &Trace, rest: &Rest) -> usize {
    let tip = |i: usize| trace.world_from_tip[i].translation.vector;
    let half = rest.first + (rest.last - rest.first) / 2;
    let end = mean_vector((half..=rest.last).map(tip));
    (rest.first..=rest.last)
        .rev()
        .take_while(|&i| (tip(i) - end).norm() < STILL_M)
        .last()
        .unwrap_or(rest.last)
}

/// Direction of the last motion of each link that was large enough to be one.
fn arrival_signs(trace: &Trace, first: usize) -> Vec<i8> {
    let rest = &trace.link_rad[first];
    (0..rest.len())
        .map(|j| {
            let before = trace.link_rad[..first].iter().rev().map(|row| rest[j] - row[j]);
            let moved = before.into_iter().find(|moved| moved.abs() >= ARRIVAL_RAD);
            moved.map_or(0, |moved| moved.signum() as i8)
        })
        .collect()
}

fn mean_row(rows: &[Vec<f64>]) -> Vec<f64> {
    let joints = rows.first().map_or(0, Vec::len);
    (0..joints).map(|j| rows.iter().map(|row| row[j]).sum::<f64>() / rows.len() as f64).collect()
}

fn mean_vector(vectors: impl Iterator<Item = Vector3<f64>>) -> Vector3<f64> {
    let (sum, n) = vectors.fold((Vector3::zeros(), 0usize), |(sum, n), v| (sum + v, n + 1));
    sum / n.max(1) as f64
}

pub(crate) fn row_deviations(nominal: &[DhRow], built: &[DhRow]) -> Vec<Deviation> {
    let entries = |row: &DhRow| {
        [("theta", row.theta_rad()), ("d", row.d_m), ("a", row.a_m), ("alpha", row.alpha_rad())]
    };
    nominal
        .iter()
        .zip(built)
        .flat_map(|(nominal, built)| {
            entries(nominal).into_iter().zip(entries(built)).map(|((quantity, n), (_, b))| Deviation {
                name: format!("{}.{quantity}", nominal.name),
                nominal: n,
                value: b,
            })
        })
        .collect()
}
