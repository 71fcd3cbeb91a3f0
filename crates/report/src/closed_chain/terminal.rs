//! The summary of two arms that a person reads in the terminal.

use super::ClosedRun;
use crate::pen::{Pen, TerminalStyle, number};
use crate::run::VERSION;
use crate::story::Story;
use crate::terminal::{Detail, Shown, briefly, ending, errors, listed, parameters, undetermined};
use crate::text::{millimetres, printable};
use comfy_table::Cell;

/// The summary of a run, ending in a newline.
pub fn closed_terminal(run: &ClosedRun, style: TerminalStyle, detail: Detail) -> String {
    let pen = Pen { style };
    let [first, second] = run.chain.arms();
    let joined = match run.chain.link_length_m(&run.chain.nominal()) {
        None => "their tips in one point".to_owned(),
        Some(length_m) => format!("their tips on a rigid link of {} mm", millimetres(length_m)),
    };
    let head = format!(
        "armcal {VERSION}   pipeline {}   {} and {}, {joined}\n",
        printable(&run.pipeline_name),
        printable(&first.name),
        printable(&second.name)
    );
    let calibration = &run.calibration;
    let mut sections = vec![head, pen.section("Recordings", recordings(&pen, run))];
    sections.push(pen.section("Closing errors [mm]", errors(&pen, calibration)));
    let story = Story::of_two_arms(run);
    match detail {
        Detail::Everything => {
            sections.push(pen.section("Parameters", parameters(&pen, calibration)));
            sections.extend(undetermined(&pen, calibration));
            sections.extend(listed(&pen, story.warnings.iter().collect(), 0));
        }
        Detail::Story => sections.extend(briefly(&pen, None, &story)),
    }
    sections.extend(ending(&pen, &story, detail, Shown::USUAL));
    sections.join("\n")
}

fn recordings(pen: &Pen, run: &ClosedRun) -> String {
    let mut table = pen.table(&["recording", "dwells of both", "joined", "open"]);
    for recording in &run.recordings {
        table.add_row(vec![
            Cell::new(printable(&recording.name)),
            number(recording.dwells.len()),
            number(recording.dwells.len() - recording.open.len()),
            number(recording.open.len()),
        ]);
    }
    pen.render(&table)
}
