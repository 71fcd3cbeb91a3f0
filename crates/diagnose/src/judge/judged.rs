//! What speaks for or against a name, and how far it can be trusted.

use crate::config::DiagnosisConfig;
use crate::judge::bootstrap::Significance;
use crate::judge::contrasts::Contrast;
use crate::judge::score::{Difference, Score};
use crate::problem::projection::Gram;
use armcal_calibrate::HeldOut;

/// Everything that speaks for or against naming one entry.
#[derive(Debug, Clone)]
pub(crate) struct Judged {
    /// Index of the entry.
    pub entry: usize,
    /// Significance of every entry.
    pub significance: Vec<Significance>,
    /// Score with it in the linearised model, and by how much it is more than that of nothing.
    pub score: Score,
    pub gain: Difference,
    /// What it must gain [nats]: the margin for each of its amplitudes.
    pub cost_nats: f64,
    /// Errors on places the fit did not see.
    pub places: HeldOut,
    /// Errors on recordings it did not see, where there are several.
    pub recordings: Option<HeldOut>,
    /// The best that is not listed.
    pub unlisted: Option<Unlisted>,
    /// Paired contrast, where the design has one.
    pub contrast: Option<Contrast>,
    /// Amplitudes that are negative and cannot be.
    pub impossible: Vec<String>,
    /// Products of its columns.
    pub gram: Gram,
}

/// What is not listed, beside a name.
#[derive(Debug, Clone)]
pub(crate) struct Unlisted {
    /// Its score in the linearised model, and by how much it is more than that of the name.
    pub score: Score,
    pub above: Difference,
    /// Cosine between its fitted shape and the nearest one of the name.
    pub cosine: f64,
}

impl Judged {
    /// Its own significance.
    pub fn own(&self) -> Significance {
        self.significance[self.entry]
    }

    /// Real and not chance: gate and score agree. Says nothing about its name.
    pub fn real(&self, config: &DiagnosisConfig) -> bool {
        self.own().p_adjusted <= config.max_p_adjusted && self.predicts(config)
    }

    /// Worth trying in the model. The gate waits until the other effects are there too: what they leave behind looks
    /// like correlated noise, under which no single effect stands out.
    pub fn promising(&self, config: &DiagnosisConfig) -> bool {
        self.own().p_raw <= config.max_p_heldout && self.predicts(config)
    }

    /// Whether it says more than nothing of dwells that the fit did not see: clearly over the groups, or, as an event of a few
    /// dwells does, in places that are few but agree.
    fn predicts(&self, config: &DiagnosisConfig) -> bool {
        let in_few = self.gain.nats >= self.cost_nats.max(self.gain.se);
        match self.gain.is_clear(self.cost_nats) {
            true => self.places.p < config.max_p_heldout,
            false => in_few && self.places.p <= config.max_p_adjusted,
        }
    }

    /// The best that is not listed and has another shape.
    fn other_shape(&self, config: &DiagnosisConfig) -> Option<&Unlisted> {
        self.unlisted.as_ref().filter(|u| u.cosine <= config.merge_cosine)
    }

    /// Whether what is not listed is clearly better.
    pub fn is_refuted(&self, config: &DiagnosisConfig) -> bool {
        self.other_shape(config).is_some_and(|u| u.above.is_clear(self.detail(config)))
    }

    /// Takes the score of its refit in place of that of one step, beside nothing and the unlisted.
    pub fn refitted(&mut self, score: Score, nothing: &Score) {
        self.gain = score.above(nothing);
        if let Some(unlisted) = &mut self.unlisted {
            unlisted.above = unlisted.score.above(&score);
        }
        self.score = score;
    }

    /// How far the name can be trusted.
    pub fn grade(&self, config: &DiagnosisConfig) -> Grade {
        if !self.real(config) || self.is_refuted(config) {
            return Grade::Refused;
        }
        // An unlisted shape has more freedom: only what says more is another answer.
        let as_good = self.other_shape(config).is_some_and(|u| u.above.nats > 0.0);
        let disagrees = self.contrast.as_ref().is_some_and(|c| !c.agrees);
        if as_good || disagrees || !self.impossible.is_empty() { Grade::OrUnlisted } else { Grade::Named }
    }

    /// Score that is no more than the detail of a shape: masses, radii and stiffnesses are never quite those of a formula, so that
    /// a small share of what there is to explain goes to whatever happens to have the detail [nats].
    pub fn detail(&self, config: &DiagnosisConfig) -> f64 {
        config.leftover_share * self.gain.nats
    }
}

/// How far a name can be trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Grade {
    /// Not real, or something unlisted is more probable.
    Refused,
    /// Real and listed, but something unlisted cannot be excluded, pairs of visits disagree, or it is negative where it cannot
    /// be.
    OrUnlisted,
    /// The set holds the name.
    Named,
}
