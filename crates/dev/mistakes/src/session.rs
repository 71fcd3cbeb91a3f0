//! A session: recordings as messages, with the texts of pipeline, arm and board; and its way to disk.

use crate::rigs::{Body, JOINTS, Recorded, Rig, Source, six_axis, table};
use crate::{Error, draw, rigs};
use armcal_lab::sensors::{Message, Payload};
use armcal_lab::{LabConfig, Nominal, board, record};
use nalgebra::{Quaternion, Vector3};
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// Everything that `armcal run` is given.
#[derive(Debug, Clone, PartialEq)]
pub struct Session {
    /// The rig it was recorded on.
    pub rig: Rig,
    /// What made it, to record something else on the same rig.
    pub source: Source,
    /// The recordings.
    pub recordings: Vec<Recorded>,
    /// `pipeline.toml`.
    pub pipeline: Table,
    /// `arm.toml`.
    pub arm: Table,
    /// `board.toml`.
    pub board: Option<Table>,
    /// Done to the bytes of a recording after it was written.
    pub damage: Vec<(usize, Damage)>,
}

/// What happens to the bytes of a file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Damage {
    /// Only this share of the file is there.
    Cut(f64),
    /// A stretch from this share to that is zeros.
    Zeros(f64, f64),
    /// Nothing is there.
    Emptied,
}

/// Where in the session a message is.
#[derive(Debug, Clone, Copy)]
pub struct At {
    /// Number of the recording, from 0.
    pub recording: usize,
    /// Stamp [ns].
    pub stamp_ns: i64,
    /// Share of its recording that has passed, 0 to 1.
    pub share: f64,
}

impl Session {
    /// A sound session, of a rig and with noise of the case's own.
    pub fn sound(rig: Rig, seed: u64, case: &str) -> Result<Session, Error> {
        let seed = draw::case_seed(seed, case, rig.word());
        match rig {
            Rig::Table | Rig::Sockets => Session::of_lab(rig, table::small_lab(seed)?),
            Rig::Poses => Session::of_six_axis(six_axis::Lab::new(seed)),
        }
    }

    /// What a laboratory records, and the texts with which its recordings are calibrated.
    pub fn of_lab(rig: Rig, config: LabConfig) -> Result<Session, Error> {
        let recordings = table::record(rig, &config)?;
        let pipeline = parse_toml("pipeline", &table::pipeline_toml(rig, &config))?;
        let arm = parse_toml("arm", &Nominal::dh_toml(&config))?;
        let board = Some(parse_toml("board", board::PAPER)?);
        let source = Source::Lab(Box::new(config));
        Ok(Session { rig, source, recordings, pipeline, arm, board, damage: Vec::new() })
    }

    /// The same of the six-axis arm.
    pub fn of_six_axis(lab: six_axis::Lab) -> Result<Session, Error> {
        let recordings = lab.record();
        let pipeline = parse_toml("pipeline", &six_axis::pipeline_toml(&recordings))?;
        let (arm, source) = (parse_toml("arm", six_axis::ARM)?, Source::SixAxis(lab));
        Ok(Session { rig: Rig::Poses, source, recordings, pipeline, arm, board: None, damage: Vec::new() })
    }

    /// Names of the joints, in the order of the arm.
    pub fn joint_names(&self) -> Vec<String> {
        self.source.joint_names()
    }

