//! Recordings of a campaign that hold what another one holds already.

use super::store::Store;
use crate::error::ArchiveError;
use armcal_campaign::Row;
use armcal_result::Repeat;
use armcal_result::{DwellMark, also_in};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

/// Every recording with dwells of an earlier one of the manifest: the same files, or, re-encoded or cut, the same readings
/// at the same times. Only recordings that overlap in time are looked into.
///
/// # Errors
/// Observations of a result that cannot be read.
pub(super) fn find_repeats(
    store: &Store,
    rows: &[Row],
    folders: &[String],
) -> Result<Vec<Repeat>, ArchiveError> {
    let mut marks: BTreeMap<usize, Vec<DwellMark>> = BTreeMap::new();
    let mut repeats: Vec<Repeat> = Vec::new();
    let mut originals: Vec<usize> = Vec::new();
    for (at, row) in rows.iter().enumerate() {
        let same_files = |first: &&usize| !row.identity.is_empty() && rows[**first].identity == row.identity;
        if let Some(of) = originals.iter().find(same_files) {
            repeats.push(Repeat { row: at, of: *of, dwells: row.dwells, all: row.dwells });
            continue;
        }
        let overlapping = |first: &&usize| {
            let first = &rows[**first];
            first.dwells > 0 && row.dwells > 0 && first.start_ns <= row.end_ns && row.start_ns <= first.end_ns
        };
        for first in originals.iter().filter(overlapping) {
            for index in [*first, at] {
                if let Entry::Vacant(unread) = marks.entry(index) {
                    unread.insert(store.marks(&folders[index])?);
                }
            }
            let own = &marks[&at];
            let dwells = also_in(own, &marks[first]).iter().filter(|in_both| **in_both).count();
            if dwells > 0 {
                repeats.push(Repeat { row: at, of: *first, dwells, all: own.len() });
            }
        }
        let is_repeat = |r: &Repeat| r.row == at && r.counts_once();
        if !repeats.iter().any(is_repeat) {
            originals.push(at);
        }
    }
    Ok(repeats)
}
