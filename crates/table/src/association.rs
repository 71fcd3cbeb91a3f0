//! The outcome of associating dwells to cavities.

use armcal_core::{DwellId, Pose, Warning};

/// What a dwell turned out to be.
#[derive(Debug, Clone, PartialEq)]
pub enum Place {
    /// The tip sits in this cavity.
    Seated {
        /// Name of the cavity.
        cavity: String,
        /// Odds for this cavity against the next best explanation, as a probability.
        confidence: f64,
    },
    /// The tip pauses above the board without being in a cavity.
    Hovering {
        /// Height above the seated position along the board's normal [m].
        height_m: f64,
        /// The cavity below.
        above: String,
    },
    /// The tip is far from the board.
    FreeSpace,
    /// More than one cavity explains it.
    Ambiguous {
        /// The cavities, best first.
        cavities: Vec<String>,
    },
    /// Near the board, yet no cavity explains it.
    Unassigned {
        /// Why, in words.
        why: String,
    },
}

impl Place {
    /// As outputs spell it.
    pub fn word(&self) -> &'static str {
        match self {
            Place::Seated { .. } => "seated",
            Place::Hovering { .. } => "hovering",
            Place::FreeSpace => "free_space",
            Place::Ambiguous { .. } => "ambiguous",
            Place::Unassigned { .. } => "unassigned",
        }
    }
}

/// One dwell and its place.
#[derive(Debug, Clone, PartialEq)]
pub struct Assignment {
    /// The dwell.
    pub dwell: DwellId,
    /// Where its tip was.
    pub place: Place,
    /// Distance between the aligned tip and the cavity [m]; NaN where there is no cavity.
    pub distance_m: f64,
}

/// All dwells of one recording, associated.
#[derive(Debug, Clone, PartialEq)]
pub struct Association {
    /// One entry a dwell, in the order given.
    pub assignments: Vec<Assignment>,
    /// The board's pose that makes tips and cavities agree best: absorbs the offset of a wrong model,
    /// and starts the fit of an estimated board frame.
    pub board_in_world: Pose,
    /// What the user should know.
    pub warnings: Vec<Warning>,
}
