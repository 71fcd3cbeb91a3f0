//! What is shown where: what came out, where it fails, what is missing, whether the data can be trusted.

use super::spec::{Content, Direction, Kind, Plot, Series, View, X};
use crate::channels::{board_map, curve_topic, implied_topic};
use crate::findings::Findings;
use crate::points::Point;
use crate::proto::{ErrorCurve, JointErrors};
use crate::run::Run;
use Direction::{Column, Row};
use armcal_core::robust::percentile;
use nalgebra::Vector3;

// Okabe and Ito's palette, which colour-blind people can tell apart.
const BLUE: &str = "#0072B2";
const VERMILION: &str = "#D55E00";
const ORANGE: &str = "#E69F00";
const GREEN: &str = "#009E73";
const PURPLE: &str = "#CC79A7";
const SKY: &str = "#56B4E9";
const GREY: &str = "#999999";
/// A joint that gravity loads by less than this share of the most loaded one is not drawn over its torque.
const UNLOADED: f64 = 0.05;
/// A joint on which the effects found act by less than this share of the largest is not drawn again.
const MOVED: f64 = 0.3;
/// Nor is one on which they act by less than this many times what is left.
const ABOVE_REST: f64 = 1.5;
/// Steps after the calibration, in their order; the last ones share the last colour.
const STEPS: [&str; 4] = [GREEN, SKY, BLUE, PURPLE];

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
    let scene = Content::panel("Nominal arm grey, calibrated arm green", Kind::View(world(run, points)));
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
    let joints: Vec<Content> = drawn(f).map(|m| Content::even(Row, joint_row(f, m, Split::Error))).collect();
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

fn verdict() -> Content {
    let rules = vec![
        ["nothing_missing", GREEN, "nothing is missing that these data can show"],
        ["identified", BLUE, "the missing effect has a name"],
        ["ambiguous", ORANGE, "an effect is missing; more than one name fits"],
        ["unknown", VERMILION, "an effect is missing that is not listed"],
    ];
    Content::panel("Verdict", Kind::Indicator("/armcal/diagnosis.verdict".into(), rules))
}

fn raw(title: &str, path: &str) -> Content {
    Content::panel(title, Kind::Raw(path.into()))
}

fn table(title: &str, path: &str) -> Content {
    Content::panel(title, Kind::Table(path.into()))
}

fn line(path: impl Into<String>, label: impl Into<String>, colour: &'static str) -> Series {
    Series { path: path.into(), label: label.into(), colour, line: true }
}

fn dots(path: impl Into<String>, label: impl Into<String>, colour: &'static str) -> Series {
    Series { line: false, ..line(path, label, colour) }
}

/// Dwell by dwell in step with the 3D panel; `nominal` dwarfs the others, so it is shown only where asked for.
fn errors_in_time(title: &str, run: &Run, nominal: bool) -> Content {
    let mut series = Vec::new();
    if nominal {
        series.push(dots("/armcal/residuals.nominal_norm_mm", "nominal", GREY));
    }
    series.push(dots("/armcal/residuals.fitted_norm_mm", "calibrated", ORANGE));
    for (k, step) in run.steps.iter().enumerate() {
        let added = step.effects.last().map_or("", String::as_str);
        let colour = STEPS[k.min(STEPS.len() - 1)];
        series.push(dots(format!("/armcal/residuals.step_norm_mm[{k}]"), format!("+ {added}"), colour));
    }
    series.push(dots("/armcal/residuals.expected_norm_mm", "noise alone", PURPLE));
    Content::panel(
        title,
        Kind::Plot(Plot { x: X::Time, y_label: "error [mm]".into(), y_range: None, series }),
    )
}

/// The mean error after each step, without the nominal one, which would hide the others.
fn falling_error(f: &Findings) -> Content {
    let path = |field: &str| format!("/armcal/steps.steps[1:].{field}");
    let series = vec![
        line(path("mean_mm"), "mean error", ORANGE),
        line(f.steps.noise_floor_mm.to_string(), "noise floor", PURPLE),
    ];
    let title = if f.steps.held_out { "Falling error on held-out points" } else { "Falling error" };
    let x = X::Array(path("number"), "1: calibrated; then one effect more each".into());
    let shown = f.steps.steps.iter().skip(1).map(|step| step.mean_mm).chain([f.steps.noise_floor_mm]);
    let y_range = Some([0.0, 1.1 * shown.fold(1e-6, f64::max)]);
    Content::panel(title, Kind::Plot(Plot { x, y_label: "mean error [mm]".into(), y_range, series }))
}

