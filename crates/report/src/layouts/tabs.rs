//! What is shown where: what came out, where it fails, what is missing, whether the data can be trusted.

use super::joints::{What, drawn, joint_row, what_effects_do};
use super::panels::{
    curve_plot, errors_in_time, falling_error, outward, over_recorded_time, raw, table, verdict,
};
use super::spec::{Content, Direction, Kind};
use super::views::{map, world};
use crate::findings::Findings;
use crate::points::Point;
use crate::run::Run;
use Direction::{Column, Row};

pub(super) fn content(run: &Run, points: &[Point], f: &Findings) -> Content {
    let mut tabs = vec![("Overview", overview(run, points, f)), ("Where it fails", where_it_fails(f))];
    if f.diagnosis.is_some() {
        tabs.push(("What is missing", what_is_missing(run, f)));
    }
    tabs.push(("Parameters", parameters()));
    tabs.push(("Data quality", data_quality()));
    Content::Tabs(tabs)
}

fn overview(run: &Run, points: &[Point], f: &Findings) -> Content {
    let mut right = Vec::new();
    if f.diagnosis.is_some() {
        right.push((1.0, verdict()));
        right.push((1.5, raw("What is missing", "/armcal/diagnosis.sentence")));
    }
    right.push((1.5, raw("What the calibration reached", "/armcal/report.conclusion")));
    right.push((4.0, errors_in_time("Error at each dwell, before and after", run, true)));
    right.push((3.0, falling_error(f)));
    let scene = Content::panel("Nominal arm grey, calibrated arm green", Kind::View(world(run, points, f)));
    Content::Split(Row, vec![(3.0, scene), (2.0, Content::Split(Column, right))])
}

/// One row a joint: over its angle, where play and eccentricity show, and over its torque, where compliance does. All on
/// one scale, so that the joint that errs stands out.
fn where_it_fails(f: &Findings) -> Content {
    let mut left = Vec::new();
    if !f.boards.is_empty() {
        left.push((3.0, Content::panel("Errors on the boards, from above", Kind::View(map(f)))));
    }
    left.push((2.0, over_recorded_time(f)));
    left.push((2.0, outward("Error away from the base over recorded time", "outward_mm", "calibrated")));
    let joints: Vec<Content> = drawn(f).map(|m| Content::even(Row, joint_row(f, m, What::Error))).collect();
    let left = Content::Split(Column, left);
    if joints.is_empty() {
        return left;
    }
    Content::Split(Row, vec![(2.0, left), (3.0, Content::even(Column, joints))])
}

fn what_is_missing(run: &Run, f: &Findings) -> Content {
    let answer = Content::Split(
        Column,
        vec![
            (1.0, verdict()),
            (2.0, raw("The answer", "/armcal/diagnosis.sentence")),
            (3.0, table("What was found", "/armcal/diagnosis.effects[:]")),
            (4.0, table("Candidates, each on its own, best first", "/armcal/candidates.candidates[:]")),
            (3.0, table("The numbers, one by one", "/armcal/diagnosis.explanations[:]")),
            (2.0, raw("What to record next", "/armcal/diagnosis.record_next")),
            (2.0, table("What these data could not have shown", "/armcal/diagnosis.not_testable[:]")),
        ],
    );
    let mut pictures = vec![
        Content::even(Row, vec![falling_error(f), table("Steps", "/armcal/steps.steps[:]")]),
        errors_in_time("Error at each dwell, step by step", run, false),
    ];
    pictures.extend((1..).zip(&f.curves).map(|(number, curve)| curve_plot(number, curve)));
    if !run.steps.is_empty() {
        pictures.extend(what_effects_do(f));
        let title = "What the effects do away from the base, over recorded time";
        pictures.push(outward(title, "effect_outward_mm", "effects found, and what is left"));
    }
    Content::Split(Row, vec![(1.0, answer), (1.0, Content::even(Column, pictures))])
}

fn parameters() -> Content {
    let all = table("Parameters, old and new", "/armcal/parameters.parameters[:]");
    let undetermined = raw("What the data do not determine", "/armcal/parameters.undetermined");
    Content::Split(Column, vec![(4.0, all), (1.0, undetermined)])
}

fn data_quality() -> Content {
    let states = vec![["/armcal/assignments.recording", "recording"], ["/armcal/assignments.used", "used"]];
    Content::Split(
        Column,
        vec![
            (2.0, table("Recordings and their clocks", "/armcal/quality.recordings[:]")),
            (2.0, table("Dwells that were not used", "/armcal/quality.rejected[:]")),
            (1.0, Content::panel("Dwells used, over time", Kind::States(states))),
            (3.0, Content::panel("What happened", Kind::Log("/armcal/log"))),
        ],
    )
}
