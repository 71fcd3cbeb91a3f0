//! What a change would do, in words.

use super::beyond;
use super::hypotheses::{Estimated, Hypothesis, Mending, bounded_amplitude};
use super::spread::spread_m;
use super::trial::Misfit;
use super::weigh::{SAME_FACTOR, in_doubt};
use armcal_calibrate::{Calibration, Estimate};
use armcal_core::units::format_mm;
use armcal_core::{Certainty, Code, Mend, SetupFinding};
use armcal_model::{EffectSpec, EffectTable};
use armcal_recording::Streams;
use armcal_stages::{Fitted, Inputs};
use std::collections::BTreeMap;

/// The effect that scales what the sensor sees along each axis.
const SENSOR_SCALE: &str = "sensor_scale";
/// How far it may come out from where the search ended.
const SCALE_BOUND: f64 = 0.05;
/// Parameters of a change that are told, at most.
const TOLD: usize = 3;

/// A side of what is told: the full calibration where there is one, and the trial.
pub struct Side<'a> {
    /// The full calibration.
    pub fitted: Option<&'a Fitted>,
    /// The trial.
    pub trial: Misfit,
}

impl Side<'_> {
    /// Mean error by which it is judged [m].
    fn mean_m(&self) -> f64 {
        self.fitted.map_or(self.trial.mean_m, |f| f.calibration.judged().fitted.mean_m)
    }

    /// How far what was measured spreads [m].
    fn spread_m(&self) -> f64 {
        self.fitted.map_or(self.trial.spread_m, |f| spread_m(&f.observations))
    }
}

/// What changes do, in a clause; none where they improve nothing that is judged.
pub fn describe_gain(before: &Side<'_>, after: &Side<'_>) -> Option<String> {
    let (begun, ended, after_m) = (&before.trial, &after.trial, after.mean_m());
    let Some(fitted) = before.fitted else {
        let mean = format_mm(after_m);
        return Some(match begun.used {
            0 => format!("{} dwells find their place, with a mean error of {mean} mm", ended.used),
            _ => format!("the mean error is {mean} mm"),
        });
    };
    let held_out = if fitted.calibration.held_out() { "held-out " } else { "" };
    let seats = || {
        (ended.seated > begun.seated).then(|| {
            let (n, instead, mean) = (ended.seated, begun.seated, format_mm(after_m));
            format!(
                "{n} instead of {instead} dwells sit in a cavity, and their mean {held_out}error is {mean} mm"
            )
        })
    };
    describe_error_reduction([before.mean_m(), after_m], [before.spread_m(), after.spread_m()], held_out)
        .or_else(seats)
}

/// That the error fell, by more than rounding, against the spread of what was measured.
fn describe_error_reduction(
    [before_m, after_m]: [f64; 2],
    spreads_m: [f64; 2],
    held_out: &str,
) -> Option<String> {
    // The errors after, as they would be if the data were as large as before.
    let alike_m = after_m * spreads_m[0] / spreads_m[1];
    let [was, is, would_be] = [before_m, after_m, alike_m].map(format_mm);
    let fell = before_m > SAME_FACTOR * alike_m && was != would_be;
    fell.then(|| match after_m < before_m && was != is {
        true => format!("the mean {held_out}error falls from {was} to {is} mm"),
        false => {
            let [from, to] = spreads_m.map(format_mm);
            format!(
                "the mean {held_out}error is {is} mm of positions that spread by {to} mm, instead of {was} of {from} mm"
            )
        }
    })
}

/// A change that explains the errors, as it is reported; `together` is everything that was found, and `gain` what that does.
pub fn setup_finding(
    h: &Hypothesis,
    (together, gain): (&str, &str),
    alternatives: &[String],
    moved: Option<String>,
    (before, after): (&Side<'_>, &Side<'_>),
    streams: &Streams,
) -> SetupFinding {
    let or = match alternatives.is_empty() {
        true => String::new(),
        false => format!(" (these data cannot tell it from: {})", armcal_core::list_names(alternatives)),
    };
    let ends = moved
        .unwrap_or_else(|| after.fitted.map_or(String::new(), |f| describe_estimates(h, &f.calibration)));
    let mend = mending_keys(h, after);
    let keys = mend.as_ref().and_then(|mend| streams.mending_keys(mend));
    let undone = keys.map_or(String::new(), |keys| format!("; until then, {keys} undoes it"));
    SetupFinding {
        code: h.code,
        subject: h.subject.clone(),
        message: format!("with {together}{or} {gain}{ends}; {}{undone}", h.remedy),
        certainty: Certainty::Mistake,
        before_mm: before.fitted.map(|_| before.mean_m() * 1e3),
        after_mm: Some(after.mean_m() * 1e3),
        alternatives: alternatives.to_vec(),
        gives_way: h.of_the_model() && in_doubt(&after.trial),
        mend,
    }
}

