//! From what a user typed to the command that does it.

use crate::cli::{Cli, Command};
use crate::commands::{
    Outcome, add, batch, check, compare, compensate, completions, diagnose, effects, export, extract, init,
    inspect, man, plan, pool, run, simulate, transfer, verify, view, write,
};
use crate::error::Error;
use crate::stdout::print_warnings;
use armcal_config::Manifest;
use armcal_held_out::Asked;
use armcal_recording::data_loss_warnings;
use armcal_report::Detail;
use clap::CommandFactory as _;

/// Runs the command a user typed. None ends as if all was well where a recording lost data.
pub fn dispatch(cli: &Cli) -> Result<Outcome, Error> {
    let outcome = run_command(cli);
    let lost = data_loss_warnings();
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
    if !tells || !matches!(outcome, Ok(Outcome::CompletedWithWarnings)) {
        print_warnings(&lost);
    }
    match outcome {
        // What a check accepts of lost data is said in its limits.
        Ok(Outcome::Done) if !lost.is_empty() && !matches!(cli.command, Command::Check(_)) => {
            Ok(Outcome::CompletedWithWarnings)
        }
        outcome => outcome,
    }
}

fn run_command(cli: &Cli) -> Result<Outcome, Error> {
    match &cli.command {
        Command::Check(asked) => check::run(asked),
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
        Command::Compensate(asked) => compensate::run(asked),
        Command::Completions { shell } => completions::run(Cli::command(), *shell),
        Command::Man { folder } => man::run(Cli::command(), folder),
        Command::Diagnose { input, json } => diagnose::run(input, *json),
        Command::Add(asked) => add::run(asked),
        Command::Effects { name, json } => effects::run(name.as_deref(), *json),
        Command::Plan(asked) => plan::run(asked),
        Command::Pool { pipeline, results, out, verbose, json } => {
            pool::run(pipeline, results, out, report_detail(*verbose), *json)
        }
        Command::Run { pipeline, out, verbose, json } => {
            run::run(pipeline, out, report_detail(*verbose), *json)
        }
        Command::Init(asked) => init::run(asked),
        Command::Inspect { inputs, json } => inspect::run(inputs, *json),
        Command::Simulate { hide: Some(family), design, size, out, seed, .. } => {
            simulate::hide_effect(family, design, size, out, seed.unwrap_or(1))
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

fn report_detail(verbose: bool) -> Detail {
    if verbose { Detail::Everything } else { Detail::Story }
}
