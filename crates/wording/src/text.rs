//! How numbers and names are written for people.

use armcal_calibrate::{Calibration, Estimate, SideErrors};
use armcal_core::Unit;
use armcal_core::units::format_mm;

/// The result in one sentence, about held-out points where there are any.
pub fn conclusion(calibration: &Calibration) -> String {
    conclusion_about(calibration, "error")
}

/// The same about errors of another name.
pub fn conclusion_about(calibration: &Calibration, error: &str) -> String {
    let floor = match calibration.noise_floor_m {
        floor if floor.is_finite() => format!("; the declared noise gives {} mm.", format_mm(floor)),
        _ => ".".into(),
    };
    let points = |side: &SideErrors| match side.fitted.n {
        1 => "1 point".to_owned(),
        n => format!("{n} points"),
    };
    if calibration.held_out() {
        let side = &calibration.holdout;
        let held_out = points(side).replacen(' ', " held-out ", 1);
        return format!("On {held_out} the mean {error} {}{floor}", error_change_text(side));
    }
    if calibration.train.fitted.n > 0 {
        let side = &calibration.train;
        return format!(
            "Nothing was held out: on the {} the fit saw, the mean {error} {}{floor}",
            points(side),
            error_change_text(side)
        );
    }
    "No observation took part, so there is no error to state.".into()
}

/// "falls from 21.30 to 0.31 mm (98.5 %)".
fn error_change_text(side: &SideErrors) -> String {
    let (before_m, after_m) = (side.nominal.mean_m, side.fitted.mean_m);
    if !(before_m.is_finite() && after_m.is_finite()) {
        return "is not a number".into();
    }
    let (before, after) = (format_mm(before_m), format_mm(after_m));
    let percent = 100.0 * (before_m - after_m) / before_m;
    match before_m.total_cmp(&after_m) {
        std::cmp::Ordering::Greater => format!("falls from {before} to {after} mm ({percent:.1} %)"),
        std::cmp::Ordering::Less if before_m > 0.0 => {
            format!("rises from {before} to {after} mm ({:.1} % worse)", -percent)
        }
        std::cmp::Ordering::Less => format!("rises from {before} to {after} mm"),
        std::cmp::Ordering::Equal => format!("stays at {after} mm"),
    }
}

/// What four decimals show at least.
const SMALLEST_SHOWN: f64 = 5e-5;

/// An SI value in the unit shown to people, without the symbol.
pub fn in_display_unit(unit: Unit, si: f64) -> String {
    let shown = unit.to_display(si);
    if !shown.is_finite() {
        return "-".into();
    }
    match shown.abs() {
        a if a != 0.0 && a < SMALLEST_SHOWN => format!("{shown:.1e}"),
        a if a >= 1e5 => format!("{shown:.3e}"),
        _ => format!("{shown:.4}"),
    }
}

/// An estimate in the unit shown to people: nominal value, value, change, half the width of the 95 % interval.
pub fn estimate_shown(e: &Estimate) -> [String; 4] {
    let half = (e.ci95[1] - e.ci95[0]) / 2.0;
    [e.parameter.nominal, e.value, e.value - e.parameter.nominal, half]
        .map(|si| supported_digits(e.parameter.unit, si, half))
}

/// An SI value in the unit shown to people, with the digits that half the width of its interval supports: two of its own.
pub fn supported_digits(unit: Unit, si: f64, half_si: f64) -> String {
    let (shown, exponent) = (unit.to_display(si), unit.to_display(half_si).abs().log10().floor());
    // Below five places, and where there is no interval, the usual way.
    if !(shown.is_finite() && exponent.is_finite() && exponent >= -4.0) {
        return in_display_unit(unit, si);
    }
    let places = usize::try_from(1 - exponent as i64).unwrap_or(0);
    let text = format!("{shown:.places$}");
    // Minus nothing is nothing.
    match text.strip_prefix('-') {
        Some(digits) if digits.chars().all(|c| c == '0' || c == '.') => digits.to_owned(),
        _ => text,
    }
}

/// What is to be known of an estimate beside its numbers.
pub fn estimate_remark(e: &Estimate) -> &'static str {
    match (e.determined, e.at_bound) {
        (true, false) => "",
        (true, true) => "at bound",
        (false, false) => "undetermined",
        (false, true) => "undetermined, at bound",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use armcal_core::ErrorStats;

    fn side(n: usize, before_m: f64, after_m: f64) -> SideErrors {
        let stats = |mean_m| ErrorStats { n, mean_m, ..ErrorStats::default() };
        SideErrors { nominal: stats(before_m), fitted: stats(after_m) }
    }

    #[test]
    fn a_change_is_called_by_its_direction() {
        assert_eq!(error_change_text(&side(3, 0.0213, 0.00031)), "falls from 21.30 to 0.31 mm (98.5 %)");
        assert_eq!(error_change_text(&side(3, 0.001, 0.0015)), "rises from 1.00 to 1.50 mm (50.0 % worse)");
        assert_eq!(error_change_text(&side(3, 0.001, 0.001)), "stays at 1.00 mm");
        assert_eq!(error_change_text(&side(3, 0.0, 0.001)), "rises from 0.00 to 1.00 mm");
        assert_eq!(error_change_text(&side(3, f64::NAN, 0.001)), "is not a number");
    }

    #[test]
    fn numbers_have_the_digits_that_their_interval_supports() {
        let mm =
            |si, half| [supported_digits(Unit::Metre, si, half), supported_digits(Unit::Metre, half, half)];
        assert_eq!(mm(0.074_074, 0.000_588), ["74.07", "0.59"]);
        assert_eq!(mm(0.074_074, 0.0123), ["74", "12"]);
        assert_eq!(mm(-1e-6, 0.000_588), ["0.00", "0.59"]);
        assert_eq!(mm(0.5, f64::NAN), ["500.0000", "-"]);
        assert_eq!(mm(0.5, 1e-9), ["500.0000", "1.0e-6"]);
    }
}
