use crate::support::root;
use serde::Serialize;

/// Every key of the sections that have defaults, as the program itself spells them.
fn keys<T: Serialize>(section: &T) -> Vec<String> {
    let value = serde_json::to_value(section).expect("a section is a table");
    value.as_object().expect("a section is a table").keys().cloned().collect()
}

#[test]
fn the_reference_lists_every_key_with_a_default() {
    let reference = std::fs::read_to_string(root().join("docs/pipeline-reference.md")).expect("reference");
    let sections = [
        keys(&armcal_dwell::ClockConfig::default()),
        keys(&armcal_dwell::DwellConfig::default()),
        keys(&armcal_table::AssociationConfig::default()),
        keys(&armcal_calibrate::FitConfig::default()),
        keys(&armcal_model::Deviation::default()),
        keys(&armcal_diagnose::DiagnosisConfig::default()),
        keys(&armcal::pool::PoolSection::default()),
        keys(&armcal::check::CheckSection::default()),
        keys(&armcal::check::MaxWarnings::default()),
    ];
    for key in sections.concat() {
        assert!(reference.contains(&format!("`{key}`")), "docs/pipeline-reference.md does not list `{key}`");
    }
}

#[test]
fn every_shipped_pipeline_is_valid() {
    for entry in std::fs::read_dir(root().join("pipelines")).expect("pipelines") {
        let path = entry.expect("entry").path();
        if path.extension().is_some_and(|e| e == "toml") {
            armcal::Job::load(&path).unwrap_or_else(|e| panic!("{e}"));
        }
    }
}

/// The catalogue is printed by the program; the guide to the diagnosis must not name effects that do not exist.
#[test]
fn effects_named_in_the_guide_to_the_diagnosis_exist() {
    let guide = std::fs::read_to_string(root().join("docs/diagnosis.md")).expect("guide");
    let known: Vec<&str> = armcal_model::catalogue().iter().map(|kind| kind.name).collect();
    let effects = guide.split("## Effects").nth(1).expect("the section on effects");
    let rows = effects.lines().filter(|line| line.starts_with("| `"));
    for row in rows {
        let name = row.trim_start_matches("| `").split(['`', ':', '@', ',']).next().unwrap_or_default();
        assert!(known.contains(&name), "docs/diagnosis.md: `{name}` is not in the catalogue");
    }
}

/// Somebody will paste it.
#[test]
fn the_limits_shown_in_the_guide_to_checks_are_understood() {
    #[derive(serde::Deserialize)]
    struct Shown {
        check: armcal::check::CheckSection,
    }
    let guide = std::fs::read_to_string(root().join("docs/check.md")).expect("guide");
    let block = guide.split("```toml\n").nth(1).and_then(|rest| rest.split("```").next()).expect("a section");
    let shown: Shown = toml::from_str(block).unwrap_or_else(|e| panic!("{e}"));
    let all = serde_json::to_value(&shown.check).expect("JSON");
    let unset: Vec<&String> =
        all.as_object().expect("a table").iter().filter(|(_, v)| v.is_null()).map(|(k, _)| k).collect();
    assert!(unset.is_empty(), "docs/check.md does not show {unset:?}");
}
