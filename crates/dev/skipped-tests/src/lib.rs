//! What a test says when it cannot run on this machine, so that the end of the run can count it.
//!
//! libtest knows no skipped tests: one that returns early has passed. [`skip`] notes it in a folder beside the test
//! binaries; `tests/skipped.rs`, which cargo runs last, prints the notes of its own run. A run is told from earlier ones by
//! the process that started the test binaries: one `cargo test`.

use std::collections::BTreeMap;
use std::io::{Result, Write as _};
use std::panic::Location;
use std::path::{Path, PathBuf};

/// Folder of the notes, beside the folder of the test binaries.
const FOLDER: &str = "skipped";

/// Notes that the running test, or a part of it, cannot run here, and why. The test has to return by itself.
///
/// # Panics
/// Where the note cannot be written: a test that is skipped without being counted has failed.
#[track_caller]
pub fn skip(reason: &str) {
    let note = Note { test: running_test(Location::caller()), reason: one_line(reason) };
    // Shown for a failed test and with --nocapture.
    #[expect(clippy::print_stderr, reason = "a skipped test says so where its output is shown")]
    {
        eprintln!("SKIPPED: {}", note.reason);
    }
    let noted = notes_folder().and_then(|folder| note.write(&folder, &run_name()));
    if let Err(e) = noted {
        panic!("noting that {} is skipped ({}): {e}", note.test, note.reason);
    }
}

/// A test that was skipped.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Note {
    /// Its binary and its name.
    pub test: String,
    /// Why.
    pub reason: String,
}

impl Note {
    /// Appends the note to those of a run; tests of several processes may do so at the same time.
    ///
    /// # Errors
    /// A folder or file that cannot be written.
    pub fn write(&self, folder: &Path, run: &str) -> Result<()> {
        std::fs::create_dir_all(folder)?;
        let mut file = std::fs::File::options().append(true).create(true).open(folder.join(run))?;
        // One write to a file open for appending is whole, whoever writes beside it.
        file.write_all(format!("{}\t{}\n", self.test, self.reason).as_bytes())
    }
}

/// Takes the notes of a run out of the folder, each once, sorted; notes that runs left behind which are over, stopped by a
/// failed test, are removed uncounted.
///
/// # Errors
/// A folder that cannot be read, or notes that cannot be removed.
pub fn take_notes(folder: &Path, run: &str) -> Result<Vec<Note>> {
    let mut notes = Vec::new();
    let entries = match std::fs::read_dir(folder) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(notes),
        entries => entries?,
    };
    for entry in entries {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if name != run && is_running(&name) {
            continue;
        }
        if name == run {
            let text = std::fs::read_to_string(&path)?;
            let note = |line: &str| {
                let (test, reason) = line.split_once('\t').unwrap_or((line, ""));
                Note { test: test.to_owned(), reason: reason.to_owned() }
            };
            notes.extend(text.lines().map(note));
        }
        std::fs::remove_file(&path)?;
    }
    notes.sort();
    notes.dedup();
    Ok(notes)
}

/// The list for people: `skipped: N`, then each reason with the tests that it kept from running.
pub fn list_notes(notes: &[Note]) -> String {
    let mut by_reason: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for note in notes {
        by_reason.entry(&note.reason).or_default().push(&note.test);
    }
    let mut text = format!("skipped: {}\n", notes.len());
    for (reason, tests) in by_reason {
        text += &format!("  {reason}\n");
        tests.iter().for_each(|test| text += &format!("    {test}\n"));
    }
    text
}

/// Where the notes of this build's test binaries are.
///
/// # Errors
/// A process that does not know its own file.
pub fn notes_folder() -> Result<PathBuf> {
    let binary = std::env::current_exe()?;
    // target/debug/deps/<binary>
    let build = binary.parent().and_then(Path::parent).unwrap_or(Path::new("."));
    Ok(build.join(FOLDER))
}

