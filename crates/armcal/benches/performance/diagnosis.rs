//! A full diagnosis: catalogue, open set, scans, 999 resamplings, on one core, and the calibration before it.

use crate::page::{Bar, Section, Table, seconds};
use crate::{Options, Result};
use armcal_lab::scenario::{Design, Scenario};
use armcal_score::answer_observed;

const HIDDEN: [&str; 5] = ["nothing", "backlash", "eccentricity", "frame_shift@dwell", "outside:cable_drag"];

pub fn section(_: &Options) -> Result<Section> {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let mut section = Section::new("Diagnosis");
    section.say(
        "Catalogue, open set, scans and 999 resamplings on one core, of simulated sessions that hide what the first column \
         says. The calibration with its five-fold hold-out is what a user waits for before.",
    );
    let mut table =
        Table::new(&["hidden", "design", "dwells", "diagnosis [s]", "calibration [s]", "verdict"]);
    for (design, most_s) in [(Design::ThreeTiltsBothWays, 0.25), (Design::FreePoses, 0.8)] {
        let (mut slowest, mut fastest): ((f64, usize, &str), (f64, &str)) =
            ((0.0, 0, ""), (f64::INFINITY, ""));
        for family in HIDDEN {
            let scenario = Scenario::new(family, design, 1);
            let (answer, _) = one.install(|| answer_observed(&scenario, 1.0))?;
            if answer.seconds > slowest.0 {
                slowest = (answer.seconds, answer.dwells, family);
            }
            if answer.seconds < fastest.0 {
                fastest = (answer.seconds, family);
            }
            table.row([
                family.to_owned(),
                format!("{design:?}"),
                answer.dwells.to_string(),
                seconds(answer.seconds),
                seconds(answer.calibration_seconds),
                format!("{:?}", answer.verdict),
            ]);
        }
        let bar = Bar {
            what: format!("full diagnosis of {} dwells, one core, slowest of {}", slowest.1, HIDDEN.len()),
            limit: format!("<= {most_s} s"),
            measured: format!("{:.2} s", slowest.0),
            met: slowest.0 <= most_s,
        };
        section.bar_of(bar, || {
            let (least_s, least) = fastest;
            format!(
                "what hides `{}` is searched for in several rounds; `{least}` takes {least_s:.2} s",
                slowest.2
            )
        });
    }
    section.table(table);
    Ok(section)
}
