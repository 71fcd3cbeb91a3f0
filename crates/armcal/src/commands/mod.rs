//! One command, one file.

pub mod add;
mod batch;
pub mod check;
mod compare;
pub mod compensate;
mod completions;
mod diagnose;
mod effects;
mod export;
pub mod extract;
pub mod init;
mod inspect;
mod man;
pub mod plan;
mod pool;
mod run;
pub mod score;
mod simulate;
mod transfer;
mod verify;
mod view;
pub mod write;

use crate::batch::Manifest;
use crate::cli::{Cli, Command};
use crate::error::Error;
use crate::stdout::print;
use crate::transfer::Asked;
use armcal_core::Warning;
use armcal_recording::losses;
use armcal_report::{Detail, TerminalStyle};
use std::borrow::Cow;
use std::io::{IsTerminal as _, Write as _};
use std::path::{Path, PathBuf};

/// Losses told one by one where there is no other place for them.
const TOLD: usize = 20;

/// How a command ended when it did not fail.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Done.
    Done,
    /// Done, but data were lost or the model is inadequate.
    Doubtful,
    /// Done, and the result breaks a limit.
    Broken,
    /// This much is done, and the same is to be done again.
    Again,
}

/// Runs the command a user typed. None ends as if all was well where a recording lost data.
pub fn dispatch(cli: &Cli) -> Result<Outcome, Error> {
    let outcome = command(cli);
    let lost = losses();
    // These tell what their recordings lost among their results.
    let tells = matches!(
        cli.command,
        Command::Run { .. }
            | Command::Inspect { .. }
            | Command::Extract(_)
            | Command::Batch { .. }
            | Command::Reduce { .. }
            | Command::Pool { .. }
            | Command::View { .. }
    );
    if !tells || !matches!(outcome, Ok(Outcome::Doubtful)) {
        tell(&lost);
    }
    match outcome {
        // What a check accepts of lost data is said in its limits.
        Ok(Outcome::Done) if !lost.is_empty() && !matches!(cli.command, Command::Check(_)) => {
            Ok(Outcome::Doubtful)
        }
        outcome => outcome,
    }
}

/// Says on stderr what recordings lost, where results have no place for it.
fn tell(lost: &[Warning]) {
    let mut lines =
        lost.iter().take(TOLD).map(|w| format!("{}: {w}\n", w.severity.word())).collect::<String>();
    if lost.len() > TOLD {
        lines += &format!("and {} more; `armcal inspect` lists them\n", lost.len() - TOLD);
    }
    // A closed stderr leaves nowhere to complain to; the exit code still tells.
    let _ = std::io::stderr().write_all(harmless(&lines, TerminalStyle::Plain).as_bytes());
}

/// The same in the JSON of a result, where anything was lost.
fn with_losses(mut value: serde_json::Value) -> serde_json::Value {
    let lost = losses();
    if let (Some(object), false) = (value.as_object_mut(), lost.is_empty()) {
        object.insert("data_lost".to_owned(), serde_json::json!(lost));
    }
    value
}

fn command(cli: &Cli) -> Result<Outcome, Error> {
    match &cli.command {
        Command::Check(asked) => check::run(asked),
        Command::Batch { inputs, pipeline, out, full, jobs, json } => {
            let manifest = Manifest::of(inputs, out)?;
            batch::run(
                &batch::Job { manifest, pipeline: pipeline.as_deref(), out, full: *full, jobs: *jobs },
                *json,
            )
        }
        Command::Map { pool: results, shard, pipeline, out, .. } if !results.is_empty() => {
            pool::map(pipeline.as_deref(), results, out, shard.as_deref())
        }
        Command::Map { manifest, shard, pipeline, out, full, jobs, .. } => {
            let manifest = Manifest::read(manifest.as_deref().unwrap_or(Path::new("")))?;
            let job = batch::Job { manifest, pipeline: pipeline.as_deref(), out, full: *full, jobs: *jobs };
            batch::map(&job, shard.as_deref())
        }
        Command::Reduce { out, json } if crate::pool::is_in_shards(out) => pool::reduce(out, *json),
        Command::Reduce { out, json } => batch::reduce(out, *json),
        Command::Compare { before, after, html, json } => compare::run(before, after, html.as_deref(), *json),
        Command::Compensate(asked) => compensate::run(asked),
        Command::Completions { shell } => completions::run(*shell),
        Command::Man { folder } => man::run(folder),
        Command::Diagnose { input, json } => diagnose::run(input, *json),
        Command::Add(asked) => add::run(asked),
        Command::Effects { name, json } => effects::run(name.as_deref(), *json),
        Command::Score(asked) => score::run(asked),
        Command::Plan(asked) => plan::run(asked),
        Command::Pool { pipeline, results, out, verbose, json } => {
            pool::run(pipeline, results, out, detail(*verbose), *json)
        }
        Command::Run { pipeline, out, verbose, json } => run::run(pipeline, out, detail(*verbose), *json),
        Command::Init(asked) => init::run(asked),
        Command::Inspect { inputs, json } => inspect::run(inputs, *json),
        Command::Simulate { hide: Some(family), design, size, out, seed, .. } => {
            simulate::hide(family, design, size, out, seed.unwrap_or(1))
        }
        Command::Simulate { lab, out, seed, .. } => simulate::run(lab.as_deref(), out, *seed),
        Command::Transfer { from, to, effects, json } => transfer::run(&Asked { from, to, effects }, *json),
        Command::Verify { result, pipeline, out, json } => {
            verify::run(result, pipeline, out.as_deref(), *json)
        }
        Command::Write(asked) => write::run(asked),
        Command::View { input, port } => view::run(input, *port),
        Command::Export { pipeline, out } => export::run(pipeline, out),
        Command::Extract(asked) => extract::run(asked),
    }
}

