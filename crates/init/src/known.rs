//! Everything that was found out.

use crate::Asked;
use crate::arm::Arm;
use crate::evidence::Evidence;
use crate::files::Opened;
use crate::points::Points;
use crate::read::AllRead;
use crate::roles::Cast;
use crate::seats::Seats;
use crate::sockets::Sockets;
use armcal_table::Board;
use std::path::Path;

/// Everything that was found out.
pub struct Known<'a> {
    /// What the user said.
    pub asked: &'a Asked,
    /// The recordings.
    pub opened: &'a [Opened],
    /// The arm.
    pub arm: &'a Arm,
    /// What was read.
    pub read: &'a AllRead,
    /// What the bodies did.
    pub evidence: &'a [Evidence],
    /// What they are.
    pub cast: &'a [Cast],
    /// Which of them fit the board.
    pub seats: Option<Seats>,
    /// The board of the user.
    pub board: Option<(&'a Path, &'a Board)>,
    /// Sockets without a drawing.
    pub sockets: Option<Sockets>,
    /// What a laser tracker exported, of each recording or of none.
    pub points: Vec<Points>,
    /// Numbers called temperatures, by topic and path.
    pub warm: &'a [(String, String)],
    /// Mistakes that are undone where the recordings are read.
    pub mended: &'a [String],
    /// Noise of a sensor of which each pause has one pose, where it is known better than assumed [mm].
    pub noise_mm: Option<f64>,
}