    /// Topic of a tracked body.
    pub fn topic(&self, body: Body) -> &'static str {
        rigs::body_topic(self.rig, body)
    }

    /// Changes every joint state. Speeds are worked out anew from the changed angles, as a driver would.
    pub fn joints(&mut self, mut change: impl FnMut(&At, &mut Vec<f64>)) {
        self.messages(JOINTS, |at, message| {
            if let Payload::Joints { position, velocity } = &mut message.payload {
                change(at, position);
                velocity.clear();
            }
        });
    }

    /// Changes every pose of a body that was seen.
    pub fn poses(
        &mut self,
        body: Body,
        mut change: impl FnMut(&At, &mut Vector3<f64>, &mut Quaternion<f64>),
    ) {
        self.messages(self.topic(body), |at, message| {
            if let Payload::Pose { position_m, orientation } = &mut message.payload
                && orientation.norm_squared() > 0.5
            {
                change(at, position_m, orientation);
            }
        });
    }

    /// Changes every pose of every tracked body.
    pub fn all_poses(&mut self, mut change: impl FnMut(&At, &mut Vector3<f64>, &mut Quaternion<f64>)) {
        for body in rigs::bodies(self.rig) {
            self.poses(*body, &mut change);
        }
    }

    /// Changes every message of a topic.
    pub fn messages(&mut self, topic: &str, mut change: impl FnMut(&At, &mut Message)) {
        for (recording, recorded) in self.recordings.iter_mut().enumerate() {
            let Some((start_ns, end_ns)) = stamp_range_ns(&recorded.log.messages) else { continue };
            let channels = &recorded.log.channels;
            let of_topic = |m: &&mut Message| channels.get(m.channel).is_some_and(|c| c.topic == topic);
            for message in recorded.log.messages.iter_mut().filter(of_topic) {
                let stamp_ns = message.stamp_ns;
                let share = (stamp_ns - start_ns) as f64 / (end_ns - start_ns).max(1) as f64;
                change(&At { recording, stamp_ns, share: share.clamp(0.0, 1.0) }, message);
            }
        }
    }

    /// A moment between two rests, near this share of a recording [ns].
    pub fn moment_ns(&self, recording: usize, share: f64) -> i64 {
        let Some(rests) = self.recordings.get(recording).map(|r| &r.rests).filter(|r| !r.is_empty()) else {
            return 0;
        };
        let last = ((rests.len() as f64 * share) as usize).clamp(1, rests.len()) - 1;
        match rests.get(last + 1) {
            Some(next) => (rests[last].end_ns + next.start_ns) / 2,
            None => rests[last].end_ns,
        }
    }

    /// Records again on the same rig, with something changed.
    pub fn recorded_with(&self, change: impl FnOnce(&mut Source)) -> Result<Vec<Recorded>, Error> {
        let mut source = self.source.clone();
        change(&mut source);
        source.record(self.rig)
    }

    /// A key of the pipeline, with the tables to it made where they are missing.
    pub fn set(&mut self, path: &[&str], value: impl Into<Value>) {
        set_key(&mut self.pipeline, path, value.into());
    }

    /// The entries of `[[recordings]]` of the pipeline.
    pub fn entries(&mut self) -> &mut Vec<Value> {
        array_entry(&mut self.pipeline, "recordings")
    }

    /// The rows of the arm's table.
    pub fn rows(&mut self) -> &mut Vec<Value> {
        array_entry(&mut self.arm, "rows")
    }

    /// Changes every entry of the arm's table.
    pub fn entries_of_rows(&mut self, mut change: impl FnMut(usize, &str, &mut f64)) {
        for (row, table) in self.rows().iter_mut().filter_map(Value::as_table_mut).enumerate() {
            for key in ["theta_deg", "d_mm", "a_mm", "alpha_deg"] {
                let entry = match table.get_mut(key) {
                    Some(Value::Table(entry)) => entry.get_mut("nominal"),
                    entry => entry,
                };
                if let Some(Value::Float(number)) = entry {
                    change(row, key, number);
                }
            }
        }
    }

    /// Changes the drawn position of every cavity [mm].
    pub fn cavities(&mut self, mut change: impl FnMut(usize, &mut [f64; 3])) {
        let Some(board) = &mut self.board else { return };
        for (i, cavity) in
            array_entry(board, "cavities").iter_mut().filter_map(Value::as_table_mut).enumerate()
        {
            let Some(Value::Array(xyz)) = cavity.get_mut("xyz_mm") else { continue };
            let mut mm = [0.0; 3];
            mm.iter_mut().zip(xyz.iter()).for_each(|(mm, v)| *mm = v.as_float().unwrap_or_default());
            change(i, &mut mm);
            *xyz = mm.map(Value::Float).to_vec();
        }
    }

    /// Writes everything to a folder; returns the path of the pipeline.
    pub fn write(&self, folder: &Path) -> Result<PathBuf, Error> {
        std::fs::create_dir_all(folder).map_err(Error::file("making the folder", folder))?;
        for (i, recorded) in self.recordings.iter().enumerate() {
            let path = folder.join(format!("{}.mcap", recorded.name));
            record::write(&path, "rig", &recorded.name, &recorded.log)?;
            for (_, damage) in self.damage.iter().filter(|(of, _)| *of == i) {
                damage.apply(&path)?;
            }
        }
        write_toml(folder, "arm.toml", &self.arm)?;
        if let Some(board) = &self.board {
            write_toml(folder, "board.toml", board)?;
        }
        write_toml(folder, "pipeline.toml", &self.pipeline)
    }
}

impl Damage {
    fn apply(self, path: &Path) -> Result<(), Error> {
        let mut bytes = std::fs::read(path).map_err(Error::file("reading", path))?;
        let at = |share: f64| (bytes.len() as f64 * share) as usize;
        match self {
            Damage::Cut(share) => bytes.truncate(at(share)),
            Damage::Zeros(from, to) => {
                let range = at(from)..at(to);
                bytes[range].fill(0);
            }
            Damage::Emptied => bytes.clear(),
        }
        std::fs::write(path, bytes).map_err(Error::file("writing", path))
    }
}

/// First and last stamp.
pub fn stamp_range_ns(messages: &[Message]) -> Option<(i64, i64)> {
    let stamps = || messages.iter().map(|m| m.stamp_ns);
    Some((stamps().min()?, stamps().max()?))
}

/// A shipped text as a table.
fn parse_toml(what: &'static str, text: &str) -> Result<Table, Error> {
    text.parse().map_err(|source| Error::Toml { what, source: Box::new(source) })
}

fn write_toml(folder: &Path, name: &'static str, table: &Table) -> Result<PathBuf, Error> {
    let text = toml::to_string(table).map_err(|e| Error::Text { what: name, source: Box::new(e) })?;
    let path = folder.join(name);
    std::fs::write(&path, text).map_err(Error::file("writing", &path))?;
    Ok(path)
}

/// Sets a key, with the tables to it made where they are missing.
pub fn set_key(table: &mut Table, path: &[&str], value: Value) {
    let Some((last, tables)) = path.split_last() else { return };
    let mut at = table;
    for key in tables {
        let entry = at.entry(*key).or_insert_with(|| Value::Table(Table::new()));
        let Value::Table(inner) = entry else { return };
        at = inner;
    }
    at.insert((*last).to_owned(), value);
}

fn array_entry<'t>(table: &'t mut Table, key: &str) -> &'t mut Vec<Value> {
    let entry = table.entry(key).or_insert_with(|| Value::Array(Vec::new()));
    if !entry.is_array() {
        *entry = Value::Array(Vec::new());
    }
    entry.as_array_mut().expect("made an array just above")
}
