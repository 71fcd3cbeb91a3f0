//! What is shown where: what came out, where it fails, what is missing, whether the data can be trusted.

use super::drawn::{What, tip_moving_joints};
use super::joints::{over_angle, over_torque, what_effects_do};
use super::panels::{
    curve_plot, nominal_over_recorded_time, outward_error_panel, over_recorded_time, raw_panel, status_panel,
    steps_panel, table_panel,
};
use super::spec::{Content, Direction, Kind};
use super::views::{board_map_view, world_view};
use crate::findings::Findings;
use Direction::{Column, Row};
use armcal_calibrate::Calibration;
use armcal_result::{Point, Run};

/// Joints of which angle and torque fit side by side in one tab; with more, each has a tab of its own.
const FEW: usize = 3;
/// Unlisted errors that are drawn beside the answer; more have a tab of their own, and the first is drawn there too.
const CURVES: usize = 2;

pub(super) fn all_tabs(run: &Run, points: &[Point], f: &Findings) -> Content {
    let mut tabs = vec![("Overview", overview(run, points, f)), ("Where it fails", where_it_fails(f))];
    tabs.extend(over_torques(f).map(|panels| ("Over torque", panels)));
    if f.diagnosis.as_ref().is_some_and(|(d, c)| !d.effects.is_empty() || !c.candidates.is_empty()) {
        tabs.push(("Missing", what_is_missing(f)));
    }
    if f.curves.len() > CURVES {
        tabs.extend(panel_grid(curve_panels(f, f.curves.len())).map(|panels| ("Unlisted", panels)));
    }
    tabs.extend(answer_numbers(f).map(|panels| ("Numbers", panels)));
    tabs.push(("Parameters", parameter_panels(&run.calibration)));
    tabs.push(("Data quality", data_quality(run, f)));
    Content::Tabs(tabs)
}

fn curve_panels(f: &Findings, most: usize) -> Vec<Content> {
    (1..).zip(f.curves.iter().take(most)).map(|(number, curve)| curve_plot(number, curve)).collect()
}

/// What came out and what to do, beside the arm.
fn overview(run: &Run, points: &[Point], f: &Findings) -> Content {
    let title = "Nominal arm grey, calibrated arm green; arrows: calibrated errors";
    let scene = Content::panel(title, Kind::View(world_view(run, points, f)));
    let left = Content::Split(Column, vec![(3.0, scene), (1.0, steps_panel())]);
    let errors = vec![(1.0, nominal_over_recorded_time()), (2.0, over_recorded_time(f))];
    let right = vec![
        (1.2, status_panel()),
        (5.8, raw_panel("What came out", "/armcal/story.lines")),
        (3.0, Content::Split(Row, errors)),
    ];
    Content::Split(Row, vec![(1.0, left), (1.0, Content::Split(Column, right))])
}

