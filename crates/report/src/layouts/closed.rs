//! The layout of two arms in a closed chain.

use super::panels::{closing_over_recorded_time, lamp, raw};
use super::spec::{Content, Direction, Kind};
use super::tabs::parameters;
use super::views::both_arms;
use crate::closed_chain::{ClosedRecording, ClosedRun};
use Direction::{Column, Row};

pub(super) fn content(run: &ClosedRun) -> Content {
    let mut tabs = vec![("Overview", overview(run)), ("Parameters", parameters(&run.calibration))];
    let of_recordings = run.recordings.iter().flat_map(ClosedRecording::all_warnings);
    if of_recordings.chain(run.overall_warnings()).next().is_some() {
        tabs.push(("Warnings", raw("Warnings, the gravest first", "/armcal/story.warnings")));
    }
    Content::Tabs(tabs)
}

fn overview(run: &ClosedRun) -> Content {
    let mut right = vec![(1.0, lamp()), (3.2, raw("What came out", "/armcal/story.lines"))];
    if !run.observations.is_empty() {
        right.extend(closing_over_recorded_time().into_iter().map(|plot| (2.2, plot)));
    }
    let title = "Nominal arms grey, calibrated arms green; arrow: closing error";
    let scene = Content::panel(title, Kind::View(both_arms(run)));
    Content::Split(Row, vec![(1.0, scene), (1.0, Content::Split(Column, right))])
}
