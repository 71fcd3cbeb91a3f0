//! Which reports name a cause: the one table by which answers are judged, `causes.toml`.
//!
//! Generous in wording, not in substance: a code counts when it contains one of the cause's codes, a sentence when it holds one
//! of its words, a physical effect only where it *is* the cause by another name (a knocked tool is a `tool_shift`). Causes that
//! no data can tell from each other are accepted for each other: a mirrored board and a mirrored arm, a conjugate and an inverse.

use serde::Deserialize;
use std::collections::BTreeMap;
use std::sync::LazyLock;

/// What counts as naming a cause.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cause {
    /// Parts of the codes of findings and warnings.
    pub codes: Vec<String>,
    /// Words in their sentences, or in an error message; lower case.
    pub words: Vec<String>,
    /// Effects of the catalogue that are this cause.
    #[serde(default)]
    pub effects: Vec<String>,
}

/// The cause of a name.
pub fn find_cause(name: &str) -> Option<&'static Cause> {
    CAUSES.get(name)
}

/// The table, by the names of the causes.
pub static CAUSES: LazyLock<BTreeMap<String, Cause>> =
    LazyLock::new(|| toml::from_str(include_str!("causes.toml")).expect("a table that the tests read"));

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinds;

    #[test]
    fn every_kind_has_a_cause_and_every_cause_a_kind() {
        let kinds = kinds();
        for kind in &kinds {
            assert!(
                find_cause(kind.cause).is_some(),
                "{} is caused by {}, which is not in the table",
                kind.name,
                kind.cause
            );
        }
        for (name, cause) in CAUSES.iter() {
            assert!(kinds.iter().any(|kind| kind.cause == name), "no kind is caused by {name}");
            let words = cause.words.iter().chain(&cause.codes);
            words.for_each(|w| assert_eq!(w.to_lowercase(), *w, "{w} would never be found"));
        }
    }

    #[test]
    fn each_rig_has_eighty_kinds_of_mistakes_and_no_name_is_used_twice() {
        let kinds = kinds();
        for rig in crate::Rig::ALL {
            let n = kinds.iter().filter(|kind| kind.rigs.contains(&rig)).count();
            assert!(n >= 80, "{} has {n} kinds", rig.word());
        }
        let mut names: Vec<&str> = kinds.iter().map(|kind| kind.name).collect();
        names.sort_unstable();
        let all = names.len();
        names.dedup();
        assert_eq!(names.len(), all);
    }
}
