//! What a file says it is: everything that armcal writes can be told from what it did not write, by its content.
//!
//! * JSON begins with `"schema": "armcal.KIND/N"`; pages, TOML, URDF, Markdown and man pages have `armcal.KIND/N` in a comment or
//!   generator tag of their first lines, TOML, URDF and Markdown with a hash of everything else ([`crate::write::seal`]);
//! * MCAP names the library `armcal/VERSION` and bears a metadata record of its kind;
//! * Parquet has `armcal.KIND/N` among the key-value pairs of its footer.
//!
//! [`SIGNATURES`] and [`TABLES`] know what has no such word: formats that leave no room for it, and earlier versions.

use crate::RecordingError;
use crate::bytes::input;
use crate::bytes::ranges::Ranged;
use crate::structure::index::{self, Found};
use crate::structure::raw::{Attachment, parse_metadata};
use crate::write::seal::{Seal, mark_comment, parse_kind};
use std::fs::File;
use std::io::{self, Read as _, Seek as _, SeekFrom};
use std::path::Path;

/// Name of the metadata record that says what a thin recording was taken from.
pub const EXTRACT_METADATA: &str = "armcal-extract";

/// A mark stands in so many bytes at the beginning of a text.
const HEAD_BYTES: u64 = 16 << 10;
/// A larger footer of a Parquet file is none of ours.
const MAX_FOOTER_BYTES: u64 = 16 << 20;
const PARQUET: &[u8] = b"PAR1";
/// Metadata record of set-points as MCAP.
pub const SET_POINTS_METADATA: &str = "armcal/set-points";

/// Metadata records and what they make of a recording. The first counts: an extract keeps the metadata of what it was taken
/// from, a run those of its inputs.
const RECORDS: [(&str, &str); 4] = [
    (EXTRACT_METADATA, "extract"),
    ("armcal/run", "run"),
    (SET_POINTS_METADATA, "set-points-recording"),
    ("armcal.lab", "simulated-recording"),
];

/// Kind, beginning, and a part of the head of texts that are marked otherwise.
const SIGNATURES: [(&str, &str, &str); 12] = [
    ("parameters", "# Parameters of the calibrated arm. value, nominal, sigma and ci95", ""),
    ("pooled-parameters", "# Parameters of an arm calibrated on many recordings at once. ", ""),
    ("closed-chain-parameters", "# Parameters of two arms in a closed chain. ", ""),
    ("view", "# Where `armcal view` finds the pipeline of these results.\n", ""),
    ("layout", "{\n  \"version\": 1,\n  \"variables\": {},\n  \"userScripts\": {},\n", "/armcal/"),
    ("legacy-layout", "{\n  \"configById\": {", "!armcal1\""),
    ("set-points", "name,kind,t_s,x_m,y_m,z_m,nominal.", "set_point."),
    ("dh-rows", "joint,type,convention,theta_deg,d_mm,a_mm,alpha_deg\n", ""),
    ("junit", "<?xml ", "<testsuites name=\"armcal check\""),
    ("check-summary", "### ", "\n| check | measured | limit | |\n"),
    ("check-summary", "### ", ": no check was made, the run failed\n"),
    (EARLIER_PAGE, "<!doctype html>\n", "– armcal</title>"),
];
/// A page of a version that did not say which.
const EARLIER_PAGE: &str = "page";
const PAGE_SUFFIX: &str = "-page";
/// The page of a run, and what pools had of earlier versions.
const RUN_PAGE: &str = "report-page";
const EARLIER_POOL_PAGE: &str = "overview-page";

/// Kind and columns of tables of earlier versions.
const TABLES: [(&str, [&str; 2]); 5] = [
    ("dwells", ["effective_samples", "why_not"]),
    ("observations", ["expected_norm_mm", "held_out"]),
    ("parameters-table", ["ci95_low", "at_bound"]),
    ("campaign-table", ["nominal_mean_mm", "noise_floor_mm"]),
    ("paths", ["calibrated_x_m", "motion"]),
];

/// Texts that people are told to edit. Without a hash they are of an earlier version, and may have been.
const EDITED: [&str; 2] = ["pipeline", "board"];

/// The kind of a file that armcal made: `summary`, `report-page`, `dwells`, ...
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Mark {
    kind: String,
    seal: Seal,
}

impl Mark {
    /// Whether a file of this kind may take the place of one of the other kind.
    pub fn replaces(&self, other: &Mark) -> bool {
        let earlier = match other.kind.as_str() {
            EARLIER_PAGE => self.kind.ends_with(PAGE_SUFFIX),
            EARLIER_POOL_PAGE => self.kind == RUN_PAGE,
            _ => false,
        };
        self.kind == other.kind || earlier
    }

    /// The kind, as people read it.
    pub fn kind(&self) -> &str {
        &self.kind
    }

