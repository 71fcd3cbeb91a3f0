//! A change in words.

use super::date::utc_minute;
use armcal_campaign::{Change, ChangeKind, ErrorFigures, Row, Status};
use armcal_core::units::format_mm;
use armcal_core::{Unit, printable_name};
use armcal_result::{Campaign, Repeat};
use armcal_wording::in_display_unit;

/// Days of a month, as rates are told.
const MONTH_DAYS: f64 = 30.0;

/// Start of a recording, mean errors before and after [mm], or `none` where there are none, and a status that is not good.
pub(super) fn cells(row: &Row, none: &str) -> [String; 4] {
    let mean = |errors: &ErrorFigures| errors.mean_m.map_or(none.to_owned(), format_mm);
    let flag = if row.status == Status::Ok { "" } else { row.status.word() };
    [utc_minute(row.start_ns), mean(&row.nominal), mean(&row.calibrated), flag.to_owned()]
}

/// What, by how much, between which recordings.
pub(super) fn change_sentence(campaign: &Campaign, change: &Change) -> String {
    let row = |row: usize| {
        let row = &campaign.rows[row];
        format!("`{}` ({})", printable_name(&row.recording), utc_minute(row.start_ns))
    };
    let name = printable_name(&change.quantity);
    match change.kind {
        ChangeKind::Step { before, after } => {
            let own = campaign.rows[after].quantities.iter().find(|q| *q.name == *change.quantity);
            let more = if own.is_some_and(|q| q.at_bound) { ", to its bound or beyond," } else { "" };
            format!(
                "{name} steps by {}{more} between {} and {}",
                change_size_text(change, 1.0),
                row(before),
                row(after)
            )
        }
        ChangeKind::Outlier { at } => {
            format!("{name} is off by {} in {} alone", change_size_text(change, 1.0), row(at))
        }
        ChangeKind::Trend { from, to } => {
            let month = change_size_text(change, MONTH_DAYS);
            format!("{name} changes by {month} a month ({MONTH_DAYS} days) from {} to {}", row(from), row(to))
        }
    }
}

/// What two recordings have in common, and what follows.
pub(super) fn repeat_sentence(campaign: &Campaign, repeat: &Repeat) -> String {
    let name = |row: usize| printable_name(&campaign.rows[row].recording);
    let (own, other, Repeat { dwells, all, .. }) = (name(repeat.row), name(repeat.of), repeat);
    let follows = if repeat.counts_once() {
        "it counts once, as the other"
    } else {
        "both count, though they are not independent"
    };
    format!("`{own}` holds the same readings as `{other}` in {dwells} of its {all} dwells: {follows}")
}

/// What a change of this quantity usually is.
pub(super) fn change_meaning(change: &Change) -> Option<&'static str> {
    let (name, step) = (change.quantity.as_str(), matches!(change.kind, ChangeKind::Step { .. }));
    match () {
        () if name.starts_with("board_in_base.") && step => Some("table or robot bumped, or set up anew"),
        () if name.starts_with("board_in_base.") => Some("table or robot moves on its foundation"),
        () if name.starts_with("joint") && name.ends_with(".theta") && step => {
            Some("belt slipped, coupling turned, or encoder zeroed anew")
        }
        () if name.starts_with("error.") => Some("the model describes the arm worse or better than before"),
        () if name.starts_with("tip.") && step => Some("another tool, or the same one clamped anew"),
        () if name.starts_with("base.") && step => Some("camera or robot set up anew"),
        () => None,
    }
}

/// Signed, with the half width of its interval, in the unit for people.
fn change_size_text(change: &Change, times: f64) -> String {
    let (value, symbol) = value_and_symbol(change.unit, change.size * times);
    let half = change.ci95.map(|[low, high]| value_and_symbol(change.unit, 0.5 * (high - low) * times).0);
    let sign = if change.size > 0.0 { "+" } else { "" };
    let half = half.map_or(String::new(), |half| format!(" ± {half}"));
    format!("{sign}{value}{half} {symbol}").trim_end().to_owned()
}

fn value_and_symbol(unit: Unit, si: f64) -> (String, &'static str) {
    (in_display_unit(unit, si), unit.display_symbol())
}
