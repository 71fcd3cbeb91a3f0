//! One command, one file.

pub mod add;
mod batch;
mod check;
mod compare;
mod compensate;
mod diagnose;
mod effects;
mod export;
mod inspect;
mod plan;
mod run;
mod score;
mod simulate;
mod verify;
mod view;

pub(crate) use compensate::Request as CompensateRequest;

use crate::batch::Manifest;
use crate::cli::{Cli, Command};
use crate::error::Error;
use armcal_report::TerminalStyle;
use std::io::{IsTerminal as _, Write as _};

/// How a command ended when it did not fail.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Done.
    Done,
    /// Done, but data were lost or the model is inadequate.
    Doubtful,
    /// Done, and the result breaks a limit.
    Broken,
}

/// Runs the command a user typed.
pub fn dispatch(cli: &Cli) -> Result<Outcome, Error> {
    match &cli.command {
        Command::Check { pipeline, junit, markdown, out, json } => {
            let (junit, markdown, out) = (junit.as_deref(), markdown.as_deref(), out.as_deref());
            check::run(&check::Request { pipeline, junit, markdown, out, json: *json })
        }
        Command::Batch { inputs, pipeline, out, full, jobs, json } => {
            let manifest = Manifest::of(inputs, out)?;
            batch::run(
                &batch::Job { manifest, pipeline: pipeline.as_deref(), out, full: *full, jobs: *jobs },
                *json,
            )
        }
        Command::Map { manifest, shard, pipeline, out, full, jobs } => {
            let manifest = Manifest::read(manifest)?;
            let job = batch::Job { manifest, pipeline: pipeline.as_deref(), out, full: *full, jobs: *jobs };
            batch::map(&job, shard.as_deref())
        }
        Command::Reduce { out, json } => batch::reduce(out, *json),
        Command::Compare { before, after, html, json } => compare::run(before, after, html.as_deref(), *json),
        Command::Compensate(asked) => compensate::run(&asked.request()),
        Command::Diagnose { input, json } => diagnose::run(input, *json),
        Command::Add { effects, pipeline, write, out, json } => {
            add::run(&add::Request { effects, pipeline, write: write.as_deref(), out, json: *json })
        }
        Command::Effects { name, json } => effects::run(name.as_deref(), *json),
        Command::Score { families, designs, size, seeds, from, sealed, json } => {
            let (seeds, from, sealed, json) = (*seeds, *from, *sealed, *json);
            score::run(&score::Request { families, designs, size, seeds, from, sealed, json })
        }
        Command::Plan { pipeline, dwells, effects, loads, margin, ranges, json } => {
            let (dwells, margin_deg, json) = (*dwells, *margin, *json);
            plan::run(&plan::Request { pipeline, dwells, effects, loads_kg: loads, margin_deg, ranges, json })
        }
        Command::Run { pipeline, out, json } => run::run(pipeline, out, *json),
        Command::Inspect { inputs, json } => inspect::run(inputs, *json),
        Command::Simulate { hide: Some(family), design, size, out, seed, .. } => {
            simulate::hide(family, design, size, out, seed.unwrap_or(1))
        }
        Command::Simulate { lab, out, seed, .. } => simulate::run(lab.as_deref(), out, *seed),
        Command::Verify { result, pipeline, out, json } => {
            verify::run(result, pipeline, out.as_deref(), *json)
        }
        Command::View { input, port } => view::run(input, *port),
        Command::Export { pipeline, out } => export::run(pipeline, out),
    }
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

/// Prints a result; a reader that closed the pipe is not an error.
fn print(text: &str) {
    let mut stdout = std::io::stdout().lock();
    let _ = stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush());
}

/// Colours on a terminal, unless the user asked for none.
fn style() -> TerminalStyle {
    let colour = std::io::stdout().is_terminal() && std::env::var_os("NO_COLOR").is_none();
    if colour { TerminalStyle::Colour } else { TerminalStyle::Plain }
}

/// A value as indented JSON, ending in a newline.
fn json_text(value: &impl serde::Serialize) -> Result<String, Error> {
    serde_json::to_string_pretty(value).map(|text| text + "\n").map_err(Error::Json)
}
