//! The program as an older commit has it.

use crate::Result;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The commit that a revision means. Errors when git knows none.
pub fn commit(root: &Path, revision: &str) -> Result<String> {
    let output = Command::new("git")
        .args(["-C"])
        .arg(root)
        .args(["rev-parse", "--verify", "--quiet", &format!("{revision}^{{commit}}")])
        .output()?;
    if !output.status.success() {
        return Err(format!("`{revision}` is neither a case nor a revision of this repository").into());
    }
    Ok(String::from_utf8(output.stdout)?.trim().to_owned())
}

/// Builds `armcal` of a revision and returns where it is. One worktree and one target folder serve all revisions, so that only
/// what changed between them is built.
pub fn built(root: &Path, folder: &Path, revision: &str) -> Result<PathBuf> {
    let commit = commit(root, revision)?;
    let tree = folder.join("tree");
    let git =
        |place: &Path, arguments: &[&str]| done(Command::new("git").arg("-C").arg(place).args(arguments));
    if tree.join(".git").exists() {
        git(&tree, &["checkout", "--quiet", "--force", "--detach", &commit])?;
    } else {
        std::fs::create_dir_all(folder)?;
        let place = tree.to_str().ok_or("the folder of the worktree is no UTF-8")?;
        git(root, &["worktree", "prune"])?;
        git(root, &["worktree", "add", "--quiet", "--force", "--detach", place, &commit])?;
    }
    eprintln!("building {revision} ({})", &commit[..12]);
    let target = folder.join("target");
    done(
        Command::new(env!("CARGO"))
            .args(["build", "--release", "--quiet", "--bin", "armcal"])
            .current_dir(&tree)
            .env("CARGO_TARGET_DIR", &target),
    )?;
    Ok(target.join("release/armcal"))
}

fn done(command: &mut Command) -> Result<()> {
    match command.status()?.success() {
        true => Ok(()),
        false => Err(format!("{command:?} failed").into()),
    }
}
