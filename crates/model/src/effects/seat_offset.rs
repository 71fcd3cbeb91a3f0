//! Cavities that are not where the board says.
//!
//! # What moves
//! Every cavity has its own machining error or clearance: a random offset, the same at every visit.
//!
//! # Equation
//! `dp = u` of the cavity, in the frame of the board, `u ~ N(0, 0.2 mm)`; seated points only.
//!
//! # Parameters and units
//! `<cavity>.x`, `<cavity>.y`, `<cavity>.z` [m], for each cavity of the session.
//!
//! # Signature in the data
//! Residuals that agree between visits of a cavity and differ between cavities; they turn with the board.
//!
//! # Not to be confused with
//! `board_scale`, which is smooth. It is part of the noise of a seated point: the diagnosis treats it as a
//! variance.
//!
//! # Source
//! Notes of the project.

use super::prelude::*;
use std::ops::Range;

pub(super) const KIND: EffectKind = EffectKind {
    aliases: &["machining error of cavities"],
    summary: "each cavity is a little off: a random offset",
    family: Family::Board,
    target: Target::Whole,
    offered: Offered::Never,
    confused_with: &["board_scale"],
    place: effect_placement,
    ..EffectKind::PLAIN
};

#[derive(Debug)]
struct SeatOffset {
    cavities: Vec<String>,
}

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    let cavities = context.session.cavities.clone();
    if cavities.is_empty() {
        return Err("no observation is seated in the board".to_owned());
    }
    let amplitudes = cavities
        .iter()
        .flat_map(|cavity| {
            ["x", "y", "z"].map(|axis| {
                let meaning = format!("offset of {cavity} along the board's {axis}");
                amplitude(&format!("{cavity}.{axis}"), Unit::Metre, 0.2e-3, 3e-3, meaning)
            })
        })
        .collect();
    Ok(Placement::new(amplitudes, SeatOffset { cavities }))
}

impl SeatOffset {
    /// Where the offset of the observation's cavity begins.
    fn first(&self, x: &Drivers<'_>) -> Option<usize> {
        let cavity = x.observation.cavity()?;
        self.cavities.binary_search_by(|own| own.as_str().cmp(cavity)).ok().map(|index| 3 * index)
    }
}

impl Physics for SeatOffset {
    fn deform<D: Scalar>(&self, theta: &[D], x: &Drivers<'_>, change: &mut Deformation<D>) {
        if let Some(first) = self.first(x) {
            for axis in 0..3 {
                change.seat_m[axis] += theta[first + axis];
            }
        }
    }

    fn touched(&self, x: &Drivers<'_>, _count: usize) -> Range<usize> {
        self.first(x).map_or(0..0, |first| first..first + 3)
    }
}
