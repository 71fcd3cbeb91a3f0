//! What a simulated session must be true to.

use super::*;
use crate::arm::AxisArm;
use crate::pair::PairConfig;
use crate::sensors::{Kind, OcclusionKind, Payload};
use armcal_core::robust::median;
use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};
use std::sync::LazyLock;

const LABS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../pipelines/lab");

fn lab(name: &str) -> LabConfig {
    let path = Path::new(LABS).join(name);
    LabConfig::from_toml(&std::fs::read_to_string(&path).unwrap(), &path).unwrap()
}

/// One recording with few visits, for questions that do not need the whole rig.
fn short() -> LabConfig {
    let mut config = lab("paper-small.toml");
    config.recordings.truncate(1);
    config.task.passes.truncate(1);
    config.task.passes[0].share = 0.2;
    config.task.free.poses = 2;
    config.hand.hover_share = 0.5;
    config
}

fn go(config: &LabConfig) -> (Truth, Vec<Log>) {
    simulate_in_memory(config, Path::new(LABS), &nothing_hidden).unwrap()
}

static SMALL: LazyLock<(Truth, Vec<Log>)> = LazyLock::new(|| go(&lab("paper-small.toml")));

fn pose(truth: &truth::PoseTruth) -> armcal_core::Pose {
    let [x, y, z, w] = truth.quaternion_xyzw;
    let rotation = UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z));
    Isometry3::from_parts(Translation3::from(Vector3::from(truth.xyz_m)), rotation)
}

#[test]
fn the_true_tip_sits_in_the_true_cavity_of_the_true_board() {
    let (truth, _) = &*SMALL;
    let arm = AxisArm::from_rows(&truth.rows);
    let mut seated = 0;
    for recording in &truth.recordings {
        for dwell in recording.dwells.iter().filter(|d| d.kind == RestKind::Seated) {
            let name = dwell.cavity.as_ref().unwrap();
            let cavity = truth.cavities.iter().find(|c| c.name == *name).unwrap();
            let in_cavity = Vector3::from(cavity.true_m) + Vector3::from(dwell.seat_m.unwrap());
            let world = pose(&recording.world_from_board) * Point3::from(in_cavity);
            let by_arm = pose(&truth.world_from_base) * Point3::from(arm.tip(&dwell.link_rad));
            assert!((by_arm - world).norm() < 25e-6, "{name}: {:.1} um off", 1e6 * (by_arm - world).norm());
            assert!((Vector3::from(dwell.tip_world_m) - by_arm.coords).norm() < 1e-6);
            // Five sigma of the clearance that the board file declares.
            assert!(Vector3::from(dwell.seat_m.unwrap()).norm() < 5.0 * 0.1e-3);
            seated += 1;
        }
    }
    assert!((99..=120).contains(&seated), "{seated} seated dwells");
}

#[test]
fn dwells_are_what_they_say_and_long_enough() {
    let (truth, _) = &*SMALL;
    for recording in &truth.recordings {
        let count = |kind| recording.dwells.iter().filter(|d| d.kind == kind).count();
        assert!((30..=40).contains(&count(RestKind::Seated)), "{}", count(RestKind::Seated));
        assert!((2..=20).contains(&count(RestKind::Hover)), "{}", count(RestKind::Hover));
        assert_eq!(count(RestKind::Free), 12 + 2);
        for dwell in &recording.dwells {
            let seconds = (dwell.end_ns - dwell.start_ns) as f64 * 1e-9;
            assert!(seconds > 0.5, "{dwell:?} rests for {seconds} s only");
            let height = dwell.cavity.as_ref().map(|name| {
                let cavity = truth.cavities.iter().find(|c| c.name == *name).unwrap();
                Vector3::from(dwell.tip_board_m) - Vector3::from(cavity.true_m)
            });
            match (dwell.kind, height) {
                (RestKind::Seated, Some(off)) => assert!(off.norm() < 0.4e-3),
                (RestKind::Hover, Some(off)) => {
                    assert!((13e-3..27e-3).contains(&off.z) && off.xy().norm() < 6e-3, "{off}");
                }
                (RestKind::Free, None) => {}
                other => panic!("{other:?}"),
            }
        }
        let ordered = recording.dwells.windows(2).all(|w| w[0].end_ns < w[1].start_ns);
        assert!(ordered, "dwells of {} overlap", recording.name);
    }
}

