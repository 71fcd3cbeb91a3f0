//! What is shown where: what came out, where it fails, what is missing, whether the data can be trusted.

use super::joints::{What, drawn, over_angle, over_torque, what_effects_do};
use super::panels::{curve_plot, falling_error, lamp, outward, over_recorded_time, raw, table};
use super::spec::{Content, Direction, Kind};
use super::views::{map, world};
use crate::findings::Findings;
use crate::points::Point;
use crate::run::Run;
use Direction::{Column, Row};
use armcal_calibrate::Calibration;

/// Joints of which angle and torque fit side by side in one tab; with more, each has a tab of its own.
const FEW: usize = 3;

pub(super) fn content(run: &Run, points: &[Point], f: &Findings) -> Content {
    let mut tabs = vec![("Overview", overview(run, points, f)), ("Where it fails", where_it_fails(f))];
    tabs.extend(over_torques(f).map(|panels| ("Over torque", panels)));
    if f.diagnosis.as_ref().is_some_and(|(d, c)| !d.effects.is_empty() || !c.candidates.is_empty()) {
        tabs.push(("What is missing", what_is_missing(f)));
    }
    let curves = (1..).zip(&f.curves).map(|(number, curve)| curve_plot(number, curve));
    tabs.extend(grid(curves.collect()).map(|panels| ("Unlisted errors", panels)));
    tabs.extend(numbers(f).map(|panels| ("Numbers", panels)));
    tabs.push(("Parameters", parameters(&run.calibration)));
    tabs.push(("Data quality", data_quality(run, f)));
    Content::Tabs(tabs)
}

/// What came out and what to do, beside the arm.
fn overview(run: &Run, points: &[Point], f: &Findings) -> Content {
    let mut right = vec![
        (1.0, lamp()),
        (4.6, raw("What came out", "/armcal/story.lines")),
        (3.0, over_recorded_time(f, true)),
    ];
    right.extend(falling_error(f).map(|panel| (2.3, panel)));
    let title = "Nominal arm grey, calibrated arm green; arrows: calibrated errors";
    let scene = Content::panel(title, Kind::View(world(run, points, f)));
    Content::Split(Row, vec![(1.0, scene), (1.0, Content::Split(Column, right))])
}

/// One plot a joint, all on one scale, so that the joint that errs stands out.
fn where_it_fails(f: &Findings) -> Content {
    let mut left = Vec::new();
    if !f.boards.is_empty() {
        left.push((3.0, Content::panel("Errors on the boards, from above", Kind::View(map(f)))));
    }
    left.push((2.0, over_recorded_time(f, false)));
    left.push((2.0, outward(f)));
    let left = Content::Split(Column, left);
    let joints = match drawn(f).count() {
        n if n > FEW => grid(drawn(f).map(|m| over_angle(f, m, What::Error)).collect()),
        _ => {
            let row = |m| {
                let torque = over_torque(f, m, What::Error);
                Content::even(Row, std::iter::once(over_angle(f, m, What::Error)).chain(torque).collect())
            };
            let rows: Vec<Content> = drawn(f).map(row).collect();
            (!rows.is_empty()).then(|| Content::even(Column, rows))
        }
    };
    match joints {
        Some(joints) => Content::Split(Row, vec![(2.0, left), (3.0, joints)]),
        None => left,
    }
}

/// Where [`where_it_fails`] has no room for it.
fn over_torques(f: &Findings) -> Option<Content> {
    let many = drawn(f).count() > FEW;
    grid(drawn(f).filter(|_| many).filter_map(|m| over_torque(f, m, What::Error)).collect())
}

/// Two columns, one where there are few; none without panels.
fn grid(panels: Vec<Content>) -> Option<Content> {
    let across = if panels.len() > 2 { 2 } else { 1 };
    let mut panels = panels.into_iter().peekable();
    let mut rows = Vec::new();
    while panels.peek().is_some() {
        rows.push(Content::even(Row, panels.by_ref().take(across).collect()));
    }
    (!rows.is_empty()).then(|| Content::even(Column, rows))
}

/// The answer in words and tables, beside pictures of what is not on other tabs already.
fn what_is_missing(f: &Findings) -> Content {
    let some = |n: usize, share: f64, panel: Content| (n > 0).then_some((share, panel));
    let next = f.diagnosis.as_ref().map_or(0, |(d, _)| d.record_next.len());
    let (found, candidates) = (f.effects.found.len(), f.effects.candidates.len());
    let answer = [
        Some((2.0, raw("The answer", "/armcal/diagnosis.sentence"))),
        some(found, 2.4, table("What was found", "/armcal/effect_table.found")),
        some(
            candidates,
            4.6,
            table("Candidates, each on its own, best first", "/armcal/effect_table.candidates"),
        ),
        some(next, 2.6, raw("What to record next", "/armcal/diagnosis.record_next")),
    ];
    let answer = Content::Split(Column, answer.into_iter().flatten().collect());
    let mut pictures = vec![(1.0, over_recorded_time(f, false))];
    // An event shows over time; a joint may follow it, but has no part in it.
    let lasting = f.diagnosis.iter().flat_map(|(d, _)| &d.effects).any(|e| !e.effect.contains('@'));
    match what_effects_do(f).filter(|_| lasting) {
        Some(joints) => pictures.push((3.0, joints)),
        None => pictures.extend(falling_error(f).map(|panel| (1.0, panel))),
    }
    match found {
        0 => answer,
        _ => Content::Split(Row, vec![(1.0, answer), (1.0, Content::Split(Column, pictures))]),
    }
}

/// The numbers behind the answer; none where nothing was diagnosed.
fn numbers(f: &Findings) -> Option<Content> {
    let (d, _) = f.diagnosis.as_ref()?;
    let mut panels = vec![(2.0, table("Step by step", "/armcal/steps.steps"))];
    if !d.explanations.is_empty() {
        panels.push((3.5, raw("The numbers, one by one", "/armcal/diagnosis.told")));
    }
    if !d.not_testable.is_empty() {
        panels.push((2.0, table("What these data could not have shown", "/armcal/diagnosis.not_testable")));
    }
    Some(Content::Split(Column, panels))
}

pub(super) fn parameters(calibration: &Calibration) -> Content {
    let mut panels = vec![(4.0, table("Parameters, old and new", "/armcal/parameter_table.rows"))];
    if !calibration.fit.undetermined.is_empty() {
        panels.push((2.5, raw("What the data do not determine", "/armcal/parameters.undetermined")));
    }
    Content::Split(Column, panels)
}

fn data_quality(run: &Run, f: &Findings) -> Content {
    let mut panels = vec![(2.0, table("Recordings and their clocks", "/armcal/quality.recordings"))];
    if !f.quality.rejected.is_empty() {
        panels.push((2.0, table("Dwells that were not used", "/armcal/quality.rejected")));
    }
    if f.quality.recordings.iter().any(|r| r.warnings > 0) || !run.overall_warnings().is_empty() {
        panels.push((3.0, raw("Warnings, the gravest first", "/armcal/story.warnings")));
    }
    Content::Split(Column, panels)
}
