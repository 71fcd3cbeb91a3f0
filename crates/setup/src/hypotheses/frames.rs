//! Frames that are not where the pipeline has them, and recordings that do not belong together.

use super::{Freedom, Hypothesis};
use armcal_config::{BoardPose, FramePose};
use armcal_core::Code;
use armcal_stages::Inputs;

const FRAMES: &str = "mend the pose in [frames], or estimate it (pose = \"estimated\")";
const TABLE: &str = "mend [table] (`at`, `markers_on`, the streams), or estimate it (pose = \"estimated\")";
const TARGET: &str = "the tracked point is not the tip that rests in the cavities, or is not tracked as declared: give the offset of \
                      the target in [frames.tip] (`at`), or mend [streams.tip]";
const RECORDINGS: &str =
    "it looks like a recording of another arm or tool: give it a pipeline of its own, with that arm and tool";

pub fn hypotheses(inputs: &Inputs) -> Vec<Hypothesis> {
    let mut all = Vec::new();
    let frames = &inputs.pipeline.frames;
    if frames.base.pose != FramePose::Estimated {
        let change = "the base's pose estimated";
        let free = |i: &mut Inputs| i.pipeline.frames.base.pose = FramePose::Estimated;
        all.push(Hypothesis::new(Code::BaseFrame, "the base", change, FRAMES, free).with(Freedom::Frame));
    }
    if frames.tip.pose != FramePose::Estimated {
        let change = "the tool point estimated";
        let free = |i: &mut Inputs| i.pipeline.frames.tip.pose = FramePose::Estimated;
        all.push(Hypothesis::new(Code::ToolFrame, "the tool", change, FRAMES, free).with(Freedom::Frame));
    }
    if inputs.pipeline.table.as_ref().is_some_and(|t| t.pose != BoardPose::Estimated) {
        let change = "the board's pose estimated";
        let free = |i: &mut Inputs| {
            if let Some(table) = &mut i.pipeline.table {
                table.pose = BoardPose::Estimated;
            }
        };
        all.push(Hypothesis::new(Code::BoardPose, "the board", change, TABLE, free).with(Freedom::Frame));
    }
    let tracked = inputs.dwells().filter(|d| d.tip.is_some()).count();
    if inputs.board.is_some() && tracked > 0 {
        let change = "the tracked point of the tip not used (seated dwells alone)";
        let blind = |i: &mut Inputs| i.each_dwell(|d| d.tip = None);
        all.push(Hypothesis::new(Code::TargetOffset, "the tip", change, TARGET, blind).with(Freedom::Frame));
    }
    if inputs.seen.len() > 1 {
        for (r, seen) in inputs.seen.iter().enumerate() {
            let subject = format!("recording `{}`", seen.name);
            let change = format!("{subject} left out");
            let without = move |i: &mut Inputs| i.seen[r].dwells.clear();
            let hypothesis = Hypothesis::new(Code::RecordingsDisagree, subject, change, RECORDINGS, without);
            all.push(Hypothesis { recording: Some(r), ..hypothesis.with(Freedom::Frame) });
        }
    }
    all
}