#[test]
fn every_joint_arrives_from_both_sides() {
    let (truth, _) = go(&lab("paper.toml"));
    for recording in &truth.recordings {
        let seated: Vec<_> = recording.dwells.iter().filter(|d| d.kind == RestKind::Seated).collect();
        for joint in 0..3 {
            let share = |sign| {
                seated.iter().filter(|d| d.arrival[joint] == sign).count() as f64 / seated.len() as f64
            };
            let (up, down) = (share(1), share(-1));
            println!("{} joint {}: + {up:.2}, - {down:.2}", recording.name, joint + 1);
            assert!(up > 0.2 && down > 0.2, "{} joint {}: {up:.2} {down:.2}", recording.name, joint + 1);
        }
    }
}

#[test]
fn encoders_read_the_true_angles_to_a_count() {
    let (truth, logs) = &*SMALL;
    for (recording, log) in truth.recordings.iter().zip(logs) {
        let dwell = recording.dwells.iter().find(|d| d.kind == RestKind::Seated).unwrap();
        let inside = log.messages.iter().filter(|m| (dwell.start_ns..dwell.end_ns).contains(&m.stamp_ns));
        let mut read = 0;
        for message in inside {
            if let (Kind::JointState, Payload::Joints { position, .. }) =
                (log.channels[message.channel].kind, &message.payload)
            {
                for (q, truth_rad) in position.iter().zip(&dwell.motor_rad) {
                    assert!((q - truth_rad).abs() < 4.0 * truth.count_rad);
                    assert!(((q / truth.count_rad) - (q / truth.count_rad).round()).abs() < 1e-6);
                }
                read += 1;
            }
        }
        assert!(read > 30, "{read}");
    }
}

#[test]
fn vicon_sees_the_tip_with_the_declared_noise_on_its_own_clock() {
    let (truth, logs) = &*SMALL;
    let mut inside = [0usize; 2];
    for (recording, log) in truth.recordings.iter().zip(logs) {
        let tip = log.channels.iter().position(|c| c.topic == "/vicon/tip/tip").unwrap();
        let clock = recording.clock;
        for dwell in recording.dwells.iter().filter(|d| d.kind == RestKind::Seated) {
            let (start, end) = (clock.stamp_ns(dwell.start_ns), clock.stamp_ns(dwell.end_ns));
            let tip_m = Vector3::from(dwell.tip_world_m);
            for message in log.messages.iter().filter(|m| m.channel == tip) {
                let Payload::Pose { position_m, .. } = &message.payload else { panic!("not a pose") };
                // Frozen frames may have left the place before the dwell; zeros are far away.
                let error = position_m - tip_m;
                if (start..end).contains(&message.stamp_ns) && error.norm() < 2e-3 {
                    inside[0] += error.iter().filter(|e| e.abs() < 0.28e-3).count();
                    inside[1] += 3;
                }
            }
        }
        assert!((recording.clock.offset_s - 0.047).abs() < 0.02);
    }
    let share = inside[0] as f64 / inside[1] as f64;
    println!("{share:.4} of {} coordinates within 0.28 mm", inside[1]);
    assert!((share - 0.95).abs() < 0.012, "{share}");
}

#[test]
fn occlusions_are_zeros_or_frozen_frames_and_the_truth_knows_all_of_them() {
    let (truth, logs) = &*SMALL;
    for (recording, log) in truth.recordings.iter().zip(logs) {
        let tip = log.channels.iter().position(|c| c.topic == "/vicon/tip/tip").unwrap();
        let frames: Vec<_> = log.messages.iter().filter(|m| m.channel == tip).map(|m| &m.payload).collect();
        let zero = |p: &&Payload| {
            matches!(p, Payload::Pose { position_m, orientation }
                if position_m.norm() == 0.0 && orientation.norm() == 0.0)
        };
        let frozen = frames.windows(2).filter(|w| w[0] == w[1] && !zero(&w[0])).count();
        let of = |kind| {
            let of_tip = recording.occlusions.iter().filter(|o| o.subject == "tip" && o.kind == kind);
            of_tip.map(|o| o.frames).sum::<usize>()
        };
        assert_eq!(frames.iter().copied().filter(|p| zero(p)).count(), of(OcclusionKind::Zeros));
        assert_eq!(frozen, of(OcclusionKind::Frozen));
        assert!(frozen + of(OcclusionKind::Zeros) > 20, "hardly any occlusion");
    }
}

