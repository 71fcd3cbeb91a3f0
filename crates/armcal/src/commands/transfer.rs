//! `armcal transfer`: does what one session taught help in another?

use super::{Outcome, print};
use crate::error::Error;
use crate::progress::Progress;
use armcal_calibrate::HeldOut;
use armcal_held_out::{Asked, SessionTransfer, transfer_between_sessions};
use armcal_report::{number_cell, plain_table, table_text};
use comfy_table::Cell;

/// Judges one session's calibration in the other and prints what became of it.
pub fn run(asked: &Asked<'_>, json: bool) -> Result<Outcome, Error> {
    let progress = Progress::new();
    let transfer = transfer_between_sessions(asked, &progress)?;
    progress.finish();
    print(&if json { super::json_text(&transfer)? } else { transfer_text(&transfer) })?;
    Ok(if transfer.harms() { Outcome::CompletedWithWarnings } else { Outcome::Done })
}

fn transfer_text(transfer: &SessionTransfer) -> String {
    let SessionTransfer { from, to, calibration, together, effects, .. } = transfer;
    let mut table = plain_table();
    let header =
        [format!("mean error in {to} [mm]"), "without".into(), "with".into(), "95 % of the change".into()];
    table.set_header(header.into_iter().chain([String::new()]));
    let mut row = |what: String, h: &HeldOut| {
        let [low, high] = h.change_ci95;
        table.add_row([
            Cell::new(what),
            number_cell(format!("{:.3}", h.before)),
            number_cell(format!("{:.3}", h.after)),
            number_cell(format!("{low:+.3} to {high:+.3}")),
            Cell::new(h.verdict()),
        ]);
    };
    row(format!("the arm as {from} calibrates it"), calibration);
    if let Some(together) = together.as_ref().filter(|_| effects.len() > 1) {
        row("all effects of it".into(), together);
    }
    effects.iter().for_each(|e| row(e.effect.clone(), &e.held_out));
    let mut text = format!("What {from} taught, in {to}\n\n{}", table_text(&table));
    if let Some(floor_mm) = transfer.noise_floor_mm {
        text.push_str(&format!("\nNoise floor there: {floor_mm:.3} mm.\n"));
    }
    if effects.is_empty() && transfer.left_behind.is_empty() {
        text.push_str("\nNo effect is judged: the pipeline has none, and none was named or suggested.\n");
    }
    for behind in &transfer.left_behind {
        text.push_str(&format!("\nLeft out: {}: {}.\n", behind.effect, behind.reason));
    }
    for warning in &transfer.warnings {
        text.push_str(&format!("\n[{}] {}: {}.\n", warning.code, warning.subject, warning.message));
    }
    text
}
