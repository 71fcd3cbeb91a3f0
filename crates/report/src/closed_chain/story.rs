//! What a run of two arms comes to, and what to do next.

use super::{ClosedRecording, ClosedRun};
use crate::run::Status;
use crate::story::Story;
use crate::terminal::summarised;
use crate::text::{conclusion_about, printable};
use crate::told_warning::ToldWarning;
use armcal_calibrate::INADEQUATE;

/// How the words for a direction begin in which both arms grow together.
const SCALE: &str = "scale (every length";

impl Story {
    /// Of two arms. Nothing is looked for beyond their geometry, so nothing is said about what is missing.
    pub fn of_two_arms(run: &ClosedRun) -> Story {
        let calibration = conclusion_about(&run.calibration, "closing error");
        let known = summarised(&run.calibration).map(|said| format!("{said}."));
        Story::undiagnosed(calibration, known.into_iter().collect(), run.status(), next(run), warnings(run))
    }
}

fn warnings(run: &ClosedRun) -> Vec<ToldWarning> {
    let names = run.recording_names();
    let of = |r: &ClosedRecording| -> Vec<ToldWarning> {
        r.all_warnings().into_iter().map(|w| ToldWarning::new(&names, Some(&r.name), w)).collect()
    };
    let overall = run.overall_warnings().into_iter().map(|w| ToldWarning::new(&names, None, w));
    run.recordings.iter().flat_map(of).chain(overall).collect()
}

fn next(run: &ClosedRun) -> Vec<String> {
    let steps: Vec<String> = [effect(run), scale(run)].into_iter().flatten().collect();
    if steps.is_empty() && run.status() == Status::Ok {
        let [first, second] = run.chain.arms();
        let (first, second) = (printable(&first.name), printable(&second.name));
        return vec![format!(
            "a recording of either arm at a board (`armcal run`) shows what {first} and {second} have in common"
        )];
    }
    steps
}

/// Where more is missing than geometry.
fn effect(run: &ClosedRun) -> Option<String> {
    let times = run.calibration.left_over();
    (times.is_finite() && times > INADEQUATE).then(|| {
        format!(
            "closing errors are {times:.1} times the noise floor: look whether the tips stay joined as `[closed_chain]` says; if they do, \
             an effect is missing, and `armcal run` of each arm at a board names it"
        )
    })
}

/// Where both arms may grow together.
fn scale(run: &ClosedRun) -> Option<String> {
    let open = run.calibration.fit.undetermined.iter().any(|u| u.text.contains(SCALE));
    open.then(|| {
        "the size of both arms together is not determined: join the tips by a link of known length (`kind = \"rigid-link\"`), or \
         measure where a base stands (`base = { pose = \"measured\" }`)"
            .to_owned()
    })
}