/// One plot a joint, all on one scale, so that the joint that errs stands out.
fn where_it_fails(f: &Findings) -> Content {
    // The error over time is on the first tab too, and the map is the larger without it.
    let above = match f.boards.is_empty() {
        true => (1.0, over_recorded_time(f)),
        false => (2.2, Content::panel("Errors on the boards, from above", Kind::View(board_map_view(f)))),
    };
    let left = vec![above, (1.0, outward_error_panel(f))];
    let left = Content::Split(Column, left);
    let joints = match tip_moving_joints(f).count() {
        n if n > FEW => panel_grid(tip_moving_joints(f).map(|m| over_angle(f, m, What::Error)).collect()),
        _ => {
            let row = |m| {
                let torque = over_torque(f, m, What::Error);
                Content::even(Row, std::iter::once(over_angle(f, m, What::Error)).chain(torque).collect())
            };
            let rows: Vec<Content> = tip_moving_joints(f).map(row).collect();
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
    let many = tip_moving_joints(f).count() > FEW;
    panel_grid(tip_moving_joints(f).filter(|_| many).filter_map(|m| over_torque(f, m, What::Error)).collect())
}

/// Two columns, one where there are few; none without panels.
fn panel_grid(panels: Vec<Content>) -> Option<Content> {
    let across = if panels.len() > 2 { 2 } else { 1 };
    let mut panels = panels.into_iter().peekable();
    let mut rows = Vec::new();
    while panels.peek().is_some() {
        rows.push(Content::even(Row, panels.by_ref().take(across).collect()));
    }
    (!rows.is_empty()).then(|| Content::even(Column, rows))
}

/// The answer in words and tables, beside pictures of it.
fn what_is_missing(f: &Findings) -> Content {
    let some = |n: usize, share: f64, panel: Content| (n > 0).then_some((share, panel));
    let (found, candidates) = (f.effects.found.len(), f.effects.candidates.len());
    let answer = [
        Some((1.6, raw_panel("The answer", "/armcal/diagnosis.sentence"))),
        some(found, 2.4, table_panel("What was found", "/armcal/effect_table.found")),
        some(
            candidates,
            4.2,
            table_panel("Candidates, each on its own, best first", "/armcal/effect_table.candidates"),
        ),
        some(f.next, 2.4, raw_panel("What to do next", "/armcal/story.next")),
    ];
    let answer = Content::Split(Column, answer.into_iter().flatten().collect());
    let pictures = finding_panels(f);
    match found > 0 && !pictures.is_empty() {
        true => Content::Split(Row, vec![(1.0, answer), (1.0, Content::Split(Column, pictures))]),
        false => answer,
    }
}

/// What was found: what is unlisted over what it depends on, what lasts by the joints, what happened by the time.
fn finding_panels(f: &Findings) -> Vec<(f64, Content)> {
    let named = || f.diagnosis.iter().flat_map(|(d, _)| &d.effects);
    let most = if f.curves.len() > CURVES { 1 } else { CURVES };
    let mut pictures: Vec<(f64, Content)> =
        curve_panels(f, most).into_iter().map(|curve| (1.0, curve)).collect();
    // An event shows over time; a joint may follow it, but has no part in it.
    if named().any(|e| !e.effect.contains('@')) {
        let of_load = named().any(|e| e.effect.contains("compliance") || e.effect.contains("windup"));
        pictures.extend(what_effects_do(f, of_load).map(|joints| (2.0, joints)));
    }
    if pictures.is_empty() || named().any(|e| e.effect.contains('@')) {
        pictures.push((1.0, over_recorded_time(f)));
    }
    pictures
}

/// The numbers behind the answer; none where nothing was diagnosed.
fn answer_numbers(f: &Findings) -> Option<Content> {
    let (d, _) = f.diagnosis.as_ref()?;
    let mut panels = Vec::new();
    if f.told_found > 0 {
        panels.push((2.0, raw_panel("What was found, in full", "/armcal/story.found")));
    }
    panels.push((3.5, raw_panel("The numbers, one by one", "/armcal/diagnosis.told")));
    if !d.not_testable.is_empty() {
        panels.push((
            2.5,
            table_panel("What these data could not have shown", "/armcal/diagnosis.not_testable"),
        ));
    }
    Some(Content::Split(Column, panels))
}

pub(super) fn parameter_panels(calibration: &Calibration) -> Content {
    let mut panels = vec![(4.0, table_panel("Parameters, old and new", "/armcal/parameter_table.rows"))];
    if !calibration.fit.undetermined.is_empty() {
        panels.push((2.5, raw_panel("What the data do not determine", "/armcal/parameters.undetermined")));
    }
    Content::Split(Column, panels)
}

fn data_quality(run: &Run, f: &Findings) -> Content {
    let mut panels = vec![(2.0, table_panel("Recordings and their clocks", "/armcal/quality.recordings"))];
    if !f.quality.rejected.is_empty() {
        panels.push((2.0, table_panel("Dwells that were not used", "/armcal/quality.rejected")));
    }
    if f.quality.recordings.iter().any(|r| r.warnings > 0) || !run.overall_warnings().is_empty() {
        panels.push((3.0, raw_panel("Warnings, the gravest first", "/armcal/story.warnings")));
    }
    Content::Split(Column, panels)
}
