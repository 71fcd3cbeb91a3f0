//! From evidence to criteria: what a recording supports is computed with as many cycles as there are, what it does
//! not support is listed with the reason.

mod cycles;
mod moves;
mod paths;
mod poses;

use crate::IsoError;
use crate::catalogue::EXCHANGEABILITY;
use crate::criterion::{Assessment, Findings};
use crate::evidence::{Evidence, Settings};

/// Computes every criterion of ISO 9283:1998 that `evidence` supports.
///
/// Fails where the evidence is wrong in itself ([`Evidence::check`]); what is merely missing is a reason in the
/// result.
pub fn assess(evidence: &Evidence, settings: &Settings) -> Result<Assessment, IsoError> {
    evidence.check()?;
    let mut findings = Findings::default();
    let cycles = cycles::by_direction(&evidence.visits, settings.same_direction_rad);
    poses::assess(&cycles, &mut findings);
    poses::assess_directions(&cycles, &mut findings);
    moves::assess(&evidence.visits, &cycles, settings, &mut findings);
    for path in &evidence.paths {
        paths::assess(path, settings, &mut findings)?;
    }
    findings.lack(&EXCHANGEABILITY, "one recorded robot", EXCHANGEABILITY.needs);
    Ok(findings.finish(general_notes(cycles::by_pose(&cycles).len())))
}

/// Poses that the standard asks for, P1 to P5.
const POSES: usize = 5;

/// What the evidence cannot prove about the test as a whole.
fn general_notes(poses: usize) -> Vec<String> {
    let few = (1..POSES).contains(&poses).then(|| format!("{poses} commanded poses instead of {POSES}"));
    let unknown = "the standard asks for poses and paths in the largest cube within the most used part of the \
                   working space, at rated load and velocity: not checked here";
    few.into_iter().chain([unknown.to_owned()]).collect()
}
