//! A body that stands while the arm moves.

/// A joint that turned by this much did move [rad].
pub const TURNS_RAD: f64 = 0.1;
/// The tip's path is short against this where something else was tracked [m].
const STANDS_M: f64 = 0.005;

/// A tip that moved by `tip_m` at most while a joint turned by `turned_rad`, in a sentence where it should have moved more.
pub fn still_tip(tip_m: f64, turned_rad: f64) -> Option<String> {
    (tip_m < STANDS_M && turned_rad > TURNS_RAD).then(|| {
        format!(
            "the body read as the tip stood still (within {:.2} mm) while the joints turned by {:.0} deg: it is another body; \
             mend [streams.tip]",
            tip_m * 1e3,
            turned_rad.to_degrees()
        )
    })
}

/// Between the lowest and the highest of some values.
pub fn value_range(values: impl Iterator<Item = f64>) -> f64 {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    high - low
}
