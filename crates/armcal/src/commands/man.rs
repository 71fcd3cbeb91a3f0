//! `armcal man`: the help of every command as man pages.

use super::{Outcome, may_write, print_written};
use crate::error::Error;
use armcal_recording::{atomic, make_folder};
use clap::Command;
use clap_mangen::Man;
use std::path::{Path, PathBuf};

/// What tells a page from one that armcal did not make.
const MARK: &str = ".\\\" armcal.man/1\n";

/// Writes `armcal.1` and a page a command.
pub fn run(mut root: Command, folder: &Path) -> Result<Outcome, Error> {
    root.build();
    // Built, each knows its whole name: `armcal-run`.
    let commands = root.get_subcommands().filter(|c| c.get_name() != "help").cloned();
    let pages: Vec<Command> = std::iter::once(root.clone()).chain(commands).collect();
    let name = |page: &Command| page.get_display_name().unwrap_or(page.get_name()).to_owned();
    let paths: Vec<PathBuf> = pages.iter().map(|page| folder.join(name(page) + ".1")).collect();
    let failed = |source| Error::Folder { path: folder.to_owned(), source };
    may_write(&paths)?;
    make_folder(folder).map_err(Error::Output)?;
    for (page, path) in pages.into_iter().zip(&paths) {
        let mut text = MARK.as_bytes().to_vec();
        Man::new(page).render(&mut text).map_err(failed)?;
        atomic::write(path, &text).map_err(Error::Output)?;
    }
    print_written(folder, &paths)?;
    Ok(Outcome::Done)
}
