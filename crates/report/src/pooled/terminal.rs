//! The summary of a pool that a person reads in the terminal.

use super::PooledRun;
use crate::pen::{Pen, TerminalStyle, number};
use crate::run::VERSION;
use crate::story::Story;
use crate::terminal::{Detail, Shown, ending, errors, listed, parameters_of, undetermined};
use crate::text::{millimetres, printable};
use armcal_calibrate::Estimate;
use comfy_table::Cell;

/// Recordings, and parameters of single recordings, that are listed; `pool.json` has all.
const MOST_ROWS: usize = 40;

/// The summary of a pool, ending in a newline.
pub fn pooled_terminal(run: &PooledRun, style: TerminalStyle) -> String {
    let pen = Pen { style };
    let head = format!(
        "armcal {VERSION}   pipeline {}   {} recordings of one arm\n",
        printable(&run.pipeline_name),
        run.recordings.len()
    );
    let mut sections = vec![head, pen.section("Recordings, mean error [mm]", recordings(&pen, run))];
    sections.push(pen.section("Position errors [mm]", errors(&pen, &run.calibration)));
    let shared = run.shared();
    let estimates = run.calibration.fit.estimates.iter().zip(&shared);
    let of = |is_shared: bool| -> Vec<&Estimate> {
        estimates.clone().filter(|(_, shared)| **shared == is_shared).map(|(e, _)| e).collect()
    };
    sections.push(pen.section("Shared parameters", parameters_of(&pen, &of(true))));
    let own = of(false);
    if !own.is_empty() {
        let mut text = parameters_of(&pen, &own[..own.len().min(MOST_ROWS)]);
        text += &more(own.len());
        sections.push(pen.section("Parameters of single recordings", text));
    }
    sections.extend(undetermined(&pen, &run.calibration));
    let story = Story::of_pool(run);
    sections.extend(listed(&pen, story.warnings.iter().collect(), 0));
    sections.extend(ending(&pen, &story, Detail::Everything, Shown::USUAL));
    sections.join("\n")
}

fn recordings(pen: &Pen, run: &PooledRun) -> String {
    let mut table = pen.table(&["recording", "dwells", "rejected", "nominal", "calibrated", "as a new day"]);
    for (recording, errors) in run.recordings.iter().zip(run.errors()).take(MOST_ROWS) {
        let unseen = errors.unseen.map_or("-".into(), |unseen| millimetres(unseen.mean_m));
        table.add_row(vec![
            Cell::new(printable(&recording.name)),
            number(recording.dwells),
            number(recording.rejected),
            number(millimetres(errors.nominal.mean_m)),
            number(millimetres(errors.calibrated.mean_m)),
            number(unseen),
        ]);
    }
    pen.render(&table) + &more(run.recordings.len())
}

fn more(count: usize) -> String {
    match count.saturating_sub(MOST_ROWS) {
        0 => String::new(),
        hidden => format!(" {hidden} more are in pool.json.\n"),
    }
}
