//! Whether this tree gives what an older commit gave, and at what cost: both programs in one run, on the same inputs.
//!
//! `cargo bench -p armcal --bench before -- REVISION` builds that revision (default `HEAD`: what is not committed is compared
//! with what is) in a worktree under `target/before`, gives it and this tree every shipped pipeline and twenty simulated rigs to
//! run, check, plan, verify, pool and compare, compares every number of every file they leave, and prints processor times and memory side by side. It ends with an error
//! where anything moved or the new program is more than 5 % slower over all cases. `--tolerance 1e-12` allows numbers to move
//! by that share of the larger one; `--repeats N` (3) runs each case so often and takes the fastest; words that are no option are
//! cases to run alone.
//!
//! `revision` builds the older program; `cases` says what is run, and `process` runs it; `files` compares what they left.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a bench prints its numbers")]

mod cases;
mod files;
mod process;
mod revision;

use cases::{Case, Run};
use std::path::{Path, PathBuf};

type Result<T> = std::result::Result<T, Box<dyn std::error::Error + Send + Sync>>;

/// How much slower all cases together may be.
const SLOWER: f64 = 1.05;

struct Options {
    revision: String,
    tolerance: f64,
    repeats: usize,
    named: Vec<String>,
}

fn main() -> Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize()?;
    let folder = root.join("target/before");
    let all = cases::names(&root)?;
    let options = options(&root, &all)?;
    let programs =
        [revision::built(&root, &folder, &options.revision)?, PathBuf::from(env!("CARGO_BIN_EXE_armcal"))];
    println!(
        "{:<28} {:>12} {:>10} {:>9} {:>12} {:>9}  largest change",
        "case", "numbers", "before [s]", "now [s]", "before [MiB]", "now [MiB]"
    );
    let (mut total_s, mut moved) = ([0.0; 2], 0);
    for name in all.iter().filter(|n| options.named.is_empty() || options.named.contains(n)) {
        let Some(case) = Case::made(name, &root, &folder, &programs[1])? else {
            println!("{name:<28} its recordings are not on this machine");
            continue;
        };
        let [before, now] = case.run(&programs, options.repeats)?;
        let told = compared(&before, &now, options.tolerance)?;
        moved += usize::from(told.moved);
        total_s = [total_s[0] + before.cpu_s, total_s[1] + now.cpu_s];
        println!(
            "{name:<28} {:>12} {:>10.2} {:>9.2} {:>12.0} {:>9.0}  {}",
            told.numbers, before.cpu_s, now.cpu_s, before.peak_mib, now.peak_mib, told.words
        );
    }
    let ratio = total_s[1] / total_s[0];
    println!("together {:.2} s before, {:.2} s now: {ratio:.3}", total_s[0], total_s[1]);
    if moved > 0 {
        return Err(format!("{moved} cases are not what they were").into());
    }
    if ratio > SLOWER {
        return Err(format!("{:.1} % slower than {}", (ratio - 1.0) * 100.0, options.revision).into());
    }
    Ok(())
}

/// What became of the numbers of a case.
struct Compared {
    numbers: usize,
    moved: bool,
    words: String,
}

fn compared(before: &Run, now: &Run, tolerance: f64) -> Result<Compared> {
    let difference = files::compared(&before.folder, &now.folder)?;
    let mut words = match &difference.largest {
        None => "none, to the bit".to_owned(),
        Some((change, place)) => format!("{change:.1e} at {place}"),
    };
    let said = (before.said != now.said).then(|| "the terminal says something else".to_owned());
    let status = (before.status != now.status)
        .then(|| format!("exit codes {:?} are now {:?}", before.status, now.status));
    let others: Vec<String> = [status, said, difference.other].into_iter().flatten().collect();
    others.iter().for_each(|other| words += &format!("; {other}"));
    let moved = !others.is_empty() || difference.largest.is_some_and(|(change, _)| change > tolerance);
    Ok(Compared { numbers: difference.numbers, moved, words })
}

fn options(root: &Path, all: &[String]) -> Result<Options> {
    let mut options = Options { revision: "HEAD".into(), tolerance: 0.0, repeats: 3, named: Vec::new() };
    let mut arguments = std::env::args().skip(1).filter(|a| a != "--bench");
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or(format!("{argument} needs a number"));
        match argument.as_str() {
            "--tolerance" => options.tolerance = value()?.parse()?,
            "--repeats" => options.repeats = value()?.parse::<usize>()?.max(1),
            name if all.iter().any(|n| n == name) => options.named.push(name.to_owned()),
            revision => options.revision = revision::commit(root, revision)?,
        }
    }
    Ok(options)
}