#[test]
fn messages_are_logged_in_order_and_never_before_they_are_made() {
    let (truth, logs) = &*SMALL;
    for (recording, log) in truth.recordings.iter().zip(logs) {
        assert!(log.messages.windows(2).all(|w| w[0].log_ns <= w[1].log_ns));
        let joints = log.messages.iter().filter(|m| log.channels[m.channel].kind == Kind::JointState);
        let delays_ms: Vec<f64> = joints.map(|m| (m.log_ns - m.stamp_ns) as f64 * 1e-6).collect();
        assert!(delays_ms.iter().all(|d| *d >= 3.0));
        assert!((median(&delays_ms) - 6.5).abs() < 1.0, "{}", median(&delays_ms));
        let end_ns = recording.start_ns + (recording.duration_s * 1e9) as i64;
        assert!(
            log.messages.iter().all(|m| m.log_ns > recording.start_ns && m.log_ns < end_ns + 200_000_000)
        );
    }
}

#[test]
fn the_nominal_arm_is_tens_of_millimetres_off() {
    let mut medians_mm = Vec::new();
    for seed in 0..20 {
        let (truth, _) = go(&LabConfig { seed, ..short() });
        let errors: Vec<f64> = truth.recordings[0]
            .dwells
            .iter()
            .filter(|d| d.kind == RestKind::Seated)
            .map(|d| 1e3 * d.nominal_error_m)
            .collect();
        medians_mm.push(median(&errors));
    }
    println!("nominal error, median per seed [mm]: {medians_mm:.1?}, median {:.1}", median(&medians_mm));
    assert!((10.0..45.0).contains(&median(&medians_mm)), "{}", median(&medians_mm));
}

