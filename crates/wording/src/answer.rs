//! What a run says about its model in one word and one sentence: the same in every output.

use crate::headline::headline;
use crate::hunting::hunting_sentence;
use armcal_core::{Certainty, SetupReport, printable_name};
use armcal_diagnose::Verdict;
use armcal_result::{Run, Undiagnosed};

/// What a run says about its model in one word and one sentence.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Answer {
    /// A verdict as `summary.json` spells it; `setup`, where the setup contradicts the data; `not_diagnosed`.
    pub word: &'static str,
    /// The sentence.
    pub sentence: String,
}

/// What the run says about its model: the same in every output.
pub fn answer(run: &Run) -> Answer {
    if let Some(sentence) = setup_sentence(&run.setup) {
        return Answer { word: "setup", sentence: run.in_words(&sentence) };
    }
    if let Some(diagnosis) = &run.diagnosis {
        let beside = setup_beside(&run.setup).map(|beside| run.in_words(&beside));
        let scattered = diagnosis.unexplained.as_ref().filter(|_| diagnosis.verdict == Verdict::Unexplained);
        let hunting = scattered.and_then(|left| hunting_sentence(run, left.error_mm));
        let sentence = [headline(&run.called(), diagnosis)].into_iter().chain(hunting).chain(beside);
        let sentence = sentence.collect::<Vec<_>>().join(" ");
        return Answer { word: diagnosis.verdict.word(), sentence };
    }
    let sentence = match run.undiagnosed {
        Some(Undiagnosed::Failed) => "The diagnosis could not be made; the warnings say why.".to_owned(),
        Some(Undiagnosed::SetupFirst) => {
            "The setup comes first; what is missing was not looked for.".to_owned()
        }
        Some(Undiagnosed::TooFewDwells) => {
            "Record more dwells: with fewer equations than free parameters what is missing cannot be looked for.".to_owned()
        }
        Some(Undiagnosed::TooLarge { free, most }) => format!(
            "What is missing was not looked for: that search works on all free parameters at once, here {free}, and {most} \
             are the most; pool fewer recordings for it."
        ),
        Some(Undiagnosed::NotAsked) | None => {
            "What is missing was not looked for ([diagnosis] enabled = false).".to_owned()
        }
    };
    Answer { word: "not_diagnosed", sentence }
}

/// The mistakes of the setup in one sentence; none where there is none.
fn setup_sentence(setup: &SetupReport) -> Option<String> {
    let messages: Vec<&str> = setup.mistakes().map(|f| f.message.as_str()).collect();
    (!messages.is_empty()).then(|| printable_name(&format!("Setup first: {}.", messages.join("; also, "))))
}

/// The change of the setup that leaves less of the error than what is named physically, in one sentence.
fn setup_beside(setup: &SetupReport) -> Option<String> {
    let tried =
        setup.findings.iter().find(|f| f.certainty == Certainty::Possible && f.before_mm.is_some())?;
    Some(printable_name(&format!("Or the setup: {}.", tried.message)))
}