fn over_recorded_time(f: &Findings) -> Content {
    let path = |field: &str| format!("/armcal/course.{field}[:]");
    let mut series = vec![dots(path("fitted_mm"), "calibrated", ORANGE)];
    if !f.course.after_mm.is_empty() {
        series.push(dots(path("after_mm"), "with what was found", GREEN));
    }
    series.push(dots(path("expected_mm"), "noise alone", PURPLE));
    let x = X::Array(path("time_min"), "recorded time [min]".into());
    let plot = Plot { x, y_label: "error [mm]".into(), y_range: None, series };
    Content::panel("Error over recorded time", Kind::Plot(plot))
}

fn outward(title: &str, field: &str, label: &str) -> Content {
    let path = |field: &str| format!("/armcal/course.{field}[:]");
    let series = vec![dots(path(field), label, ORANGE), line("0", "none", GREY)];
    let x = X::Array(path("time_min"), "recorded time [min]".into());
    Content::panel(title, Kind::Plot(Plot { x, y_label: "error [mm]".into(), y_range: None, series }))
}

/// What is drawn of a joint, split by direction of arrival.
#[derive(Clone, Copy)]
enum Split {
    /// Of the calibrated model.
    Error,
    /// With everything found.
    After,
    /// What the effects found do.
    Effect,
}

impl Split {
    /// All directions together, for the scale.
    fn whole(self, m: &JointErrors) -> &[f64] {
        match self {
            Split::Error => &m.error,
            Split::After => &m.error_after,
            Split::Effect => &m.effect,
        }
    }

    fn suffix(self) -> &'static str {
        match self {
            Split::Error => "",
            Split::After => "_after",
            Split::Effect => "_effect",
        }
    }
}

/// The joints that move the tip in at least one dwell.
fn drawn(f: &Findings) -> impl Iterator<Item = &JointErrors> {
    f.joints.iter().filter(|m| !m.reading.is_empty())
}

/// Over its angle and, where gravity loads it, over its torque.
fn joint_row(f: &Findings, m: &JointErrors, split: Split) -> Vec<Content> {
    let what = match split {
        Split::Error => m.joint.clone(),
        Split::After => format!("{}, what is left", m.joint),
        Split::Effect => format!("{}, what the effects do", m.joint),
    };
    let range = common_range(f, m, split);
    let angle =
        joint_plot(m, format!("{what}, over its angle"), ("reading", "reading", &m.unit), split, range);
    let mut row = vec![angle];
    let span = |m: &JointErrors| m.torque_nm.iter().fold(0.0, |most: f64, torque| most.max(torque.abs()));
    let largest = f.joints.iter().map(span).fold(0.0, f64::max);
    if span(m) > UNLOADED * largest {
        let torque = ("torque_nm", "gravity torque", "N m");
        row.push(joint_plot(m, format!("{what}, over its torque"), torque, split, range));
    }
    row
}

/// Implied error by direction of arrival against one of the arrays: field, name and unit.
fn joint_plot(
    m: &JointErrors,
    title: String,
    (x, x_name, x_unit): (&str, &str, &str),
    split: Split,
    y_range: Option<[f64; 2]>,
) -> Content {
    let path = |field: &str| format!("{}.{field}[:]", implied_topic(m.number));
    let arrivals = [
        ("positive", 1, "arrived in +q", BLUE),
        ("negative", -1, "arrived in -q", VERMILION),
        ("unknown", 0, "arrival unknown", GREY),
    ];
    let seen = arrivals.into_iter().filter(|(_, sign, ..)| m.arrival.contains(sign));
    let dots_of = |(field, _, label, colour): (&str, i32, &str, &'static str)| {
        dots(path(&format!("{field}{}", split.suffix())), label, colour)
    };
    let plot = Plot {
        x: X::Array(path(x), format!("{x_name} [{x_unit}]")),
        y_label: format!("implied error [{}]", m.unit),
        y_range,
        series: seen.map(dots_of).collect(),
    };
    Content::panel(title, Kind::Plot(plot))
}

