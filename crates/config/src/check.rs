//! `[check]`: the limits of a pipeline file.

use armcal_core::Severity;
use armcal_diagnose::Verdict;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Limits that a result must keep. Each one that is given is a check of its own; none is given by default.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CheckSection {
    /// Largest mean error on held-out points [mm].
    pub max_holdout_mean_mm: Option<f64>,
    /// Largest 95th percentile of the error on held-out points [mm].
    pub max_holdout_p95_mm: Option<f64>,
    /// Largest ratio of the mean error on held-out points to the declared noise.
    pub max_over_floor: Option<f64>,
    /// Fewest dwells of any recording.
    pub min_dwells: Option<usize>,
    /// Dwells of a recording, exactly, by its name.
    pub dwells: Option<BTreeMap<String, usize>>,
    /// Largest share of a recording's dwells that do not take part in the fit, 0 to 1.
    pub max_rejected_share: Option<f64>,
    /// Verdicts of the diagnosis that are right.
    pub verdicts: Option<Vec<Verdict>>,
    /// Effects that may be missing: `backlash:1`; `backlash` at any joint, `zero_slip:2` at any time.
    pub allowed_effects: Option<Vec<String>>,
    /// Most warnings of each severity.
    pub max_warnings: Option<MaxWarnings>,
    /// `summary.json` of an accepted run, its `run.mcap`, or the folder they are in.
    pub reference: Option<PathBuf>,
    /// Largest change of a length of the robot since the reference that the two uncertainties do not explain [mm].
    pub max_shift_mm: Option<f64>,
    /// Same for its angles [deg].
    pub max_shift_deg: Option<f64>,
    /// Same for where base, tip and boards are [mm].
    pub max_frame_shift_mm: Option<f64>,
    /// Same for how they are turned [deg].
    pub max_frame_shift_deg: Option<f64>,
    /// A change is explained by the uncertainties up to this many of their joint standard deviations; 4.
    pub max_shift_sigmas: Option<f64>,
    /// Teeth of the belt pulley or encoder wheel of a joint, by its name: a slip is told in them too.
    pub teeth: Option<BTreeMap<String, u32>>,
}

/// Most warnings of each severity; what is not given is not limited.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MaxWarnings {
    /// Worth knowing.
    pub notice: Option<usize>,
    /// The model or the data do not carry the result.
    pub inadequate: Option<usize>,
    /// Data were damaged or could not be used.
    pub data_lost: Option<usize>,
}

impl MaxWarnings {
    /// The limit for a severity, if there is one.
    pub fn of(&self, severity: Severity) -> Option<usize> {
        match severity {
            Severity::Notice => self.notice,
            Severity::Inadequate => self.inadequate,
            Severity::DataLost => self.data_lost,
        }
    }
}

/// What a section is checked against before anything is run.
pub struct Surroundings<'p> {
    /// Names of the recordings.
    pub recordings: &'p [String],
    /// Whether something is held out.
    pub holdout: bool,
    /// Whether the run is diagnosed.
    pub diagnosis: bool,
}

impl CheckSection {
    /// Whether any limit is given.
    pub fn has_limits(&self) -> bool {
        let numbers = self.numbers().iter().any(|(_, value)| value.is_some());
        let warnings = self.max_warnings.unwrap_or_default() != MaxWarnings::default();
        let dwells = self.min_dwells.is_some() || self.dwells.as_ref().is_some_and(|d| !d.is_empty());
        numbers || warnings || dwells || self.limits_verdict()
    }

    /// Whether the diagnosis is limited.
    pub fn limits_verdict(&self) -> bool {
        self.verdicts.is_some() || self.allowed_effects.is_some()
    }

