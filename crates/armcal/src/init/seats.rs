//! Where cavities of the board are where the tip pauses: which body is the table, and how it was tilted.

use super::evidence::Evidence;
use super::read::AllRead;
use armcal_core::Pose;
use armcal_core::robust::median;
use armcal_table::{Board, Tilt};
use nalgebra::{UnitQuaternion, Vector3};

/// A pause this near to a cavity is in it [m]: tolerance, clearance and noise together are below.
const SEATED_M: f64 = 0.004;
/// So many pauses at cavities, and this share of all, are no chance.
const FEWEST: usize = 5;
const SHARE: f64 = 0.3;
/// So many times as many as the next best is clear.
const CLEAR: f64 = 2.0;

/// The tip and the table that fit each other.
pub struct Seats {
    /// The body whose origin was in cavities.
    pub tip: usize,
    /// The body whose frame is the board's.
    pub table: usize,
    /// Whether nothing else fits nearly as well.
    pub clear: bool,
    /// The evidence, in words.
    pub why: String,
    /// Recordings in which it does not fit.
    pub unfit: Vec<usize>,
}

/// The bodies on the last link and those that stand still whose poses put most pauses into cavities.
pub fn seats(
    board: &Board,
    read: &AllRead,
    evidence: &[Evidence],
    tips: &[usize],
    still: &[usize],
) -> Option<Seats> {
    let counted = |tip: usize, table: usize| -> Vec<(usize, usize)> {
        let both = evidence[tip].recordings.iter().zip(&evidence[table].recordings);
        both.map(|pair| match pair {
            (Some(tip), Some(table)) => {
                let frame = table.mean.map(|mean| mean.inverse());
                let seated =
                    |frame: &Pose| tip.pauses.iter().filter(|p| is_seated(board, frame, &p.at_m)).count();
                (frame.as_ref().map_or(0, seated), tip.pauses.len())
            }
            _ => (0, 0),
        })
        .collect()
    };
    let pairs = tips.iter().flat_map(|tip| still.iter().map(move |table| (*tip, *table)));
    let mut all: Vec<(usize, usize, Vec<(usize, usize)>)> =
        pairs.map(|(tip, table)| (tip, table, counted(tip, table))).collect();
    let total = |counts: &[(usize, usize)]| counts.iter().map(|(seated, _)| *seated).sum::<usize>();
    all.sort_by_key(|(_, _, counts)| std::cmp::Reverse(total(counts)));
    let (tip, table, counts) = all.first()?;
    let fits = |(seated, of): &(usize, usize)| *seated >= FEWEST && *seated as f64 >= SHARE * *of as f64;
    if !counts.iter().any(fits) {
        return None;
    }
    let second = all.get(1).map_or(0, |(_, _, counts)| total(counts));
    let unfit: Vec<usize> = (0..counts.len()).filter(|r| counts[*r].1 > 0 && !fits(&counts[*r])).collect();
    let pauses: usize = counts.iter().map(|(_, of)| of).sum();
    Some(Seats {
        tip: *tip,
        table: *table,
        clear: total(counts) as f64 > CLEAR * second as f64 && unfit.is_empty(),
        why: format!(
            "in its frame {} of {pauses} pauses are within {:.0} mm of a cavity of {}",
            total(counts),
            SEATED_M * 1e3,
            board.name
        ),
        unfit: unfit.into_iter().filter(|r| read.recordings.get(*r).is_some()).collect(),
    })
}

fn is_seated(board: &Board, board_from_world: &Pose, at_m: &Vector3<f64>) -> bool {
    let in_board_m = board_from_world.transform_point(&(*at_m).into()).coords;
    board.cavities.iter().any(|c| (c.in_board_m - in_board_m).norm() < SEATED_M)
}

/// The tilt of the table in each recording, against the recording in which its normal is steepest; none without a mechanism, or
/// where it did not move.
pub fn tilts(board: &Board, table: &Evidence) -> Vec<Option<Tilt>> {
    let means: Vec<Option<Pose>> = table.recordings.iter().map(|r| r.as_ref()?.mean).collect();
    let steep = |pose: &&Pose| (pose.rotation * Vector3::z()).z;
    let level = means.iter().flatten().max_by(|a, b| steep(a).total_cmp(&steep(b)));
    let tilt = |mean: &Option<Pose>| {
        let (mechanism, level, mean) = (board.mechanism.as_ref()?, level?, mean.as_ref()?);
        let turn = level.rotation.inverse() * mean.rotation;
        let mut tilt = Tilt::default();
        for _ in 0..20 {
            let left = board.tilted(tilt).ok()?.rotation.inverse() * turn;
            tilt.roll_rad += left.scaled_axis().dot(&mechanism.roll_axis);
            tilt.pitch_rad += left.scaled_axis().dot(&mechanism.pitch_axis);
        }
        board.tilted(tilt).ok().map(|_| tilt)
    };
    means.iter().map(tilt).collect()
}

/// How well a constant turn of the base explains that it is not where the world's z axis points [rad].
pub fn lean(bases: &[UnitQuaternion<f64>]) -> f64 {
    let lean: Vec<f64> = bases.iter().map(|q| (q * Vector3::z()).angle(&Vector3::z())).collect();
    median(&lean)
}
