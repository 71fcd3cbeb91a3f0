//! Time of a full diagnosis: catalogue, open set, scans, 999 resamplings, on one core.
//!
//! `cargo bench -p armcal --bench diagnosis`. The bar is a second for 198 dwells. The calibration of the same
//! observations, timed beside it, is what a user waits for anyway.

#![allow(clippy::print_stdout, reason = "a bench prints its numbers")]

use armcal::score::quick;
use armcal_lab::scenario::{Design, Scenario};

fn main() -> Result<(), armcal::Error> {
    // One core, whatever the machine has.
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let Ok(one) = one else { return Ok(()) };
    println!(
        "{:<14} {:<22} {:>7} {:>14} {:>16}  verdict",
        "hidden", "design", "dwells", "diagnosis [s]", "calibration [s]"
    );
    for design in [Design::ThreeTiltsBothWays, Design::FreePoses] {
        for family in ["nothing", "backlash", "eccentricity", "frame_shift@dwell", "outside:cable_drag"] {
            let scenario = Scenario::new(family, design, 1);
            let (answer, _) = one.install(|| quick(&scenario))?;
            println!(
                "{family:<14} {:<22} {:>7} {:>14.3} {:>16.3}  {:?}",
                format!("{design:?}"),
                answer.dwells,
                answer.seconds,
                answer.calibration_seconds,
                answer.verdict
            );
        }
    }
    Ok(())
}
