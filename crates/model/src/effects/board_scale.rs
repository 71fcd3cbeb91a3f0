//! A board that is a little larger or smaller than its file says.
//!
//! # What moves
//! Print shrinkage, temperature, a wrong drawing: the cavities are spread or squeezed.
//!
//! # Equation
//! `dp = (x X, y Y, 0)` of the cavity at (X, Y) in the frame of the board; seated points only.
//!
//! # Parameters and units
//! `x`, `y` [1] along the axes of the board.
//!
//! # Signature in the data
//! An error that grows from the board's origin outwards and turns with the board.
//!
//! # Not to be confused with
//! All lengths of the arm scaled alike; `seat_offset`, which is random.
//!
//! # Source
//! Notes of the project; PLA prints 0.1 to 0.5 %.

use super::prelude::*;

pub(super) const KIND: EffectKind = EffectKind {
    aliases: &["print shrinkage"],
    summary: "the board is larger or smaller than declared",
    family: Family::Board,
    target: Target::Whole,
    confused_with: &["sensor_scale"],
    place: effect_placement,
    lookalikes: &[Lookalikes::Lengths],
    ..EffectKind::PLAIN
};

#[derive(Debug)]
struct BoardScale;

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    if context.session.cavities.is_empty() {
        return Err("no observation is seated in the board".to_owned());
    }
    let scale = |axis: &str| {
        amplitude(axis, Unit::One, 0.003, 0.05, format!("relative error of the board's size along {axis}"))
    };
    Ok(Placement::new(vec![scale("x"), scale("y")], BoardScale))
}

impl Physics for BoardScale {
    fn deform<D: Scalar>(&self, theta: &[D], x: &Drivers<'_>, change: &mut Deformation<D>) {
        if let Some(in_board_m) = x.observation.in_board_m() {
            change.seat_m.x += theta[0] * in_board_m.x;
            change.seat_m.y += theta[1] * in_board_m.y;
        }
    }
}
