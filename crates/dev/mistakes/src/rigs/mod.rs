//! Three sound rigs.

mod hidden;
pub mod six_axis;
mod table;

use crate::session::{Body, JOINTS, Recorded, Session};
use crate::{Error, draw};
use armcal_lab::LabConfig;
use serde::{Deserialize, Serialize};
use toml::Table;

pub use hidden::Hidden;
pub use table::{session_of, small_lab};

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

    /// A sound session, of a rig and with noise of the case's own.
    pub fn session(self, seed: u64, case: &str) -> Result<Session, Error> {
        let seed = draw::case_seed(seed, case, self.word());
        match self {
            Rig::Table | Rig::Sockets => session_of(self, small_lab(seed)?),
            Rig::Poses => six_axis::session(six_axis::Lab::new(seed)),
        }
    }
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

/// A shipped text as a table.
fn parse_toml(what: &'static str, text: &str) -> Result<Table, Error> {
    text.parse().map_err(|source| Error::Toml { what, source: Box::new(source) })
}

/// The section of the joints.
fn joints_toml(names: &[String]) -> String {
    format!("[streams.joints]\ntopic = \"{JOINTS}\"\nnames = {names:?}\n\n")
}
