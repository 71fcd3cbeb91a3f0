//! `summary.json`: [`Summary`], told.

use crate::ReportError;
use armcal_diagnose::{BeforeAfter, CandidateReport, Diagnosis, ParameterReport, UnknownReport};
use armcal_result::by_marker::by_marker;
use armcal_result::summary::{
    AmplitudeSummary, CandidateSummary, DiagnosisSummary, FitSummary, FrameEntry, JointSummary,
    RecordingSummary, RefitSummary, SCHEMA, Summary, UnlistedSummary,
};
use armcal_result::{ResultError, Run, TwoArms, VERSION};
use armcal_wording::{answer, conclusion, explanations, unlisted_toml};

/// The summary of a run: indented JSON with a final newline.
///
/// # Errors
/// A recording that cannot be read once more for its hash.
pub fn summary_json(run: &Run) -> Result<String, ReportError> {
    let text = serde_json::to_string_pretty(&run_summary(run)?);
    Ok(text.map_err(ReportError::Page)? + "\n")
}

fn run_summary(run: &Run) -> Result<Summary<'_>, ResultError> {
    let answer = answer(run);
    let recordings = run.recordings.iter().map(|r| RecordingSummary::of(run, r));
    Ok(Summary {
        schema: SCHEMA,
        version: VERSION,
        pipeline: &run.pipeline_name,
        status: run.status(),
        joined: TwoArms::of(run),
        recordings: recordings.collect::<Result<_, _>>()?,
        fit: FitSummary::of(run),
        markers: by_marker(run),
        joints: JointSummary::all(run),
        frames: FrameEntry::all(run),
        refits: run.refits().map(RefitSummary::from).collect(),
        setup: &run.setup,
        answer: answer.word,
        answer_sentence: answer.sentence,
        diagnosis: run.diagnosis.as_ref().map(diagnosis_summary),
        conclusion: conclusion(&run.calibration),
        warnings: run.overall_warnings(),
    })
}

fn diagnosis_summary(d: &Diagnosis) -> DiagnosisSummary<'_> {
    DiagnosisSummary {
        verdict: d.verdict,
        names: &d.names,
        probability: d.probability,
        p_adjusted: d.p_adjusted,
        candidates: d.candidates.iter().map(candidate_summary).collect(),
        unknown: d.unknown.as_ref().map(unlisted_summary),
        unlisted: d.unlisted.iter().map(unlisted_summary).collect(),
        cannot_tell_apart: &d.cannot_tell_apart,
        not_testable: &d.not_testable,
        record_next: &d.record_next,
        p_nothing: d.p_nothing,
        holdout_mm: d.holdout_mm,
        floor_mm: d.floor_mm,
        repeatability_mm: d.repeatability_mm,
        judged: d.judged,
        unexplained: d.unexplained.as_ref(),
        sigma_ratio: d.noise.sigma_ratio,
        effects: &d.effects,
        explanations: explanations(d),
        nested: d.nested.as_ref(),
    }
}

fn candidate_summary(c: &CandidateReport) -> CandidateSummary<'_> {
    // One-step estimate of an amplitude.
    let amplitude = |p: &ParameterReport| AmplitudeSummary { value: p.value, ci95: p.ci95, unit: p.unit };
    CandidateSummary {
        effect: &c.effect,
        target: &c.target,
        spec: &c.spec,
        parameters: c.parameters.iter().map(|p| (p.name.as_str(), amplitude(p))).collect(),
        behind_nats: c.standing.map(|s| s.behind_nats),
        behind_se: c.standing.map(|s| s.behind_se),
        probability: c.standing.map(|s| s.probability),
        in_answer: c.standing.is_some_and(|s| s.in_answer),
        p_adjusted: c.p_adjusted,
        holdout_mm: c.holdout_mm,
        same_to_the_data: &c.same_to_the_data,
        absorbed: c.absorbed,
        smallest_seen: c.smallest_seen,
    }
}

fn unlisted_summary(u: &UnknownReport) -> UnlistedSummary<'_> {
    let expression = u.expression.as_ref();
    UnlistedSummary {
        channel: u.channel.to_string(),
        driver: u.driver.to_string(),
        expression: expression.map_or("", |e| &e.formula),
        acts_on: expression.map(|e| e.acts_on.as_str()),
        table: unlisted_toml(u),
        probability: u.probability,
        holdout_mm: BeforeAfter { before: u.places.before, after: u.places.after },
        unit: u.unit,
        shape: &u.shape,
        ripple: u.ripple.as_ref(),
        rivals: &u.rivals,
    }
}