fn detail(verbose: bool) -> Detail {
    if verbose { Detail::Everything } else { Detail::Story }
}

/// Whether outputs may be written at all, asked before long computations.
fn may_write(paths: impl IntoIterator<Item = impl AsRef<Path>>) -> Result<(), Error> {
    armcal_recording::may_write_all(paths).map_err(Error::Output)
}

/// `JOINT=LOW..HIGH`: the joint by number from 1 or by name, and its range as written; `None` where it is not that.
fn joint_range(words: &str, joints: &[String]) -> Option<(usize, [f64; 2])> {
    let (joint, range) = words.split_once('=')?;
    let by_name = joints.iter().position(|name| name == joint.trim());
    let joint = by_name.or_else(|| joint.trim().parse::<usize>().ok()?.checked_sub(1))?;
    let (low, high) = range.split_once("..")?;
    let (low, high) = (low.trim().parse::<f64>().ok()?, high.trim().parse::<f64>().ok()?);
    let usable = joint < joints.len() && low.is_finite() && low < high && high.is_finite();
    usable.then_some((joint, [low, high]))
}

/// A text without control characters that a terminal would obey: names in it come from recordings. Lines, tabs and, where
/// we use them, colours stay; the others become `\u001b`, which also leaves JSON what it is.
pub fn harmless(text: &str, style: TerminalStyle) -> Cow<'_, str> {
    // Overrides of the writing direction would let a name rewrite the rest of its line.
    let turns = |c: char| matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    let is_harmless = |c: char| matches!(c, '\n' | '\t') || !c.is_control() && !turns(c);
    if text.chars().all(is_harmless) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        let colour = colour_code(rest).filter(|_| style == TerminalStyle::Colour);
        let taken = colour.unwrap_or(&rest[..c.len_utf8()]);
        match is_harmless(c) || colour.is_some() {
            true => shown.push_str(taken),
            false => shown.push_str(&format!("\\u{:04x}", u32::from(c))),
        }
        rest = &rest[taken.len()..];
    }
    Cow::Owned(shown)
}

/// The colour code a text begins with: `ESC [ numbers m`.
fn colour_code(text: &str) -> Option<&str> {
    let numbers = text.strip_prefix("\u{1b}[")?;
    let end = numbers.find(|c: char| !c.is_ascii_digit() && c != ';')?;
    numbers[end..].starts_with('m').then(|| &text[..end + "\u{1b}[m".len()])
}

/// Says which files were written where.
fn print_written(out: &Path, written: &[PathBuf]) -> Result<(), Error> {
    let names: Vec<String> =
        written.iter().filter_map(|p| p.file_name()).map(|n| n.to_string_lossy().into()).collect();
    print(&format!("\nWritten to {}: {}\n", out.display(), names.join(", ")))
}

/// Colours on a terminal, unless the user asked for none.
pub(crate) fn style() -> TerminalStyle {
    #[allow(clippy::disallowed_methods, reason = "nothing is written")]
    let colour = std::io::stdout().is_terminal() && std::env::var_os("NO_COLOR").is_none();
    if colour { TerminalStyle::Colour } else { TerminalStyle::Plain }
}

/// A value as indented JSON, ending in a newline.
fn json_text(value: &impl serde::Serialize) -> Result<String, Error> {
    serde_json::to_string_pretty(value).map(|text| text + "\n").map_err(Error::Json)
}

#[cfg(test)]
mod tests {
    use super::harmless;
    use armcal_report::TerminalStyle::{Colour, Plain};

    #[test]
    fn only_colours_and_lines_reach_the_terminal_as_they_are() {
        let ours = "\u{1b}[1mtitle\u{1b}[0m\n\tcell \u{1b}[38;5;11mü\u{1b}[39m";
        assert_eq!(harmless(ours, Colour), ours);
        assert_eq!(harmless("\u{1b}[1mtitle\n", Plain), "\\u001b[1mtitle\n");
        // Title, clipboard, screen, cursor, a C1 introducer, backspaces, carriage return.
        for (evil, shown) in [
            ("\u{1b}]0;pwned\u{7}", "\\u001b]0;pwned\\u0007"),
            ("\u{1b}[2J\u{1b}[H", "\\u001b[2J\\u001b[H"),
            ("\u{9b}31mx", "\\u009b31mx"),
            ("ab\u{8}\u{7f}\r", "ab\\u0008\\u007f\\u000d"),
            ("\u{1b}", "\\u001b"),
            ("a\u{202e}b", "a\\u202eb"),
            ("\u{1b}[31", "\\u001b[31"),
        ] {
            assert_eq!(harmless(evil, Colour), shown);
        }
        let json = serde_json::json!({ "name": "a\u{9b}b\u{7f}" });
        let printed = serde_json::from_str::<serde_json::Value>(&harmless(&json.to_string(), Plain));
        assert_eq!(printed.ok(), Some(json));
    }
}
