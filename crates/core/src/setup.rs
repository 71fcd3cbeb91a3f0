//! Mistakes of wiring, files, frames and units: what is checked before any physics.

use crate::warning::{Severity, Stage, Warning};
use crate::{Code, Mend};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How sure a finding is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Certainty {
    /// Worth a look; the result may stand.
    Possible,
    /// With the change, the errors fall as only the right one makes them fall: no physical effect is named beside it.
    Mistake,
}

/// Something about the setup that contradicts the data.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SetupFinding {
    /// What it is.
    pub code: Code,
    /// The joint, stream, frame, board or recording it is about.
    pub subject: String,
    /// What was seen, what the change would do, and where to make it.
    pub message: String,
    /// How sure it is.
    pub certainty: Certainty,
    /// Mean error as the pipeline has it [mm], where the change was tried by a refit.
    pub before_mm: Option<f64>,
    /// Mean error with the change [mm].
    pub after_mm: Option<f64>,
    /// Other changes that these data cannot tell from it.
    pub alternatives: Vec<String>,
    /// Whether an effect that leaves less of the errors takes its place: it estimates numbers, and something remains.
    #[serde(skip)]
    pub gives_way: bool,
    /// What undoes it where the recordings are read; none where no key does.
    #[serde(skip)]
    pub mend: Option<Mend>,
}

impl SetupFinding {
    /// The finding as a warning, so that it reaches every output.
    pub fn warning(&self) -> Warning {
        let severity = match self.certainty {
            Certainty::Possible => Severity::Notice,
            Certainty::Mistake => Severity::Inadequate,
        };
        Warning::new(severity, Stage::Setup, self.code, self.subject.clone(), self.message.clone())
    }
}

/// A mistake that would leave no trace in these data: nobody can say whether it was made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Unseen {
    /// The code that the mistake would have.
    pub code: Code,
    /// What it would be about.
    pub subject: String,
    /// What was tried, and how one can tell.
    pub message: String,
}

impl Unseen {
    /// As a notice, so that it reaches every output.
    pub fn warning(&self) -> Warning {
        Warning::new(
            Severity::Notice,
            Stage::Setup,
            Code::SetupNotTestable,
            self.subject.clone(),
            self.message.clone(),
        )
    }
}

/// What the checks of the setup found.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SetupReport {
    /// Changes of the setup that were tried by a refit; 0 where the errors gave no reason to.
    pub tried: usize,
    /// What contradicts the data, the surest first.
    pub findings: Vec<SetupFinding>,
    /// Mistakes that would leave no trace in these data.
    pub not_testable: Vec<Unseen>,
}

impl SetupReport {
    /// The findings that forbid physical names.
    pub fn mistakes(&self) -> impl Iterator<Item = &SetupFinding> {
        self.findings.iter().filter(|f| f.certainty == Certainty::Mistake)
    }

    /// Whether all that forbids physical names may give way to one that leaves less of the errors.
    pub fn may_give_way(&self) -> bool {
        self.mistakes().next().is_some() && self.mistakes().all(|f| f.gives_way)
    }

    /// Drops changes that were only possible, or give way, where something physical was named that leaves no more of the errors [mm]
    /// than they would: frames and parameters that are let go follow much that is no mistake of the setup.
    pub fn outdone_by(&mut self, physics_mm: f64) {
        let better = |f: &SetupFinding| f.after_mm.is_none_or(|mm| mm < physics_mm);
        let sure = |f: &SetupFinding| f.certainty == Certainty::Mistake && !f.gives_way;
        self.findings.retain(|f| sure(f) || f.before_mm.is_none() || better(f));
    }

    /// Everything that was found, and what could not be, for every output.
    pub fn warnings(&self) -> Vec<Warning> {
        let unseen = self.not_testable.iter().map(Unseen::warning);
        self.findings.iter().map(SetupFinding::warning).chain(unseen).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_only_possible_gives_way_to_physics_that_leaves_no_more() {
        let finding = |certainty, before_mm, after_mm| SetupFinding {
            code: Code::BoardPose,
            subject: "the board".to_owned(),
            message: String::new(),
            certainty,
            before_mm,
            after_mm,
            alternatives: Vec::new(),
            gives_way: false,
            mend: None,
        };
        let possible = finding(Certainty::Possible, Some(0.61), Some(0.19));
        let sure = finding(Certainty::Mistake, Some(0.61), Some(0.19));
        let seen = finding(Certainty::Possible, None, None);
        let findings = vec![sure.clone(), possible.clone(), seen.clone()];
        let report = SetupReport { findings, ..SetupReport::default() };
        let left = |physics_mm| {
            let mut report = report.clone();
            report.outdone_by(physics_mm);
            report.findings
        };
        assert_eq!(left(0.18), [sure.clone(), seen.clone()]);
        assert_eq!(left(0.20), [sure.clone(), possible, seen], "the change leaves less than what was named");
        let estimates = SetupFinding { gives_way: true, ..sure.clone() };
        let with = |findings| SetupReport { findings, ..SetupReport::default() };
        let (mut alone, beside) = (with(vec![estimates.clone()]), with(vec![estimates.clone(), sure]));
        assert!(alone.may_give_way() && !beside.may_give_way() && !with(Vec::new()).may_give_way());
        alone.outdone_by(0.20);
        assert_eq!(alone.findings, [estimates]);
        alone.outdone_by(0.18);
        assert_eq!(alone.findings, []);
    }
}
