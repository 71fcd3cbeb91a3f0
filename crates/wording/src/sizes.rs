//! How large effects are, in words: amplitudes with their intervals.

use crate::text::supported_digits;
use armcal_core::{Unit, printable_name};
use armcal_diagnose::{CandidateReport, Combination, FoundEffect, ParameterReport, Term};

/// Its first amplitudes with their intervals.
pub fn candidate_sizes(c: &CandidateReport) -> String {
    let mut shown: Vec<String> = c.parameters.iter().take(3).map(amplitude_text).collect();
    if c.parameters.len() > shown.len() {
        shown.push(format!("and {} more", c.parameters.len() - shown.len()));
    }
    printable_name(&shown.join(", "))
}

/// How many times half its interval an amplitude is; below one it is not determined by itself.
pub fn half_interval_ratio(p: &ParameterReport) -> f64 {
    2.0 * (p.value / (p.ci95[1] - p.ci95[0])).abs()
}

/// The amplitude that the data determine best, for a table, and how many there are beside it.
pub fn size_in_table(parameters: &[ParameterReport]) -> String {
    let best = parameters.iter().max_by(|a, b| half_interval_ratio(a).total_cmp(&half_interval_ratio(b)));
    let Some(p) = best else { return String::new() };
    let unit = p.unit.display_symbol();
    let shown = match half_interval_ratio(p) >= 1.0 {
        true => with_interval(p.unit, p.value, p.ci95),
        false => format!("at most {}", supported_digits(p.unit, p.upper_limit95, p.upper_limit95)),
    };
    // The last part of its name is what it is; the first is in the row already, but in a group for its joint: `width:2`.
    let name = p.name.rsplit('.').next().unwrap_or_default();
    let joint = p
        .name
        .split_once(':')
        .map_or("", |(_, rest)| &rest[..rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len())]);
    let name = if joint.is_empty() { name.to_owned() } else { format!("{name}:{joint}") };
    let more = match parameters.len() - 1 {
        0 => String::new(),
        n => format!(", {n} more"),
    };
    printable_name(format!("{name} {shown} {unit}").trim_end()) + &more
}

/// `width 0.052 ± 0.004 deg`. An interval wider than the value is no size: it says how large the value can be at most.
pub fn amplitude_text(p: &ParameterReport) -> String {
    let half = (p.ci95[1] - p.ci95[0]) / 2.0;
    let symbol = p.unit.display_symbol();
    if half > p.value.abs() {
        let most = supported_digits(p.unit, p.upper_limit95, p.upper_limit95);
        let text = format!("{} not determined by itself (at most {most} {symbol})", p.name);
        return text.replace(" )", ")");
    }
    let text = format!("{} {} {symbol}", p.name, with_interval(p.unit, p.value, p.ci95));
    text.trim_end().to_owned()
}

/// All sizes of a found effect, and what the data determine of those that are not determined by themselves.
pub fn sizes_of(e: &FoundEffect) -> String {
    let sizes: Vec<String> = e.parameters.iter().map(amplitude_text).collect();
    let together =
        e.combination.as_ref().map_or(String::new(), |c| format!("; determined is {}", combination_text(c)));
    format!("{}{together}", sizes.join(", "))
}

/// `joint1 + 0.48 joint2 = 0.052 ± 0.004 deg`; where units differ, each amplitude stands over the unit it is counted in.
fn combination_text(c: &Combination) -> String {
    let mixed = c.terms.iter().any(|t| t.unit != c.unit);
    let term = |(k, t): (usize, &Term)| {
        let weight = c.unit.to_display(t.weight) / t.unit.to_display(1.0);
        let sign = match (k, weight < 0.0) {
            (0, false) => "",
            (0, true) => "-",
            (_, false) => " + ",
            (_, true) => " - ",
        };
        let factor =
            if (weight.abs() - 1.0).abs() < 1e-9 { String::new() } else { format!("{:.3} ", weight.abs()) };
        let symbol = t.unit.display_symbol();
        let over = if mixed && !symbol.is_empty() { format!("/({symbol})") } else { String::new() };
        format!("{sign}{factor}{}{over}", t.name)
    };
    let terms: String = c.terms.iter().enumerate().map(term).collect();
    let symbol = if mixed { "" } else { c.unit.display_symbol() };
    format!("{terms} = {} {symbol}", with_interval(c.unit, c.value, c.ci95)).trim_end().to_owned()
}

/// `0.052 ± 0.004`: a value and half the width of its interval, with the digits that the interval supports.
fn with_interval(unit: Unit, value: f64, ci95: [f64; 2]) -> String {
    let half = (ci95[1] - ci95[0]) / 2.0;
    format!("{} ± {}", supported_digits(unit, value, half), supported_digits(unit, half, half))
}
