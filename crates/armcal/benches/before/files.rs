//! Every number in every file of two results.

use crate::Result;
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::Path;

/// How the files of two results differ.
#[derive(Default)]
pub struct Difference {
    /// Numbers compared.
    pub numbers: usize,
    /// Largest relative change and where; none where all are the same to the bit.
    pub largest: Option<(f64, String)>,
    /// What differs that is no number: the first such thing.
    pub other: Option<String>,
}

impl Difference {
    fn differs(&mut self, what: String) {
        self.other.get_or_insert(what);
    }

    fn number(&mut self, a: f64, b: f64, place: &str) {
        self.numbers += 1;
        if a.to_bits() == b.to_bits() {
            return;
        }
        let change = (a - b).abs() / a.abs().max(b.abs());
        if self.largest.as_ref().is_none_or(|(most, _)| change > *most) {
            self.largest = Some((change, place.to_owned()));
        }
    }

    fn values(&mut self, a: &Value, b: &Value, place: &str) {
        match (a, b) {
            (Value::Number(a), Value::Number(b)) => {
                self.number(a.as_f64().unwrap_or(f64::NAN), b.as_f64().unwrap_or(f64::NAN), place);
            }
            (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
                a.iter()
                    .zip(b)
                    .enumerate()
                    .for_each(|(k, (a, b))| self.values(a, b, &format!("{place}[{k}]")));
            }
            (Value::Object(a), Value::Object(b)) => {
                for key in a.keys().chain(b.keys()).collect::<BTreeSet<_>>() {
                    match (a.get(key), b.get(key)) {
                        (Some(a), Some(b)) => self.values(a, b, &format!("{place}.{key}")),
                        (None, _) => self.differs(format!("{place}.{key} is new")),
                        (_, None) => self.differs(format!("{place}.{key} is gone")),
                    }
                }
            }
            _ if a == b => {}
            _ => self.differs(format!("{place} is something else")),
        }
    }
}

/// Compares JSON files number by number, all others byte by byte.
pub fn compared(before: &Path, now: &Path) -> Result<Difference> {
    let mut told = Difference::default();
    let names = |folder: &Path| relative(folder, Path::new(""));
    let (old, new) = (names(before)?, names(now)?);
    if let Some(name) = old.symmetric_difference(&new).next() {
        told.differs(format!("{name} is in one of them only"));
    }
    for name in old.intersection(&new) {
        let (a, b) = (std::fs::read(before.join(name))?, std::fs::read(now.join(name))?);
        if a == b && !name.ends_with(".json") {
            continue;
        }
        if name.ends_with(".json") {
            told.values(&serde_json::from_slice(&a)?, &serde_json::from_slice(&b)?, name);
        } else if told.largest.is_none() {
            // Numbers that moved are in the JSON files too, and told from there.
            told.differs(format!("{name} differs"));
        }
    }
    Ok(told)
}

/// Paths of all files in a folder and its folders, from that folder.
fn relative(folder: &Path, inner: &Path) -> Result<BTreeSet<String>> {
    let mut all = BTreeSet::new();
    for entry in std::fs::read_dir(folder.join(inner))? {
        let entry = entry?;
        let path = inner.join(entry.file_name());
        match entry.file_type()?.is_dir() {
            true => all.extend(relative(folder, &path)?),
            false => drop(all.insert(path.to_string_lossy().into_owned())),
        }
    }
    Ok(all)
}
