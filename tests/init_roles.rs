use crate::support::{armcal, root};
use armcal_lab::config::{LabConfig, MarkerConfig, TableMarkers};
use armcal_lab::sensors::{Kind, Log, Message, Payload};
use armcal_lab::{nothing_hidden, record};
use nalgebra::{UnitQuaternion, Vector3};
use rand::seq::SliceRandom as _;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;

const CASES: u64 = 64;
/// Names that say what other bodies are, and names that say nothing.
const NAMES: [&str; 8] = ["base", "tip", "table", "robot_base", "Flange", "world", "rb_17", "wand"];

/// A simulated session: which bodies there are, what they are called, and what was tracked.
struct Case {
    config: LabConfig,
    board: bool,
    /// By name, what a body is; `undecided` are those that no motion tells.
    truth: BTreeMap<String, &'static str>,
    undecided: Vec<String>,
    dropped: Vec<String>,
    wand: Option<String>,
    stand: Option<String>,
}

fn case(seed: u64) -> Case {
    let mut draw = ChaCha8Rng::seed_from_u64(seed);
    let text = std::fs::read_to_string(root().join("pipelines/lab/paper-small.toml")).expect("lab");
    let mut config = LabConfig::from_toml(&text, Path::new("lab.toml")).expect("lab");
    config.seed = 1000 + seed;
    let (board, tilts) = (draw.random_bool(0.5), draw.random_bool(0.5));
    config.task.passes[0].share = if board { 0.4 } else { 0.0 };
    config.task.passes.truncate(1);
    config.task.free.poses = draw.random_range(14..22);
    config.recordings.truncate(if tilts { 2 } else { 1 });
    let mut names: Vec<String> = NAMES.map(str::to_owned).to_vec();
    names.shuffle(&mut draw);
    let mut name = || names.pop().expect("a name");
    let mut truth = BTreeMap::new();
    for (body, role) in
        [(&mut config.vicon.tip, "tip"), (&mut config.vicon.table, "table"), (&mut config.vicon.base, "base")]
    {
        body.subject = name();
        body.occlusions_per_minute = draw.random_range(0.0..8.0);
        body.occlusion_s = draw.random_range(0.2..1.5);
        truth.insert(body.subject.clone(), role);
    }
    for (link, at_mm) in [(3, [-60.0, 50.0, 35.0]), (2, [0.0, -60.0, -45.0])] {
        if draw.random_bool(0.4) {
            let marker = MarkerConfig {
                subject: name(),
                link,
                at_mm,
                rate_hz: 50.0,
                rotation_sigma_deg: 0.15,
                occlusions_per_minute: draw.random_range(0.0..8.0),
                occlusion_s: 1.0,
            };
            truth.insert(marker.subject.clone(), "marker");
            config.vicon.markers.push(marker);
        }
    }
    if board && draw.random_bool(0.3) {
        config.vicon.table_markers = TableMarkers::Frame;
    }
    let [table, base] = [&config.vicon.table, &config.vicon.base].map(|b| b.subject.clone());
    let mut dropped = Vec::new();
    let (mut wand, mut stand) = (None, None);
    if truth.len() < 6 && draw.random_bool(0.4) {
        wand = Some(name());
        truth.insert(wand.clone().expect("wand"), "moves by itself");
    }
    if truth.len() < 6 && draw.random_bool(0.4) {
        stand = Some(name());
        truth.insert(stand.clone().expect("stand"), "stands still");
    }
    if truth.len() > 3 && draw.random_bool(0.3) {
        dropped.push(if draw.random_bool(0.5) { table.clone() } else { base.clone() });
        truth.remove(&dropped[0]);
    }
    // Without a board and without a tilt nothing tells a table from anything else that stands.
    let mut undecided = Vec::new();
    if !board && !tilts {
        undecided.extend([Some(table), stand.clone()].into_iter().flatten());
    }
    Case { config, board, truth, undecided, dropped, wand, stand }
}