    /// The limits that are numbers, by key.
    fn numbers(&self) -> [(&'static str, Option<f64>); 8] {
        [
            ("max_holdout_mean_mm", self.max_holdout_mean_mm),
            ("max_holdout_p95_mm", self.max_holdout_p95_mm),
            ("max_over_floor", self.max_over_floor),
            ("max_rejected_share", self.max_rejected_share),
            ("max_shift_mm", self.max_shift_mm),
            ("max_shift_deg", self.max_shift_deg),
            ("max_frame_shift_mm", self.max_frame_shift_mm),
            ("max_frame_shift_deg", self.max_frame_shift_deg),
        ]
    }

    /// The first key that cannot be meant, and what is wrong with it.
    pub fn contradiction(&self, around: &Surroundings<'_>) -> Option<(String, String)> {
        let found = |key: &str, problem: String| Some((format!("check.{key}"), problem));
        let sigmas = ("max_shift_sigmas", self.max_shift_sigmas);
        for (key, value) in self.numbers().into_iter().chain([sigmas]) {
            let bad = |v: &f64| !(v.is_finite() && *v >= 0.0);
            if let Some(value) = value.filter(bad) {
                return found(key, format!("must be a number of at least 0, is {value}"));
            }
            if value.is_some() && key.contains("_shift_") && self.reference.is_none() {
                return found(key, "needs reference = \"...\", an earlier result to compare with".into());
            }
            if value.is_some() && !around.holdout && (key.contains("holdout") || key == "max_over_floor") {
                return found(key, "needs a [holdout]: nothing is held out of this fit".into());
            }
        }
        if let Some(share) = self.max_rejected_share.filter(|share| *share > 1.0) {
            return found("max_rejected_share", format!("is a share from 0 to 1, is {share}"));
        }
        if self.limits_verdict() && !around.diagnosis {
            let key = if self.verdicts.is_some() { "verdicts" } else { "allowed_effects" };
            return found(key, "needs the diagnosis, but [diagnosis] has enabled = false".into());
        }
        if self.verdicts.as_ref().is_some_and(Vec::is_empty) && self.allowed_effects.is_none() {
            return found(
                "verdicts",
                "is empty, so no result could ever pass; add \"nothing_missing\"".into(),
            );
        }
        let shifts = self.numbers().iter().any(|(key, value)| key.contains("_shift_") && value.is_some());
        if self.reference.is_some() && !shifts {
            let keys = "max_shift_mm, max_shift_deg, max_frame_shift_mm or max_frame_shift_deg";
            return found("reference", format!("is compared with nothing; add {keys}"));
        }
        if let Some((joint, _)) = self.teeth.iter().flatten().find(|(_, teeth)| **teeth == 0) {
            return found(&format!("teeth.{joint}"), "must be at least 1, is 0".into());
        }
        let unknown = |name: &&String| !around.recordings.contains(name);
        let name = self.dwells.iter().flatten().map(|(name, _)| name).find(unknown)?;
        found(
            &format!("dwells.{name}"),
            format!("names no recording; they are {}", around.recordings.join(", ")),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The key named for a section, in a pipeline of the recording `normal` with hold-out and diagnosis.
    fn key(text: &str, holdout: bool, diagnosis: bool) -> String {
        let section: CheckSection = toml::from_str(text).unwrap_or_else(|e| panic!("{text}: {e}"));
        let around = Surroundings { recordings: &["normal".to_owned()], holdout, diagnosis };
        section.contradiction(&around).map_or(String::new(), |(key, _)| key)
    }

    #[test]
    fn limits_that_cannot_be_meant_are_named() {
        for (text, named) in [
            ("max_holdout_mean_mm = nan", "check.max_holdout_mean_mm"),
            ("max_holdout_p95_mm = inf", "check.max_holdout_p95_mm"),
            ("max_over_floor = -1.0", "check.max_over_floor"),
            ("max_rejected_share = 20.0", "check.max_rejected_share"),
            ("max_shift_deg = 0.1", "check.max_shift_deg"),
            ("max_frame_shift_mm = 1.0", "check.max_frame_shift_mm"),
            ("max_shift_sigmas = 3.0", "check.max_shift_sigmas"),
            ("reference = 'a.json'", "check.reference"),
            ("verdicts = []", "check.verdicts"),
            ("dwells = { norml = 61 }", "check.dwells.norml"),
            ("teeth = { joint2 = 0 }", "check.teeth.joint2"),
        ] {
            assert_eq!(key(text, true, true), named);
        }
        assert_eq!(key("max_over_floor = 2.0", false, true), "check.max_over_floor");
        assert_eq!(key("allowed_effects = ['backlash']", true, false), "check.allowed_effects");
        let sound = "max_over_floor = 2.0\nverdicts = ['nothing_missing']\ndwells = { normal = 3 }\n\
                     reference = 'a.json'\nmax_shift_mm = 0.1";
        assert_eq!(key(sound, true, true), "");
    }

    #[test]
    fn a_section_without_limits_has_none() {
        for text in
            ["", "reference = 'a'", "max_shift_sigmas = 3.0", "teeth = { a = 1 }", "max_warnings = {}"]
        {
            assert!(!toml::from_str::<CheckSection>(text).expect("TOML").has_limits(), "{text}");
        }
        for text in [
            "max_warnings = { notice = 9 }",
            "verdicts = ['unknown']",
            "min_dwells = 0",
            "max_shift_mm = 0.0",
        ] {
            assert!(toml::from_str::<CheckSection>(text).expect("TOML").has_limits(), "{text}");
        }
    }
}
