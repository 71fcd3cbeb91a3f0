//! Where cavities of the board are where the tip pauses: which body is the table, and how it was tilted.

use super::evidence::{Evidence, Pause};
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

/// Pauses in cavities, of how many.
type Count = (usize, usize);

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
    /// Recordings in which it fits only when it is tilted on that body, and how.
    pub turned: Vec<(usize, Tilt)>,
}

/// The bodies on the last link and those that stand still whose poses put most pauses into cavities.
pub fn find_seats(board: &Board, evidence: &[Evidence], tips: &[usize], still: &[usize]) -> Option<Seats> {
    let counted = |tip: usize, table: usize| -> Vec<Count> {
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
    let mut all: Vec<(usize, usize, Vec<Count>)> =
        pairs.map(|(tip, table)| (tip, table, counted(tip, table))).collect();
    let total = |counts: &[Count]| counts.iter().map(|(seated, _)| *seated).sum::<usize>();
    all.sort_by_key(|(_, _, counts)| std::cmp::Reverse(total(counts)));
    let (tip, table, counts) = all.first()?;
    let fits = |(seated, of): &Count| *seated >= FEWEST && *seated as f64 >= SHARE * *of as f64;
    if !counts.iter().any(fits) {
        return None;
    }
    let second = all.get(1).map_or(0, |(_, _, counts)| total(counts));
    let mut unfit: Vec<usize> =
        (0..counts.len()).filter(|r| counts[*r].1 > 0 && !fits(&counts[*r])).collect();
    let pauses: usize = counts.iter().map(|(_, of)| of).sum();
    // Where the markers are on the frame below the mechanism, a tilt that they do not show puts the cavities where the tip was.
    let mut turned: Vec<(usize, Tilt)> = Vec::new();
    unfit.retain(|r| {
        let found = evidence[*tip].recordings[*r]
            .as_ref()
            .zip(evidence[*table].recordings[*r].as_ref().and_then(|t| t.mean));
        let tilt = found.and_then(|(tip, frame)| {
            tilted_below(board, &frame, &tip.pauses).filter(|(_, seated)| fits(&(*seated, tip.pauses.len())))
        });
        turned.extend(tilt.map(|(tilt, _)| (*r, tilt)));
        tilt.is_none()
    });
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
        unfit,
        turned,
    })
}

/// The tilt of a mechanism on this frame that puts most pauses into cavities, and how many: by whole degrees, then by tenths.
fn tilted_below(board: &Board, frame: &Pose, pauses: &[Pause]) -> Option<(Tilt, usize)> {
    board.mechanism.as_ref()?;
    let seated = |roll_deg: f64, pitch_deg: f64| {
        let tilt = Tilt { roll_rad: roll_deg.to_radians(), pitch_rad: pitch_deg.to_radians() };
        let from_world = (frame * board.tilted(tilt).ok()?).inverse();
        let count = pauses.iter().filter(|p| is_seated(board, &from_world, &p.at_m)).count();
        Some((tilt, count, [roll_deg, pitch_deg]))
    };
    let around = |[roll, pitch]: [f64; 2], steps: i32, step: f64| {
        let offsets = move || (-steps..=steps).map(move |k| f64::from(k) * step);
        let all = offsets().flat_map(move |a| offsets().map(move |b| (roll + a, pitch + b)));
        let all: Vec<_> = all.filter_map(|(roll, pitch)| seated(roll, pitch)).collect();
        let most = all.iter().map(|(_, count, _)| *count).max()?;
        // Of a patch that seats as many, the middle.
        let best: Vec<_> = all.into_iter().filter(|(_, count, _)| *count == most).collect();
        let mean = |k: usize| best.iter().map(|(.., at)| at[k]).sum::<f64>() / best.len() as f64;
        seated(mean(0), mean(1))
    };
    let (.., coarse) = around([0.0; 2], 20, 1.0)?;
    let (tilt, count, _) = around(coarse, 15, 0.1)?;
    Some((tilt, count))
}

fn is_seated(board: &Board, board_from_world: &Pose, at_m: &Vector3<f64>) -> bool {
    let in_board_m = board_from_world.transform_point(&(*at_m).into()).coords;
    board.cavities.iter().any(|c| (c.in_board_m - in_board_m).norm() < SEATED_M)
}

/// The tilt of the table in each recording, against the recording in which its normal is steepest; none without a mechanism, or
/// where it did not move.
pub fn table_tilts(board: &Board, table: &Evidence) -> Vec<Option<Tilt>> {
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
pub fn median_tilt_rad(bases: &[UnitQuaternion<f64>]) -> f64 {
    let lean: Vec<f64> = bases.iter().map(|q| (q * Vector3::z()).angle(&Vector3::z())).collect();
    median(&lean)
}