/// Takes bodies out of a log and puts others in, seen at the times of the tip.
fn edit(case: &Case, log: &mut Log) {
    let topic = |name: &str| format!("/vicon/{name}/{name}");
    let tip =
        log.channels.iter().position(|c| c.topic == topic(&case.config.vicon.tip.subject)).expect("tip");
    let times: Vec<(i64, i64)> =
        log.messages.iter().filter(|m| m.channel == tip).map(|m| (m.stamp_ns, m.log_ns)).collect();
    for (name, moves) in [(&case.wand, true), (&case.stand, false)] {
        let Some(name) = name else { continue };
        let channel = log.channel(&topic(name), Kind::PoseStamped, "vicon/world", std::slice::from_ref(name));
        // The same in every recording: what stands was not moved between them.
        let mut draw = ChaCha8Rng::seed_from_u64(case.config.seed + u64::from(moves));
        let phase: [f64; 6] = std::array::from_fn(|_| draw.random_range(0.2..1.1));
        for (sequence, (stamp_ns, log_ns)) in times.iter().enumerate() {
            // A person carries it about, puts it down now and then, and takes it up again.
            let t = (stamp_ns - times[0].0) as f64 * 1e-9;
            let t = if moves { t - 1.2 * (t / 1.2).sin() } else { 0.0 };
            let noise = Vector3::from_fn(|_, _| draw.random_range(-2e-4..2e-4));
            let at = Vector3::new((phase[0] * t).sin(), (phase[1] * t).cos(), 0.3 * (phase[2] * t).sin());
            let turned = UnitQuaternion::from_euler_angles(phase[3] * t, (phase[4] * t).sin(), phase[5]);
            let shake = UnitQuaternion::from_scaled_axis(noise);
            let payload = Payload::Pose {
                position_m: Vector3::new(0.4, 0.5, 1.1) + 0.4 * at + noise,
                orientation: (turned * shake).into_inner(),
            };
            log.messages.push(Message {
                channel,
                sequence: sequence as u32,
                stamp_ns: *stamp_ns,
                log_ns: *log_ns,
                payload,
            });
        }
    }
    let gone: Vec<usize> = (0..log.channels.len())
        .filter(|c| case.dropped.iter().any(|n| log.channels[*c].topic == topic(n)))
        .collect();
    log.messages.retain(|m| !gone.contains(&m.channel));
    log.messages.sort_by_key(|m| m.log_ns);
}

/// What `armcal init` says of each body, by its name: role, whether it is sure, and why.
fn told(case: &Case, folder: &Path) -> BTreeMap<String, (String, bool, String)> {
    let lab = root().join("pipelines/lab");
    let (_, mut logs) =
        armcal_lab::simulate_in_memory(&case.config, &lab, &nothing_hidden).expect("a session");
    let mut arguments = vec!["init".to_owned(), "--json".to_owned()];
    for (log, recording) in logs.iter_mut().zip(&case.config.recordings) {
        edit(case, log);
        let path = folder.join(format!("{}.mcap", recording.name));
        record::write(&path, "rig", &recording.name, log).expect("written");
        arguments.push(path.display().to_string());
    }
    let models = root().join("pipelines");
    arguments.extend(["--dh".to_owned(), models.join("models/right_arm.toml").display().to_string()]);
    if case.board {
        arguments.extend(["--board".to_owned(), models.join("boards/paper.toml").display().to_string()]);
    }
    arguments.extend(["--out".to_owned(), folder.join("p.toml").display().to_string()]);
    let output = armcal(&arguments);
    let said: Value = serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&output.stderr)));
    let bodies = said["bodies"].as_array().expect("bodies").iter();
    bodies
        .map(|b| {
            let text = |key: &str| b[key].as_str().expect("text").to_owned();
            let name = text("topic").rsplit('/').next().unwrap_or_default().to_owned();
            (name, (text("role"), b["sure"].as_bool().expect("sure"), text("why")))
        })
        .collect()
}

/// Sessions of the paper's rig with three to six bodies, called as other bodies are, hidden now and then, with things that a
/// person carries about or left standing: no role is wrong and called sure, and few are unsure.
#[test]
fn bodies_get_their_roles_from_their_motion_whatever_they_are_called() {
    let (mut right, mut unsure, mut undecided, mut missed) = (0, Vec::new(), 0, Vec::new());
    for seed in 0..CASES {
        let case = case(seed);
        let folder = tempfile::tempdir().expect("temporary folder");
        assert!((3..=6).contains(&case.truth.len()), "{:?}", case.truth);
        let told = told(&case, folder.path());
        for (name, role) in &case.truth {
            let (said, sure, why) = &told[name];
            let line = format!("{seed}: {name} is {role}, said: {said} ({why})");
            match (said == role, *sure) {
                _ if case.undecided.contains(name) && (!sure || said == "stands still") => undecided += 1,
                (true, true) => right += 1,
                (_, false) => unsure.push(line),
                (false, true) => missed.push(line),
            }
        }
    }
    println!(
        "{CASES} sessions: {right} bodies right, {} unsure, {undecided} that nothing tells, {} wrong",
        unsure.len(),
        missed.len()
    );
    unsure.iter().for_each(|line| println!("unsure {line}"));
    missed.iter().for_each(|line| println!("wrong {line}"));
    assert!(missed.is_empty(), "{missed:#?}");
    assert!(unsure.len() * 20 < right, "{unsure:#?}");
}
