//! `armcal-dev mistakes`: runs armcal on setup mistakes and on sound sessions, and writes the table of what it said.

use crate::print_stderr;
use armcal_mistakes::judge::{self, Case};
use armcal_mistakes::sound::{self, Sound};
use armcal_mistakes::table::{Counts, markdown};
use armcal_mistakes::{Error, Kind, Rig, kinds, run::beside_this};
use clap::Args;
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Which mistakes, on which rigs.
#[derive(Debug, Args)]
pub struct Request {
    /// Seed of all rigs and mistakes.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// How many seeds, from that one on.
    #[arg(long, default_value_t = 1)]
    seeds: u64,
    /// Only this rig; may be given again.
    #[arg(long = "rig", value_name = "table|sockets|poses")]
    rigs: Vec<String>,
    /// Only this kind; may be given again.
    #[arg(long = "kind", value_name = "NAME")]
    only: Vec<String>,
    /// Only so many kinds, spread over the list.
    #[arg(long, value_name = "N")]
    kinds: Option<usize>,
    /// Sound sessions.
    #[arg(long, default_value_t = 200, value_name = "N")]
    sound: usize,
    /// Number of the first of them; with `--seeds 0` and `--sound 1` one session again by itself.
    #[arg(long, default_value_t = 0, value_name = "N")]
    sound_from: usize,
    /// Write the table here.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Write everything that was said as JSON.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Keep the sessions and results of all cases here.
    #[arg(long, value_name = "DIR")]
    keep: Option<PathBuf>,
    /// Cases at a time; all cores when absent.
    #[arg(long, value_name = "N")]
    jobs: Option<usize>,
    /// The program; the one beside this one when absent.
    #[arg(long, value_name = "FILE")]
    armcal: Option<PathBuf>,
    /// Run nothing: judge again what an earlier run wrote with --json.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["keep", "jobs", "armcal"])]
    again: Option<PathBuf>,
    /// Print the kinds, their causes and rigs, and run nothing.
    #[arg(long)]
    list: bool,
}

/// Runs the suite and writes what came of it.
pub fn run(args: &Request) -> Result<ExitCode, Error> {
    let (kinds, rigs) = (select_kinds(args)?, select_rigs(args)?);
    if args.list {
        for kind in kinds {
            let rigs: Vec<&str> = kind.rigs.iter().map(|rig| rig.word()).collect();
            print_stdout(&format!("{:40} {:24} {}\n", kind.name, kind.cause, rigs.join(" ")));
        }
        return Ok(ExitCode::SUCCESS);
    }
    if let Some(path) = &args.again {
        let Written { cases, sound } = read_results(path)?;
        let cases: Vec<Case> = cases.into_iter().map(Case::judged_again).collect();
        let sound: Vec<Sound> = sound.into_iter().map(Sound::judged_again).collect();
        return write_report(args, &cases, &sound);
    }
    let armcal = args.armcal.clone().or_else(beside_this).unwrap_or_else(|| "armcal".into());
    let wanted: Vec<(&Kind, Rig, u64)> = (args.seed..args.seed + args.seeds)
        .flat_map(|seed| rigs.iter().map(move |rig| (*rig, seed)))
        .flat_map(|(rig, seed)| {
            kinds.iter().filter(move |k| k.rigs.contains(&rig)).map(move |kind| (kind, rig, seed))
        })
        .collect();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(args.jobs.unwrap_or(0)).build();
    let work = || -> Result<(Vec<Case>, Vec<Sound>), Error> {
        let progress = Progress { done: AtomicUsize::new(0), all: wanted.len() + args.sound };
        let cases = wanted.par_iter().map(|(kind, rig, seed)| {
            let name = format!("{}-{}-{seed}", rig.word(), kind.name);
            let case = run_in_folder(args.keep.as_deref(), &name, |folder| {
                judge::run_case(&armcal, kind, *rig, *seed, folder)
            })?;
            let (reported, verdict) = (case.reported.as_deref(), case.said.verdict.as_deref());
            progress.step(&format!(
                "{name}: {} (exit {:?}, {:.2} floors, {}, reported {})",
                case.judgement.words(),
                case.said.exit.unwrap_or(-1),
                case.said.ratio().unwrap_or(f64::NAN),
                verdict.unwrap_or("no verdict"),
                reported.unwrap_or("nothing of it"),
            ));
            Ok(case)
        });
        let cases = cases.collect::<Result<_, Error>>()?;
        let sound = (args.sound_from..args.sound_from + args.sound).into_par_iter().map(|number| {
            let name = format!("sound-{number}-{}", args.seed);
            let sound = run_in_folder(args.keep.as_deref(), &name, |folder| {
                sound::run_session(&armcal, number, args.seed, folder)
            })?;
            progress.step(&format!("{name}: {} alarms", sound.alarms.len()));
            Ok(sound)
        });
        Ok((cases, sound.collect::<Result<_, Error>>()?))
    };
    let (cases, sound) = match pool {
        Ok(pool) => pool.install(work)?,
        Err(_) => work()?,
    };
    write_report(args, &cases, &sound)
}

