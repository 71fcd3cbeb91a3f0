//! What was found, at the beginning of the run (of the recording, where it is about one).

use super::facts::proto_time;
use super::{Messages, run_start_ns, start_ns};
use crate::findings::Findings;
use crate::viewer_text::for_viewer;
use armcal_result::Run;
use armcal_result::proto;
use armcal_wording::{Story, ToldWarning};

pub(super) fn put(run: &Run, f: &Findings, out: &mut Messages) {
    let begin_ns = run_start_ns(run);
    let stamp = || proto_time(begin_ns);
    out.put("/armcal/story", begin_ns, &outcome_message(&Story::of(run), begin_ns));
    for joint in &f.joints {
        let topic = implied_topic(joint.number);
        out.put(topic, begin_ns, &proto::JointErrors { timestamp: stamp(), ..joint.clone() });
    }
    for board in &f.boards {
        let start_ns = start_ns(&run.recordings[board.recording_index as usize]);
        let message = proto::BoardErrors { timestamp: proto_time(start_ns), ..board.clone() };
        out.put(board_topic(board.recording_index), start_ns, &message);
    }
    out.put("/armcal/course", begin_ns, &proto::Course { timestamp: stamp(), ..f.course.clone() });
    out.put("/armcal/steps", begin_ns, &proto::Steps { timestamp: stamp(), ..f.steps.clone() });
    if let Some((diagnosis, candidates)) = &f.diagnosis {
        let diagnosis = proto::Diagnosis { timestamp: stamp(), ..diagnosis.clone() };
        out.put("/armcal/diagnosis", begin_ns, &diagnosis);
        let candidates = proto::Candidates { timestamp: stamp(), ..candidates.clone() };
        out.put("/armcal/candidates", begin_ns, &candidates);
        let effects = proto::EffectTable { timestamp: stamp(), ..f.effects.clone() };
        out.put("/armcal/effect_table", begin_ns, &effects);
    }
    for (number, (_, curve)) in (1..).zip(&f.curves) {
        let message = proto::ErrorCurve { timestamp: stamp(), ..curve.clone() };
        out.put(curve_topic(number), begin_ns, &message);
    }
    out.put("/armcal/quality", begin_ns, &proto::Quality { timestamp: stamp(), ..f.quality.clone() });
}

pub(super) fn outcome_message(s: &Story, time_ns: i64) -> proto::Story {
    proto::Story {
        timestamp: proto_time(time_ns),
        lamp: s.lamp.into(),
        lines: for_viewer(s.lines()),
        warnings: for_viewer(s.warnings.iter().map(ToldWarning::line)),
        next: for_viewer(s.next.iter().cloned()),
        found: for_viewer(s.found.iter().cloned()),
    }
}

/// Topic of what is implied about a joint, by its number from 1.
pub(crate) fn implied_topic(number: u32) -> String {
    format!("/armcal/implied/joint{number}")
}

/// Topic of the errors on the board of a recording, by its index.
pub(crate) fn board_topic(recording_index: u32) -> String {
    format!("/armcal/board/{recording_index}")
}

/// Topic of an unlisted error, by its number from 1.
pub(crate) fn curve_topic(number: usize) -> String {
    format!("/armcal/unlisted/{number}")
}