/// The same for all joints of a unit; what is left keeps the scale of what the effects do.
fn common_range(f: &Findings, m: &JointErrors, split: Split) -> Option<[f64; 2]> {
    let scale = if matches!(split, Split::After) { Split::Effect } else { split };
    let same = f.joints.iter().filter(|other| other.unit == m.unit);
    let errors: Vec<f64> = same.flat_map(|m| scale.whole(m)).map(|e| e.abs()).collect();
    let large = 1.3 * percentile(&errors, 0.98);
    (large > 0.0).then_some([-large, large])
}

/// The joints the effects found act on most, each with what they do and what is left.
fn what_effects_do(f: &Findings) -> Vec<Content> {
    let size = |m: &JointErrors, split: Split| {
        percentile(&split.whole(m).iter().map(|e| e.abs()).collect::<Vec<f64>>(), 0.9)
    };
    let effect = |m: &JointErrors| size(m, Split::Effect);
    let largest = |unit: &str| f.joints.iter().filter(|m| m.unit == unit).map(effect).fold(0.0, f64::max);
    let moved = drawn(f)
        .filter(|m| effect(m) >= MOVED * largest(&m.unit) && effect(m) > ABOVE_REST * size(m, Split::After));
    let row = |m: &JointErrors| {
        let mut row = joint_row(f, m, Split::Effect);
        row.push(joint_row(f, m, Split::After).swap_remove(0));
        Content::even(Row, row)
    };
    moved.map(row).collect()
}

fn curve_plot(number: usize, curve: &ErrorCurve) -> Content {
    let path = |field: &str| format!("{}.{field}[:]", curve_topic(number));
    let series = vec![
        line(path("value"), "error", VERMILION),
        line(path("low"), "95 % band", GREY),
        line(path("high"), "95 % band", GREY),
    ];
    let x = X::Array(path("at"), format!("{} [{}]", curve.driver, curve.driver_unit));
    let plot = Plot { x, y_label: format!("error [{}]", curve.unit), y_range: None, series };
    Content::panel(format!("Unlisted error of {} over {}", curve.channel, curve.driver), Kind::Plot(plot))
}

/// The arm and the points it visited.
fn world(run: &Run, points: &[Point]) -> View {
    let places: Vec<Vector3<f64>> =
        points.iter().map(|p| p.measured_m).filter(|m| m.iter().all(|x| x.is_finite())).collect();
    let centre_m = places.iter().sum::<Vector3<f64>>() / places.len().max(1) as f64;
    let base_m = run.model.base_in_world(&run.calibration.fit.values()).translation.vector;
    let mut topics = vec![
        ("/armcal/scene", true),
        ("/armcal/arms", true),
        ("/armcal/arrows_nominal", false),
        ("/armcal/arrows_calibrated", true),
        ("/armcal/board_map", false),
        ("/armcal/path_measured", true),
        ("/armcal/path_nominal", false),
        ("/armcal/path_calibrated", false),
        ("/armcal/tip_measured", true),
    ];
    if !run.steps.is_empty() {
        topics.push(("/armcal/arrows_after", false));
    }
    topics.retain(|(topic, _)| !points.is_empty() || *topic == "/armcal/scene" || *topic == "/armcal/arms");
    let distance_m = (2.5 * (centre_m - base_m).norm()).clamp(0.5, 20.0);
    View { frame: "world", target_m: centre_m.into(), distance_m, from_above: false, topics }
}

fn map(f: &Findings) -> View {
    let (target_m, side_m) = board_map::middle_and_side_m(f);
    let topics = vec![("/armcal/board_map", true), ("/armcal/scene", false), ("/armcal/arms", false)];
    View { frame: board_map::FRAME, target_m, distance_m: 1.3 * side_m, from_above: true, topics }
}