#[test]
fn a_source_of_noise_does_not_reshuffle_the_others() {
    let quiet = short();
    let mut blind = quiet.clone();
    blind.vicon.tip.occlusions_per_minute = 0.0;
    blind.joints.noise_counts = 0.0;
    let ((truth, logs), (truth_blind, logs_blind)) = (go(&quiet), go(&blind));
    assert_eq!(truth.recordings[0].dwells, truth_blind.recordings[0].dwells);
    let table = |log: &Log| {
        let channel = log.channels.iter().position(|c| c.topic == "/vicon/table/table").unwrap();
        log.messages.iter().filter(|m| m.channel == channel).cloned().collect::<Vec<_>>()
    };
    assert_eq!(table(&logs[0]), table(&logs_blind[0]));
    assert_ne!(logs[0], logs_blind[0]);
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_one_others() {
    let folders = [0, 1, 2].map(|_| tempfile::tempdir().unwrap());
    let bytes = |config: &LabConfig, folder: &tempfile::TempDir| {
        let simulated = simulate(config, Path::new(LABS), folder.path()).unwrap();
        let truth = std::fs::read(&simulated.truth).unwrap();
        let read: Truth = serde_json::from_slice(&truth).unwrap();
        assert_eq!(read.config.seed, config.seed);
        assert_eq!(read.recordings[0].dwells.len(), simulated.facts.recordings[0].dwells.len());
        (std::fs::read(&simulated.recordings[0]).unwrap(), truth)
    };
    let config = short();
    let (first, second) = (bytes(&config, &folders[0]), bytes(&config, &folders[1]));
    assert!(first == second, "two runs of one seed differ");
    let other = bytes(&LabConfig { seed: config.seed + 1, ..config }, &folders[2]);
    assert!(first.0 != other.0 && first.1 != other.1);
}

#[test]
fn what_cannot_be_reached_is_named() {
    let mut config = short();
    config.board.in_base.xyz_m = [0.9, 0.0, 0.1];
    let error = simulate_in_memory(&config, Path::new(LABS), &nothing_hidden).unwrap_err().to_string();
    assert!(error.contains("normal") && error.contains("mm away from"), "{error}");
    config.board.file = "no/such.toml".into();
    let error = simulate_in_memory(&config, Path::new(LABS), &nothing_hidden).unwrap_err().to_string();
    assert!(error.contains("no/such.toml"), "{error}");
}

/// A gear with play, written outside the engine: the link rests on one flank of the gap or the other.
#[derive(Debug)]
struct Play {
    width_rad: f64,
    link_rad: Option<f64>,
    motor_rad: Option<f64>,
}

impl Named for Play {
    fn name(&self) -> &str {
        "play"
    }
}

impl Mechanism for Play {
    fn motor_to_link(&mut self, _now: &RigState<'_>, joint_rad: &mut [f64]) {
        let half = self.width_rad / 2.0;
        let motor = joint_rad[1];
        let link = self.link_rad.unwrap_or(motor).clamp(motor - half, motor + half);
        (self.link_rad, self.motor_rad) = (Some(link), Some(motor));
        joint_rad[1] = link;
    }

    fn link_to_motor(&mut self, _now: &RigState<'_>, joint_rad: &mut [f64]) {
        let half = self.width_rad / 2.0;
        let link = joint_rad[1];
        let motor = self.motor_rad.unwrap_or(link).clamp(link - half, link + half);
        (self.link_rad, self.motor_rad) = (Some(link), Some(motor));
        joint_rad[1] = motor;
    }
}

#[test]
fn a_mechanism_plugs_in_from_outside() {
    let width_rad = 0.006;
    let hidden = |_: usize| -> Vec<Box<dyn Mechanism>> {
        vec![Box::new(Play { width_rad, link_rad: None, motor_rad: None })]
    };
    let mut config = short();
    config.task.passes[0] = config::PassConfig { order: config::Order::Random, share: 0.8 };
    let (truth, _) = simulate_in_memory(&config, Path::new(LABS), &hidden).unwrap();
    let recording = &truth.recordings[0];
    assert_eq!(recording.mechanisms[0].name, "play");
    let (mut flanks, mut seated) = ([0, 0], 0);
    for dwell in recording.dwells.iter().filter(|d| d.kind == RestKind::Seated) {
        let lag_rad = dwell.link_rad[1] - dwell.motor_rad[1];
        assert!(lag_rad.abs() <= width_rad / 2.0 + 1e-12);
        assert_eq!(dwell.link_rad[0], dwell.motor_rad[0]);
        seated += 1;
        // The hand drives: the link leads the motor in the direction it arrived from, less what it rattled back.
        if lag_rad.abs() > 0.25 * width_rad && f64::from(dwell.arrival[1]) == lag_rad.signum() {
            flanks[usize::from(lag_rad > 0.0)] += 1;
        }
    }
    println!("resting on the lower and the upper flank: {flanks:?} of {seated}");
    assert!(
        flanks[0] > 3 && flanks[1] > 3 && 10 * (flanks[0] + flanks[1]) > 8 * seated,
        "{flanks:?} of {seated}"
    );
}

#[test]
fn the_shipped_labs_are_valid_and_the_paper_story_hides_three_gaps() {
    for entry in std::fs::read_dir(LABS).unwrap() {
        let path = entry.unwrap().path();
        let text = std::fs::read_to_string(&path).unwrap();
        if ["two-arms.toml", "humanoid.toml"].iter().any(|pair| path.ends_with(pair)) {
            PairConfig::from_toml(&text, &path).unwrap();
            continue;
        }
        let gaps = LabConfig::from_toml(&text, &path).unwrap().mechanisms.len();
        let story = path.ends_with("paper-backlash.toml") || path.ends_with("paper-experiment.toml");
        assert_eq!(gaps, if story { 3 } else { 0 }, "{}", path.display());
    }
}
