//! Three sound rigs, and what they record.

mod hidden;
pub mod six_axis;
pub mod table;

use crate::Error;
use armcal_lab::LabConfig;
use armcal_lab::sensors::Log;
use serde::{Deserialize, Serialize};

pub use hidden::Hidden;

/// A rig.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rig {
    /// A three-axis arm at a calibration table, Vicon on base, table and tip.
    Table,
    /// The same arm and table without a camera: encoders only, the board's pose estimated.
    Sockets,
    /// A six-axis arm and a tracker that sees a 6-DoF target on its flange; no table.
    Poses,
}

impl Rig {
    /// All of them.
    pub const ALL: [Rig; 3] = [Rig::Table, Rig::Sockets, Rig::Poses];

    /// Its name on the command line and in the table.
    pub fn word(self) -> &'static str {
        match self {
            Rig::Table => "table",
            Rig::Sockets => "sockets",
            Rig::Poses => "poses",
        }
    }

    /// Reads such a name.
    pub fn named(word: &str) -> Result<Rig, Error> {
        Rig::ALL.into_iter().find(|rig| rig.word() == word).ok_or_else(|| Error::Unknown {
            what: "rig",
            name: word.to_owned(),
            known: Rig::ALL.map(Rig::word).join(", "),
        })
    }
}

/// One recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Recorded {
    /// Its name; the file is `<name>.mcap`.
    pub name: String,
    /// Its messages, in the order in which they are written.
    pub log: Log,
    /// Rests of the arm, in order of time.
    pub rests: Vec<Rest>,
}

/// One rest, on the robot's clock.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rest {
    /// Start [ns].
    pub start_ns: i64,
    /// End [ns].
    pub end_ns: i64,
}

/// What makes recordings.
#[derive(Debug, Clone, PartialEq)]
pub enum Source {
    /// The virtual lab.
    Lab(Box<LabConfig>),
    /// The six-axis arm.
    SixAxis(six_axis::Lab),
}

impl Source {
    /// Names of the joints.
    pub fn joint_names(&self) -> Vec<String> {
        match self {
            Source::Lab(config) => config.joints.names.clone(),
            Source::SixAxis(_) => six_axis::NAMES.map(str::to_owned).to_vec(),
        }
    }

    /// Records.
    pub fn record(&self, rig: Rig) -> Result<Vec<Recorded>, Error> {
        match self {
            Source::Lab(config) => table::record(rig, config),
            Source::SixAxis(lab) => Ok(lab.record()),
        }
    }

    /// Another rig of the same kind; a six-axis arm stands in the same place.
    pub fn reseed(&mut self) {
        match self {
            Source::Lab(config) => config.seed += 1,
            Source::SixAxis(lab) => lab.seed += 1,
        }
    }
}

/// A tracked body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Body {
    /// Tool or flange.
    Tip,
    /// The robot's base.
    Base,
    /// The calibration board.
    Table,
    /// A body that stands still in the room; in no pipeline.
    Still,
}

/// The bodies that a rig's camera sees.
pub fn bodies(rig: Rig) -> &'static [Body] {
    match rig {
        Rig::Table => &[Body::Tip, Body::Base, Body::Table],
        Rig::Sockets => &[],
        Rig::Poses => &[Body::Tip, Body::Still],
    }
}

/// Topic of a body.
pub fn body_topic(rig: Rig, body: Body) -> &'static str {
    match (rig, body) {
        (Rig::Poses, Body::Tip) => "/laser_tracker/t_mac/t_mac",
        (Rig::Poses, _) => "/laser_tracker/reference/reference",
        (_, Body::Tip) => "/vicon/tip/tip",
        (_, Body::Base) => "/vicon/base/base",
        (_, Body::Table | Body::Still) => "/vicon/table/table",
    }
}

/// Topic of the joint states on every rig.
pub const JOINTS: &str = "/joint_states";

/// The section of the joints.
fn joints_toml(names: &[String]) -> String {
    format!("[streams.joints]\ntopic = \"{JOINTS}\"\nnames = {names:?}\n\n")
}