fn write_report(args: &Request, cases: &[Case], sound: &[Sound]) -> Result<ExitCode, Error> {
    let command = format!(
        "cargo run --release -p armcal-dev -- mistakes --seed {} --seeds {} --sound {}",
        args.seed, args.seeds, args.sound
    );
    let text = markdown(cases, sound, &command);
    match &args.out {
        Some(path) => std::fs::write(path, &text).map_err(Error::file("writing", path))?,
        None => print_stdout(&text),
    }
    if let Some(path) = &args.json {
        let all = serde_json::json!({ "cases": cases, "sound": sound });
        std::fs::write(path, format!("{all:#}\n")).map_err(Error::file("writing", path))?;
    }
    let counts = Counts::of(cases);
    let alarmed = sound.iter().filter(|s| !s.alarms.is_empty()).count();
    print_stderr(&format!(
        "{} cases: {} right, {} not shown, {} missed, {} false; {alarmed} of {} sound sessions with a false alarm",
        counts.cases,
        counts.right,
        counts.not_shown,
        counts.missed,
        counts.false_said,
        sound.len()
    ));
    Ok(if counts.false_said + alarmed == 0 { ExitCode::SUCCESS } else { ExitCode::from(3) })
}

/// What --json writes.
#[derive(serde::Deserialize)]
struct Written {
    cases: Vec<Case>,
    sound: Vec<Sound>,
}

fn read_results(path: &Path) -> Result<Written, Error> {
    let bytes = std::fs::read(path).map_err(Error::file("reading", path))?;
    serde_json::from_slice(&bytes).map_err(|e| Error::File {
        doing: "reading",
        path: path.to_owned(),
        source: e.into(),
    })
}

fn select_kinds(args: &Request) -> Result<Vec<Kind>, Error> {
    if !args.only.is_empty() {
        return args.only.iter().map(|name| kinds::find_kind(name)).collect();
    }
    let all = kinds();
    let n = args.kinds.unwrap_or(all.len()).clamp(1, all.len());
    Ok((0..n).map(|i| all[i * all.len() / n]).collect())
}

fn select_rigs(args: &Request) -> Result<Vec<Rig>, Error> {
    match args.rigs.is_empty() {
        true => Ok(Rig::ALL.to_vec()),
        false => args.rigs.iter().map(|word| Rig::named(word)).collect(),
    }
}

/// Works in a folder of the case's own, which is kept or not.
fn run_in_folder<T>(
    keep: Option<&Path>,
    name: &str,
    work: impl FnOnce(&Path) -> Result<T, Error>,
) -> Result<T, Error> {
    if let Some(keep) = keep {
        return work(&keep.join(name));
    }
    let folder =
        tempfile::tempdir().map_err(Error::file("making a temporary folder in", std::env::temp_dir()))?;
    work(folder.path())
}

struct Progress {
    done: AtomicUsize,
    all: usize,
}

impl Progress {
    fn step(&self, what: &str) {
        let n = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        print_stderr(&format!("{n}/{} {what}", self.all));
    }
}

#[expect(clippy::print_stdout, reason = "the result of the command")]
fn print_stdout(text: &str) {
    print!("{text}");
}
