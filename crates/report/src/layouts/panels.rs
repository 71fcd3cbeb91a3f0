//! Panels that several tabs use.

use super::spec::{Colour, Content, Kind, Plot, Series};
use crate::channels::curve_topic;
use crate::findings::Findings;
use armcal_core::printable;
use armcal_result::proto::ErrorCurve;
use armcal_wording::{channel_told, driver_told};

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
pub(super) fn lamp() -> Content {
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

pub(super) fn raw(title: &str, path: &str) -> Content {
    Content::panel(title, Kind::Raw(path.into()))
}

pub(super) fn table(title: &str, path: &str) -> Content {
    Content::panel(title, Kind::Table(path.into()))
}

pub(super) fn line(path: impl Into<String>, label: impl Into<String>, colour: Colour) -> Series {
    Series { path: path.into(), label: label.into(), colour, line: true }
}

pub(super) fn dots(path: impl Into<String>, label: impl Into<String>, colour: Colour) -> Series {
    Series { line: false, ..line(path, label, colour) }
}

/// Without the gaps between recordings; without the nominal errors, which dwarf the others.
pub(super) fn over_recorded_time(f: &Findings) -> Content {
    let path = |field: &str| format!("/armcal/course.{field}[:]");
    let mut series = vec![dots(path("fitted_mm"), "calibrated", ORANGE)];
    if !f.course.after_mm.is_empty() {
        series.push(dots(path("after_mm"), "with effects", GREEN));
    }
    series.push(dots(path("expected_mm"), "noise", PURPLE));
    Content::plot("Error", course(path("time_min"), series))
}

/// Those of the nominal model, on a scale of their own.
pub(super) fn nominal_over_recorded_time() -> Content {
    let path = |field: &str| format!("/armcal/course.{field}[:]");
    Content::plot("Nominal error", course(path("time_min"), vec![dots(path("nominal_mm"), "nominal", GREY)]))
}

/// The falling error, from the nominal model to the one with everything found. A table, and on the first tab: Lichtblick loads its
/// tables when the first one is shown, and one that is first seen on another tab waits for a message that has long been there.
pub(super) fn steps() -> Content {
    table("Error, step by step", "/armcal/steps.steps")
}

/// Errors away from the base: growing lengths climb through zero.
pub(super) fn outward(f: &Findings) -> Content {
    let path = |field: &str| format!("/armcal/course.{field}[:]");
    let mut series = vec![dots(path("outward_mm"), "calibrated", ORANGE)];
    if !f.course.effect_outward_mm.is_empty() {
        series.push(dots(path("effect_outward_mm"), "of effects", GREEN));
    }
    Content::plot("Error outward", course(path("time_min"), series))
}

fn course(x_path: String, series: Vec<Series>) -> Plot {
    let (x_label, y_label) = ("recorded time [min]".into(), "error [mm]".into());
    Plot { x_path, x_label, y_label, y_range: None, beyond: 0, series }
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
    let plot = Plot {
        x_path: path("at"),
        x_label: format!("{}{}", printable(&driver_told(&curve.driver)), unit(&curve.driver_unit)),
        y_label: format!("error{}", unit(&curve.unit)),
        y_range: None,
        beyond: 0,
        series,
    };
    Content::plot(&format!("Unlisted, {}", printable(&channel_told(&curve.channel))), plot)
}
