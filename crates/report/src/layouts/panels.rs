//! Panels that several tabs use.

use super::spec::{Colour, Content, Kind, Plot, Series};
use crate::channels::curve_topic;
use crate::findings::Findings;
use armcal_core::printable_name;
use armcal_result::proto::ErrorCurve;

// Okabe and Ito's palette, which colour-blind people can tell apart.
pub(super) const BLUE: Colour = Colour { hex: "#0072B2", name: "blue" };
pub(super) const VERMILION: Colour = Colour { hex: "#D55E00", name: "red" };
pub(super) const ORANGE: Colour = Colour { hex: "#E69F00", name: "orange" };
pub(super) const GREEN: Colour = Colour { hex: "#009E73", name: "green" };
pub(super) const PURPLE: Colour = Colour { hex: "#CC79A7", name: "pink" };
pub(super) const GREY: Colour = Colour { hex: "#999999", name: "grey" };
/// Kept for results that must not be relied upon.
pub(super) const RED: Colour = Colour { hex: "#B00020", name: "dark red" };

/// Whether the result stands and what is missing, in one colour: success only where the result stands.
pub(super) fn status_panel() -> Content {
    let rules = vec![
        ("inadequate", RED, "INADEQUATE: read why before you use it"),
        ("data_lost", RED, "DATA LOST: the warnings say which"),
        ("unexplained", RED, "INADEQUATE: errors above the floor, unexplained"),
        ("setup", RED, "INADEQUATE: the setup contradicts the data"),
        ("nothing_missing", GREEN, "ok: nothing is missing that would show"),
        ("identified", BLUE, "ok: the missing effect has a name"),
        ("ambiguous", ORANGE, "ok: an effect is missing, several names fit"),
        ("unknown", ORANGE, "ok: an effect is missing that is not listed"),
        ("not_diagnosed", BLUE, "ok: what is missing was not looked for"),
    ];
    Content::panel("Status", Kind::Indicator("/armcal/story.lamp".into(), rules))
}

pub(super) fn raw_panel(title: &str, path: &str) -> Content {
    Content::panel(title, Kind::Raw(path.into()))
}

pub(super) fn table_panel(title: &str, path: &str) -> Content {
    Content::panel(title, Kind::Table(path.into()))
}

pub(super) fn line_series(path: impl Into<String>, label: impl Into<String>, colour: Colour) -> Series {
    Series { path: path.into(), label: label.into(), colour, line: true }
}

pub(super) fn dot_series(path: impl Into<String>, label: impl Into<String>, colour: Colour) -> Series {
    Series { line: false, ..line_series(path, label, colour) }
}

/// Without the gaps between recordings; without the nominal errors, which dwarf the others.
pub(super) fn over_recorded_time(f: &Findings) -> Content {
    let path = |field: &str| format!("/armcal/course.{field}[:]");
    let mut series = vec![dot_series(path("fitted_mm"), "calibrated", ORANGE)];
    if !f.course.after_mm.is_empty() {
        series.push(dot_series(path("after_mm"), "with effects", GREEN));
    }
    series.push(dot_series(path("expected_mm"), "noise", PURPLE));
    Content::plot("Error", time_plot(path("time_min"), series))
}

/// Those of the nominal model, on a scale of their own.
pub(super) fn nominal_over_recorded_time() -> Content {
    let path = |field: &str| format!("/armcal/course.{field}[:]");
    Content::plot(
        "Nominal error",
        time_plot(path("time_min"), vec![dot_series(path("nominal_mm"), "nominal", GREY)]),
    )
}

/// The falling error, from the nominal model to the one with everything found. A table, and on the first tab: Lichtblick loads its
/// tables when the first one is shown, and one that is first seen on another tab waits for a message that has long been there.
pub(super) fn steps_panel() -> Content {
    table_panel("Error, step by step", "/armcal/steps.steps")
}

/// Errors away from the base: growing lengths climb through zero.
pub(super) fn outward_error_panel(f: &Findings) -> Content {
    let path = |field: &str| format!("/armcal/course.{field}[:]");
    let mut series = vec![dot_series(path("outward_mm"), "calibrated", ORANGE)];
    if !f.course.effect_outward_mm.is_empty() {
        series.push(dot_series(path("effect_outward_mm"), "of effects", GREEN));
    }
    Content::plot("Error outward", time_plot(path("time_min"), series))
}

fn time_plot(x_path: String, series: Vec<Series>) -> Plot {
    let (x_label, y_label) = ("recorded time [min]".into(), "error [mm]".into());
    Plot { x_path, x_label, y_label, y_range: None, beyond: 0, series }
}

/// An error without a name and its band.
pub(super) fn curve_plot(number: usize, ([channel, driver], curve): &([String; 2], ErrorCurve)) -> Content {
    let path = |field: &str| format!("{}.{field}[:]", curve_topic(number));
    let series = vec![
        line_series(path("value"), "error", VERMILION),
        line_series(path("low"), "95 % band", GREY),
        line_series(path("high"), "95 % band", GREY),
    ];
    let unit = |unit: &str| if unit.is_empty() { String::new() } else { format!(" [{unit}]") };
    let plot = Plot {
        x_path: path("at"),
        x_label: format!("{}{}", printable_name(driver), unit(&curve.driver_unit)),
        y_label: format!("error{}", unit(&curve.unit)),
        y_range: None,
        beyond: 0,
        series,
    };
    Content::plot(&format!("Unlisted, {}", printable_name(channel)), plot)
}
