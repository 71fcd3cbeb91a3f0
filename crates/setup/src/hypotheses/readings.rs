//! What instruments read: in which unit, and in which direction.

use super::Hypothesis;
use armcal_core::Code;
use armcal_stages::Inputs;

const READING: &str = "mend `reading` of the [[measure]], its unit or its direction";

pub fn hypotheses(inputs: &Inputs) -> Vec<Hypothesis> {
    let mut all = Vec::new();
    for measure in inputs.pipeline.measures().into_iter().filter(|m| m.reading_m.is_some()) {
        let subject = format!("the readings of {}", measure.name);
        for (factor, code, words) in [
            (1e3, Code::ReadingUnit, "a thousand times as large (metres read as millimetres)"),
            (1e-3, Code::ReadingUnit, "a thousandth (micrometres read as millimetres)"),
            (25.4, Code::ReadingUnit, "25.4 times as large (inches read as millimetres)"),
            (-1.0, Code::ReadingSign, "reversed"),
        ] {
            let (name, change) = (measure.name.clone(), format!("the readings of {} {words}", measure.name));
            all.push(Hypothesis::new(code, subject.clone(), change, READING, move |i: &mut Inputs| {
                i.each_dwell(|dwell| {
                    if let Some(read) = dwell.gauges.get_mut(&name) {
                        (read.mean_m, read.sigma_m) = (read.mean_m * factor, read.sigma_m * factor.abs());
                    }
                });
            }));
        }
    }
    all
}