/// The keys that make a change; the zero of a joint is where its parameter came out.
fn mending_keys(h: &Hypothesis, after: &Side<'_>) -> Option<Mend> {
    match h.mending.as_ref()? {
        Mending::Keys(mend) => Some(mend.clone()),
        Mending::Zeros { of, known: (factors, zeros_rad) } => {
            let estimates = &after.fitted?.calibration.fit.estimates;
            let mut zeros_rad = zeros_rad.clone();
            for (joint, parameter, sign) in of {
                let e = estimates.iter().find(|e| e.parameter.name == *parameter)?;
                zeros_rad[*joint] += sign * (e.value - e.parameter.nominal);
            }
            Some(Mend::Readings { factors: factors.clone(), zeros_rad })
        }
    }
}

/// Where the parameters of a change come out, the furthest first.
fn describe_estimates(h: &Hypothesis, c: &Calibration) -> String {
    let of = |own: &Estimated| {
        let e = c.fit.estimates.iter().find(|e| e.parameter.name == own.parameter)?;
        let (unit, off) = (e.parameter.unit, e.value - own.nominal);
        let symbol = unit.display_symbol();
        let gap = if symbol.is_empty() { "" } else { " " };
        let words = format!("{} is off by {:+.3}{gap}{symbol}", own.parameter, unit.to_display(off));
        (off.abs() > own.far).then_some((off.abs() / own.far, words))
    };
    let mut words: Vec<(f64, String)> = h.estimated.iter().filter_map(of).collect();
    words.sort_by(|a, b| b.0.total_cmp(&a.0));
    let words: Vec<String> = words.into_iter().take(TOLD).map(|w| w.1).collect();
    if words.is_empty() { String::new() } else { format!(" ({})", words.join(", ")) }
}

/// How far the frame that a change estimates moves, in words.
pub fn moved_frame(now: &Inputs, h: &Hypothesis, from: &Fitted, to: &Fitted) -> Option<String> {
    let (m, rad) = beyond::frame_displacement(now, h.code, from, to)?;
    Some(format!(
        " ({} moved by {} mm and turned by {:.2} deg from where it was taken to be)",
        h.subject,
        format_mm(m),
        rad.to_degrees()
    ))
}

/// The scale of the sensor with its standard error, estimated beside the arm where the change has brought it near.
pub fn scale_with_interval(mended: &Inputs, h: &Hypothesis) -> Option<String> {
    let near = h.number.as_ref().filter(|_| h.code == Code::PositionScale)?.value;
    let mut with = mended.clone();
    let free = ["x", "y", "z"].map(|axis| (axis.to_owned(), bounded_amplitude(SCALE_BOUND)));
    let spec = EffectSpec { overrides: BTreeMap::from(free), ..EffectSpec::new(SENSOR_SCALE) };
    with.pipeline.effects.push(EffectTable::from(&spec));
    let fitted = with.fit().ok()?;
    let own = |e: &&Estimate| e.parameter.name.starts_with(SENSOR_SCALE);
    let axes: Vec<(f64, f64)> =
        fitted.calibration.fit.estimates.iter().filter(own).map(|e| (e.value, e.sigma)).collect();
    let mean = |of: fn(&(f64, f64)) -> f64| axes.iter().map(of).sum::<f64>() / axes.len() as f64;
    let scale = near / (1.0 + mean(|axis| axis.0));
    // What is taken of the arm moves it more than noise does: by how far the two ways to estimate it differ.
    let sigma = (near * mean(|axis| axis.1)).hypot(scale - near);
    let ends = scale.is_finite() && sigma.is_finite();
    ends.then(|| format!(" (estimated beside the arm: {scale:.4} ± {sigma:.4})"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_falls_only_by_more_than_rounding_and_by_the_spread_of_the_data() {
        let told = |errors_mm: [f64; 2], spreads_m| {
            describe_error_reduction(errors_mm.map(|mm| mm * 1e-3), spreads_m, "held-out ")
        };
        let same = [0.5, 0.5];
        assert_eq!(
            told([353.01, 0.13], same).expect("it falls"),
            "the mean held-out error falls from 353.01 to 0.13 mm"
        );
        assert_eq!(told([0.134, 0.126], same), None, "0.13 to 0.13 mm");
        assert_eq!(told([100.0, 96.0], same), None, "less than a twentieth");
        assert_eq!(told([0.13, 0.14], same), None);
        // Positions read as millimetres.
        assert_eq!(told([1.58, 0.064], [0.5, 0.5e-3]), None);
        let grown = told([0.064, 1.58], [0.5e-3, 0.5]).expect("it falls");
        assert_eq!(
            grown,
            "the mean held-out error is 1.58 mm of positions that spread by 500.00 mm, instead of 0.064 of 0.50 mm"
        );
    }
}
