//! The paper's rig from the virtual lab, with Vicon or with encoders only.

use super::{Body, JOINTS, Recorded, Rest, Rig, body_topic, joints_toml};
use crate::Error;
use armcal_lab::sensors::Log;
use armcal_lab::{LabConfig, board, nothing_hidden};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// The small rig that the fixtures come from.
const SMALL: &str = include_str!("../../../../../pipelines/lab/paper-small.toml");

/// The small rig of a seed: one pass over the cavities in each of three tilts, twelve free poses.
pub fn small_lab(seed: u64) -> Result<LabConfig, Error> {
    let mut config = LabConfig::from_toml(SMALL, Path::new("paper-small.toml"))?;
    config.board.file = PathBuf::from(board::BUILTIN);
    config.seed = seed;
    Ok(config)
}

/// The recordings of a laboratory.
pub fn record(rig: Rig, config: &LabConfig) -> Result<Vec<Recorded>, Error> {
    let (truth, logs) = armcal_lab::simulate_in_memory(config, Path::new(""), &nothing_hidden)?;
    let recorded = truth.recordings.into_iter().zip(logs).map(|(truth, log)| Recorded {
        name: truth.name,
        log: if rig == Rig::Sockets { without_camera(log) } else { log },
        rests: truth.dwells.iter().map(|d| Rest { start_ns: d.start_ns, end_ns: d.end_ns }).collect(),
    });
    Ok(recorded.collect())
}

fn without_camera(mut log: Log) -> Log {
    let kept: Vec<usize> = (0..log.channels.len()).filter(|c| log.channels[*c].topic == JOINTS).collect();
    log.messages.retain(|m| kept.contains(&m.channel));
    log.messages.iter_mut().for_each(|m| m.channel = 0);
    log.channels.retain(|c| c.topic == JOINTS);
    log.occlusions.clear();
    log
}

/// The pipeline with which its recordings are calibrated.
pub fn pipeline_toml(rig: Rig, config: &LabConfig) -> String {
    let mut text = format!("name = \"{}\"\n\n", rig.word());
    for recording in &config.recordings {
        // Writing to a string cannot fail.
        let _ = write!(
            text,
            "[[recordings]]\npaths = [\"{}.mcap\"]\ntilt = {{ roll_deg = {:?}, pitch_deg = {:?} }}\nload_kg = {:?}\n\n",
            recording.name, recording.roll_deg, recording.pitch_deg, recording.load_kg
        );
    }
    text += &joints_toml(&config.joints.names);
    if rig == Rig::Table {
        for (stream, body) in [("tip", Body::Tip), ("base", Body::Base), ("table", Body::Table)] {
            let _ = write!(text, "[streams.{stream}]\ntopic = \"{}\"\n\n", body_topic(rig, body));
        }
    }
    let (board, base) = match rig {
        Rig::Table => ("measured", "pose = \"measured\"\nsigma_mm = 0.3\nsigma_deg = 0.05"),
        _ => ("estimated", "pose = \"given\""),
    };
    let _ = write!(
        text,
        "[table]\nboard = \"board.toml\"\npose = \"{board}\"\n\n[model]\ndh = \"arm.toml\"\n\n[frames.base]\n{base}\n\n\
         [holdout]\nkind = \"cavity-folds\"\nk = 5\n"
    );
    text
}