/// Names the run that started this process: its process, and where the system tells, when that started, because numbers of
/// processes come again.
pub fn run_name() -> String {
    let parent = parent();
    let stat = std::fs::read_to_string(format!("/proc/{parent}/stat")).unwrap_or_default();
    // proc(5): after the command in brackets, the 20th field is the start time.
    let started = stat.rsplit_once(')').and_then(|(_, rest)| rest.split_whitespace().nth(19)).unwrap_or("0");
    format!("{parent}-{started}")
}

/// Whether the process of a run's name is there still.
fn is_running(run: &str) -> bool {
    run.split('-').next().is_some_and(|process| Path::new("/proc").join(process).exists())
}

#[cfg(unix)]
fn parent() -> u32 {
    std::os::unix::process::parent_id()
}

#[cfg(not(unix))]
fn parent() -> u32 {
    0
}

/// libtest names the thread after the test; where it runs tests on its main thread, the place stands for it.
fn running_test(place: &Location<'_>) -> String {
    let binary = std::env::current_exe().ok();
    let stem = binary.as_deref().and_then(Path::file_stem).map(|s| s.to_string_lossy().into_owned());
    // Cargo appends a hash.
    let binary = stem.map(|s| s.rsplit_once('-').map_or(s.clone(), |(name, _)| name.to_owned()));
    let test = match std::thread::current().name() {
        Some(name) if name != "main" => name.to_owned(),
        _ => format!("{}:{}", place.file(), place.line()),
    };
    format!("{} {test}", binary.unwrap_or_default())
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::{Note, list_notes, run_name, take_notes};

    fn note(test: &str, reason: &str) -> Note {
        Note { test: test.to_owned(), reason: reason.to_owned() }
    }

    #[test]
    fn notes_of_a_run_are_counted_once_and_those_of_earlier_runs_never() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let path = folder.path().join("skipped");
        note("old test", "no Python").write(&path, "999999999-1").expect("written");
        for n in [note("b", "no Slurm"), note("a", "no Python"), note("b", "no Slurm")] {
            n.write(&path, "2-1").expect("written");
        }
        let notes = take_notes(&path, "2-1").expect("read");
        assert_eq!(notes, [note("a", "no Python"), note("b", "no Slurm")]);
        assert_eq!(list_notes(&notes), "skipped: 2\n  no Python\n    a\n  no Slurm\n    b\n");
        assert!(take_notes(&path, "2-1").expect("read").is_empty());
        assert_eq!(std::fs::read_dir(&path).expect("the folder").count(), 0);
    }

    #[test]
    fn notes_written_at_the_same_time_are_all_counted() {
        let folder = tempfile::tempdir().expect("temporary folder");
        std::thread::scope(|scope| {
            for thread in 0..8 {
                let path = folder.path();
                scope.spawn(move || {
                    for i in 0..50 {
                        note(&format!("test {thread}.{i}"), "because").write(path, "r").expect("written");
                    }
                });
            }
        });
        assert_eq!(take_notes(folder.path(), "r").expect("read").len(), 400);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn notes_of_a_run_beside_this_one_stay() {
        let folder = tempfile::tempdir().expect("temporary folder");
        note("theirs", "no Python").write(folder.path(), &run_name()).expect("written");
        assert!(take_notes(folder.path(), "999999999-1").expect("read").is_empty());
        assert_eq!(take_notes(folder.path(), &run_name()).expect("read"), [note("theirs", "no Python")]);
    }

    #[test]
    fn without_a_folder_nothing_was_skipped() {
        let folder = tempfile::tempdir().expect("temporary folder");
        assert!(take_notes(&folder.path().join("none"), "r").expect("nothing").is_empty());
        assert_eq!(list_notes(&[]), "skipped: 0\n");
    }

    #[test]
    fn all_tests_of_a_process_are_of_one_run() {
        let other = std::thread::spawn(run_name).join().expect("a name");
        assert_eq!(run_name(), other);
    }
}
