//! Panels that several tabs use.

use super::spec::{Content, Kind, Plot, Series, X};
use crate::channels::curve_topic;
use crate::findings::Findings;
use crate::proto::ErrorCurve;
use crate::run::Run;
use crate::text::printable;

// Okabe and Ito's palette, which colour-blind people can tell apart.
pub(super) const BLUE: &str = "#0072B2";
pub(super) const VERMILION: &str = "#D55E00";
pub(super) const ORANGE: &str = "#E69F00";
pub(super) const GREEN: &str = "#009E73";
pub(super) const PURPLE: &str = "#CC79A7";
pub(super) const SKY: &str = "#56B4E9";
pub(super) const GREY: &str = "#999999";
/// Kept for results that must not be relied upon.
pub(super) const RED: &str = "#B00020";
/// Steps after the calibration, in their order; the last ones share the last colour.
const STEPS: [&str; 4] = [GREEN, SKY, BLUE, PURPLE];

pub(super) fn verdict() -> Content {
    let rules = vec![
        ["nothing_missing", GREEN, "nothing is missing that these data can show and that is worth a name"],
        ["identified", BLUE, "the missing effect has a name"],
        ["ambiguous", ORANGE, "an effect is missing; more than one name fits"],
        ["unknown", VERMILION, "an effect is missing that is not listed"],
        ["unexplained", RED, "inadequate: errors above the floor, and nothing explains them"],
        ["setup", RED, "inadequate: the setup contradicts the data; mend it first"],
        ["not_diagnosed", GREY, "what is missing was not looked for"],
    ];
    Content::panel("Verdict", Kind::Indicator("/armcal/diagnosis.verdict".into(), rules))
}

pub(super) fn raw(title: &str, path: &str) -> Content {
    Content::panel(title, Kind::Raw(path.into()))
}

pub(super) fn table(title: &str, path: &str) -> Content {
    Content::panel(title, Kind::Table(path.into()))
}

pub(super) fn line(path: impl Into<String>, label: impl Into<String>, colour: &'static str) -> Series {
    Series { path: path.into(), label: label.into(), colour, line: true }
}

pub(super) fn dots(path: impl Into<String>, label: impl Into<String>, colour: &'static str) -> Series {
    Series { line: false, ..line(path, label, colour) }
}

/// Dwell by dwell in step with the 3D panel; `nominal` dwarfs the others, so it is shown only where asked for.
pub(super) fn errors_in_time(title: &str, run: &Run, nominal: bool) -> Content {
    let mut series = Vec::new();
    if nominal {
        series.push(dots("/armcal/residuals.nominal_norm_mm", "nominal", GREY));
    }
    series.push(dots("/armcal/residuals.fitted_norm_mm", "calibrated", ORANGE));
    for (k, added) in run.step_names().into_iter().enumerate() {
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
pub(super) fn falling_error(f: &Findings) -> Content {
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

/// Without the gaps between recordings.
pub(super) fn over_recorded_time(f: &Findings) -> Content {
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

/// Errors away from the base: growing lengths climb through zero.
pub(super) fn outward(title: &str, field: &str, label: &str) -> Content {
    let path = |field: &str| format!("/armcal/course.{field}[:]");
    let series = vec![dots(path(field), label, ORANGE), line("0", "none", GREY)];
    let x = X::Array(path("time_min"), "recorded time [min]".into());
    Content::panel(title, Kind::Plot(Plot { x, y_label: "error [mm]".into(), y_range: None, series }))
}

/// An error without a name and its band.
pub(super) fn curve_plot(number: usize, curve: &ErrorCurve) -> Content {
    let path = |field: &str| format!("{}.{field}[:]", curve_topic(number));
    let series = vec![
        line(path("value"), "error", VERMILION),
        line(path("low"), "95 % band", GREY),
        line(path("high"), "95 % band", GREY),
    ];
    let unit = |unit: &str| if unit.is_empty() { String::new() } else { format!(" [{unit}]") };
    let x = X::Array(path("at"), format!("{}{}", curve.driver, unit(&curve.driver_unit)));
    let plot = Plot { x, y_label: format!("error{}", unit(&curve.unit)), y_range: None, series };
    let title = format!("Unlisted error of {} over {}", printable(&curve.channel), curve.driver);
    Content::panel(title, Kind::Plot(plot))
}
