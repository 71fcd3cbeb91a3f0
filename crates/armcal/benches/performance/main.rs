//! The numbers of speed and memory that the design promises, each measured beside its peer in one run.
//!
//! `cargo bench -p armcal --bench performance` measures everything and rewrites `docs/performance.md`. With names of
//! parts it prints them and leaves the page alone: `cargo bench -p armcal --bench performance -- fit reading`; with `--into-page` a
//! part without bars takes its place on the page, and says when it was measured.
//! `--size-mb N` sets the size of the recording that is read, `--recordings N` the most recordings of a batch (1000 both),
//! `--poses N` the most poses of a campaign, `--older REVISION` the commit whose program runs beside this one.
//! Data go to `target/bench-data`.
//!
//! `recordings` generates what is read; `reading`, `fit`, `diagnosis`, `growth` (of what `campaign` makes), `stages` of a run,
//! `memory`, `alignment` (of clocks), `batch`, `older` (the same commands by an older commit) are the parts; `peers` finds or makes
//! the tools they are compared with (`../peers`), skipped loudly where they cannot be had; `clock` measures, `child`
//! measures processes, `page` lays out, `machine` says on what.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a bench prints its numbers")]

mod alignment;
mod batch;
mod campaign;
mod child;
mod clock;
mod diagnosis;
mod fit;
mod fit_problem;
mod growth;
mod machine;
mod memory;
mod older;
mod page;
mod peers;
#[path = "../before/process.rs"]
mod process;
mod reading;
mod recordings;
#[path = "../before/revision.rs"]
mod revision;
mod stages;
mod walk;

use page::Section;
use std::path::{Path, PathBuf};

/// The last commit before cost was looked at.
const OLDER: &str = "fd49d09";

type Result<T> = std::result::Result<T, Box<dyn std::error::Error + Send + Sync>>;

/// Measures one part.
type Part = fn(&Options) -> Result<Section>;

/// Each by its name, in the order of the page.
const PARTS: [(&str, Part); 9] = [
    ("reading", reading::section),
    ("fit", fit::section),
    ("diagnosis", diagnosis::section),
    ("growth", growth::section),
    ("stages", stages::section),
    ("memory", memory::section),
    ("alignment", alignment::section),
    ("batch", batch::section),
    ("older", older::section),
];

/// What the command line asks for.
pub struct Options {
    /// Size of the recording that is read [MB].
    pub size_mb: u64,
    /// Most recordings of a batch.
    pub recordings: usize,
    /// Most poses of a campaign.
    pub poses: usize,
    /// The revision whose program runs beside this one.
    pub older: String,
    /// Where generated recordings and built peers lie.
    pub data: PathBuf,
}

fn main() -> Result<()> {
    // Cargo passes `--bench` to every bench.
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    if let [role, rest @ ..] = arguments.as_slice()
        && role == child::CHILD
    {
        return child::run(rest);
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut options = Options {
        size_mb: 1000,
        recordings: 1000,
        poses: 20_000,
        older: OLDER.into(),
        data: root.join("target/bench-data"),
    };
    let mut named = Vec::new();
    let mut into_page = false;
    let mut arguments = arguments.iter();
    while let Some(argument) = arguments.next() {
        if argument == "--size-mb" {
            options.size_mb = count(argument, arguments.next())? as u64;
        } else if argument == "--recordings" {
            options.recordings = count(argument, arguments.next())?;
        } else if argument == "--poses" {
            options.poses = count(argument, arguments.next())?;
        } else if argument == "--older" {
            options.older = arguments.next().ok_or("--older needs a revision")?.clone();
        } else if argument == "--into-page" {
            into_page = true;
        } else if PARTS.iter().any(|(name, _)| name == argument) {
            named.push(argument.as_str());
        } else {
            let parts = PARTS.map(|(name, _)| name).join(", ");
            return Err(format!("`{argument}` is no part: choose of {parts}").into());
        }
    }
    std::fs::create_dir_all(&options.data)?;
    let mut sections = Vec::new();
    for (name, section) in PARTS.iter().filter(|(name, _)| named.is_empty() || named.contains(name)) {
        eprintln!("measuring {name}");
        let section = section(&options)?;
        println!("{}", section.text());
        sections.push(section);
    }
    let path = root.join("docs/performance.md");
    if named.is_empty() {
        std::fs::write(&path, page::page(&sections, &options))?;
        println!("{}", path.display());
    } else if into_page {
        let page = std::fs::read_to_string(&path)?;
        let page = sections.iter().try_fold(page, |page, section| page::with(&page, section));
        std::fs::write(&path, page.ok_or("a part has bars: measure all parts")?)?;
    }
    Ok(())
}

/// The number behind an option.
fn count(option: &str, value: Option<&String>) -> Result<usize> {
    let value = value.ok_or_else(|| format!("{option} needs a number"))?;
    value.parse().map_err(|e| format!("{option} {value}: {e}").into())
}
