//! Clocks whose relation the pipeline declares: taken as declared, and compared with the motion.

use armcal_core::{Code, JointSamples, PoseSamples, Severity, Warning};

use super::warnings::clock_warning;
use super::{NominalArm, SIGMA_FLOOR_S, estimate_alignment};
use crate::config::Declared;
use crate::series::seconds_between;
use crate::{ClockAlignment, ClockConfig, DwellError};

/// The motion contradicts beyond this many standard errors of the alignment ...
const CONTRADICTION_SIGMAS: f64 = 4.0;
/// ... and this much [s].
const CONTRADICTION_S: f64 = 2e-3;

/// The declared relation, and whether the motion agrees: `clock-contradicted`, `clock-unchecked`.
pub(super) fn align(
    joints: &JointSamples,
    tip: &PoseSamples,
    arm: &dyn NominalArm,
    config: &ClockConfig,
    declared: Declared,
) -> Result<(ClockAlignment, Vec<Warning>), DwellError> {
    let (first_ns, last_ns) = (tip.time_ns[0], tip.time_ns[tip.len() - 1]);
    let mut alignment = ClockAlignment {
        offset_s: declared.offset_s,
        offset_sigma_s: SIGMA_FLOOR_S,
        drift: declared.drift,
        drift_sigma: SIGMA_FLOOR_S / seconds_between(first_ns, last_ns).max(1.0),
        reference_ns: first_ns,
        first_ns,
        correlation: f64::NAN,
        displacement_ratio: f64::NAN,
        declared: true,
    };
    let search = ClockConfig {
        initial_offset_s: declared.offset_s,
        known: None,
        offset_ms: None,
        drift_ppm: None,
        ..config.clone()
    };
    let unchecked = |why: &DwellError| {
        let message = format!("offset and drift are taken as declared; the motion cannot check them: {why}");
        clock_warning(Severity::Notice, Code::ClockUnchecked, message)
    };
    match estimate_alignment(joints, tip, arm, &search) {
        Ok((found, said)) => {
            alignment.correlation = found.correlation;
            alignment.displacement_ratio = found.displacement_ratio;
            // What is said of an estimate that is not used is no matter.
            let about_the_data =
                |w: &Warning| [Code::ClockDisplacementRatio, Code::ClockNotLinear].contains(&w.code);
            let mut warnings: Vec<Warning> = said.into_iter().filter(about_the_data).collect();
            warnings.extend(contradiction_warning(&alignment, &found, first_ns, last_ns));
            Ok((alignment, warnings))
        }
        Err(
            why @ (DwellError::NoMotion { .. }
            | DwellError::Broken { .. }
            | DwellError::RarelyTogether { .. }),
        ) => {
            let warning = unchecked(&why);
            Ok((alignment, vec![warning]))
        }
        Err(why @ (DwellError::CorrelationTooLow { .. } | DwellError::OffsetAtEdge { .. })) => {
            let message = format!(
                "the motion does not agree with the declared offset of {:+.1} ms: {why}; check clock.known, \
                 clock.offset_ms and which stamps the streams use",
                declared.offset_s * 1e3
            );
            Ok((alignment, vec![clock_warning(Severity::Inadequate, Code::ClockContradicted, message)]))
        }
        Err(why) => Err(why),
    }
}

/// Whether what was found differs from what was declared, at the middle, the beginning or the end.
fn contradiction_warning(
    declared: &ClockAlignment,
    found: &ClockAlignment,
    first_ns: i64,
    last_ns: i64,
) -> Option<Warning> {
    let apart = |at_ns: i64| {
        let offset_s = |c: &ClockAlignment| seconds_between(c.to_robot_ns(at_ns), at_ns);
        let by_s = offset_s(found) - offset_s(declared);
        (at_ns, by_s, by_s.abs() / found.sigma_s(at_ns))
    };
    let (at_ns, by_s, _) = [found.reference_ns, first_ns, last_ns]
        .map(apart)
        .into_iter()
        .filter(|a| a.2 > CONTRADICTION_SIGMAS && a.1.abs() > CONTRADICTION_S)
        .max_by(|a, b| a.2.total_cmp(&b.2))?;
    let offset_ms = |c: &ClockAlignment| seconds_between(c.to_robot_ns(at_ns), at_ns) * 1e3;
    let message = format!(
        "the motion contradicts the declared clock: {:.0} s after the start the sensor's stamps are {:+.1} ± {:.1} ms late, \
         {:+.1} ms by declaration ({:+.1} ms apart); check clock.known, clock.offset_ms, clock.drift_ppm and which stamps \
         the streams use",
        seconds_between(first_ns, at_ns),
        offset_ms(found),
        found.sigma_s(at_ns) * 1e3,
        offset_ms(declared),
        by_s * 1e3,
    );
    Some(clock_warning(Severity::Inadequate, Code::ClockContradicted, message))
}