    /// Whether somebody has changed the file since armcal wrote it, or may have; in words.
    pub fn edited(&self) -> Option<&'static str> {
        match self.seal {
            Seal::Broken => Some("was changed since armcal wrote it"),
            Seal::None if EDITED.contains(&self.kind.as_str()) => {
                Some("was written by a version of armcal that does not tell whether it was changed since")
            }
            Seal::None | Seal::Whole => None,
        }
    }

    /// The mark of a file; `None` for one that armcal did not make.
    pub fn of_file(path: &Path) -> io::Result<Option<Mark>> {
        let mut file = input::open_regular(path)?;
        let mut head = Vec::new();
        file.by_ref().take(HEAD_BYTES).read_to_end(&mut head)?;
        if head.starts_with(mcap::MAGIC) {
            return Ok(of_mcap(file, path).unwrap_or(None));
        }
        if head.starts_with(PARQUET) {
            return of_parquet(&mut file);
        }
        let mut mark = Mark::of_text(&head);
        if let (Some(mark), Some(comment)) = (&mut mark, mark_comment(valid_utf8(&head))) {
            mark.seal = comment.seal(&head, file)?;
        }
        Ok(mark)
    }

    /// The mark of a text, given its beginning.
    pub fn of_text(head: &[u8]) -> Option<Mark> {
        let head = String::from_utf8_lossy(head);
        let holds = |(_, begins, part): &&(&str, &str, &str)| head.starts_with(begins) && head.contains(part);
        let signed = || SIGNATURES.iter().find(holds).map(|(kind, ..)| (*kind).to_owned());
        of_schema(&head).or_else(|| Some(mark_comment(&head)?.kind)).or_else(signed).map(unsealed_mark)
    }
}

fn unsealed_mark(kind: String) -> Mark {
    Mark { kind, seal: Seal::None }
}

/// The text that bytes begin with.
fn valid_utf8(bytes: &[u8]) -> &str {
    let end = std::str::from_utf8(bytes).map_or_else(|e| e.valid_up_to(), str::len);
    std::str::from_utf8(&bytes[..end]).unwrap_or_default()
}

/// The first key of a JSON object, if it is our schema.
fn of_schema(head: &str) -> Option<String> {
    let key = head.trim_start().strip_prefix('{')?.trim_start().strip_prefix("\"schema\"")?;
    let word = key.trim_start().strip_prefix(':')?.trim_start().strip_prefix("\"armcal.")?;
    parse_kind(word).map(|(kind, _)| kind)
}

fn of_mcap(file: File, path: &Path) -> Result<Option<Mark>, RecordingError> {
    let ranged = Ranged::local(file, path)?;
    // What armcal finishes has a summary.
    let Found::Layout(layout) = index::find(&ranged)? else { return Ok(None) };
    if !layout.library.starts_with("armcal/") {
        return Ok(None);
    }
    let mut names = Vec::new();
    for range in &layout.metadata {
        names.extend(parse_metadata(&ranged.read_one(range.clone())?).map(|(name, _)| name));
    }
    let borne = |(record, _): &&(&str, &str)| names.iter().any(|name| name == record);
    // Set-points of earlier versions have no record, but no other topics either.
    let mut channels = layout.definitions.channels().peekable();
    let set_points = channels.peek().is_some()
        && names.is_empty()
        && channels.all(|(_, channel)| channel.topic.starts_with("/joint_set_points"));
    let earlier = || set_points.then_some(&RECORDS[2]);
    Ok(RECORDS.iter().find(borne).or_else(earlier).map(|(_, kind)| unsealed_mark((*kind).to_owned())))
}

fn of_parquet(file: &mut File) -> io::Result<Option<Mark>> {
    let mut end = [0; 8];
    let size = file.seek(SeekFrom::End(0))?;
    if size < end.len() as u64 {
        return Ok(None);
    }
    file.seek(SeekFrom::End(-8))?;
    file.read_exact(&mut end)?;
    let [a, b, c, d, magic @ ..] = end;
    let footer_bytes = u64::from(u32::from_le_bytes([a, b, c, d]));
    if magic != PARQUET || footer_bytes > MAX_FOOTER_BYTES || footer_bytes + 8 > size {
        return Ok(None);
    }
    file.seek(SeekFrom::Start(size - 8 - footer_bytes))?;
    let mut footer = Vec::new();
    file.take(footer_bytes).read_to_end(&mut footer)?;
    let footer = String::from_utf8_lossy(&footer);
    let said = footer.match_indices("armcal.").find_map(|(at, word)| parse_kind(&footer[at + word.len()..]));
    let said = said.map(|(kind, _)| kind);
    let has = |(_, columns): &&(&str, [&str; 2])| columns.iter().all(|column| footer.contains(column));
    Ok(said.or_else(|| TABLES.iter().find(has).map(|(kind, _)| (*kind).to_owned())).map(unsealed_mark))
}

/// Whether the `run.mcap` beside a file has just this file attached: so earlier versions, which did not mark every file,
/// say which are theirs.
pub(crate) fn attached_to_run(path: &Path) -> Result<bool, RecordingError> {
    let beside = path.with_file_name("run.mcap");
    let read = |source| RecordingError::Read { path: path.to_owned(), source };
    if Mark::of_file(&beside).ok().flatten().is_none_or(|mark| mark.kind() != "run") {
        return Ok(false);
    }
    let mut bytes = Vec::new();
    input::open_regular(path).and_then(|mut file| file.read_to_end(&mut bytes)).map_err(read)?;
    let name = format!("armcal/{}", path.file_name().unwrap_or_default().to_string_lossy());
    let ranged = Ranged::local(input::open_regular(&beside).map_err(read)?, &beside)?;
    let Found::Layout(layout) = index::find(&ranged)? else { return Ok(false) };
    for range in &layout.attachments {
        let body = ranged.read_one(range.clone())?;
        if Attachment::parse(&body).is_some_and(|a| a.name == name && a.data == bytes) {
            return Ok(true);
        }
    }
    Ok(false)
}

#[cfg(test)]
#[path = "mark_tests.rs"]
mod tests;
