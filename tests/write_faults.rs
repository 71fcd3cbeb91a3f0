use crate::support::world::{Place, World, cases, complaint, printing};
use crate::support::{files_made, quick_pipeline, root, skip};
use clap::CommandFactory as _;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::OnceLock;
use std::time::Instant;
use tempfile::TempDir;

type Files = BTreeMap<String, Vec<u8>>;

/// Two pipelines whose results differ in every file that says anything, and those results.
struct Bench {
    folder: TempDir,
    old: Files,
    new: Files,
}

/// Made once for all tests.
static RESULTS: OnceLock<(Files, Files)> = OnceLock::new();

impl Bench {
    fn new() -> Bench {
        let bench = Bench::of(&Files::new(), &Files::new());
        // Where `view.toml` finds the pipeline depends on the folder's depth only.
        let (old, new) = RESULTS.get_or_init(|| {
            let made = |pipeline, out| files_made(&mut bench.run(pipeline), &bench.path(out));
            (made("old.toml", "first"), made("new.toml", "second"))
        });
        assert!(old.len() > 10 && old.keys().eq(new.keys()));
        Bench::of(old, new)
    }

    fn of(old: &Files, new: &Files) -> Bench {
        let folder = tempfile::tempdir().expect("temporary folder");
        let text = quick_pipeline(&root().join("fixtures/paper"));
        let other = text.replace("name = \"paper-normal\"", "name = \"other\"").replace("k = 5", "k = 4");
        assert_ne!(text, other);
        for (name, text) in [("old.toml", &text), ("new.toml", &other)] {
            std::fs::write(folder.path().join(name), text).expect("writing a pipeline");
        }
        Bench { folder, old: old.clone(), new: new.clone() }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn run(&self, pipeline: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_armcal"));
        command.arg("run").arg(self.path(pipeline)).stdout(Stdio::null()).stderr(Stdio::piped());
        command
    }

    /// A folder with the old results.
    fn out_with_old(&self) -> PathBuf {
        let out = self.path("out");
        let _ = std::fs::remove_dir_all(&out);
        std::fs::create_dir(&out).expect("output folder");
        for (name, bytes) in &self.old {
            std::fs::write(out.join(name), bytes).expect("an old result");
        }
        out
    }

    /// Every file under its name is whole: the old one or the new one. Returns how many are new.
    fn whole(&self, out: &Path, when: &str) -> usize {
        let mut new = 0;
        for (name, bytes) in shown(out) {
            let is_new = self.new.get(&name) == Some(&bytes);
            assert!(
                is_new || self.old.get(&name) == Some(&bytes),
                "{when}: {name} is neither the old nor the new"
            );
            new += usize::from(is_new && self.old.get(&name) != Some(&bytes));
        }
        new
    }
}

fn entries(out: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(out).map(|d| d.flatten().map(|e| e.path()).collect());
    entries.unwrap_or_default()
}

fn name(path: &Path) -> String {
    path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default()
}

/// The files of a folder that are not hidden.
fn shown(out: &Path) -> Files {
    let files = entries(out).into_iter().filter(|p| p.is_file() && !name(p).starts_with('.'));
    files.filter_map(|p| Some((name(&p), std::fs::read(&p).ok()?))).collect()
}

fn hidden(out: &Path) -> Vec<String> {
    entries(out).iter().map(|p| name(p)).filter(|n| n.starts_with('.')).collect()
}

/// It ended with exit code 1, and says which of its files could not be written and why.
fn refused(output: &Output, why: &str) {
    let said = String::from_utf8_lossy(&output.stderr);
    println!("{said}");
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.starts_with("error: ") && said.contains("out") && said.contains(why), "{said}");
    assert!(!said.contains("panicked"), "{said}");
}

fn is_root() -> bool {
    Command::new("id").arg("-u").output().is_ok_and(|o| o.stdout.starts_with(b"0\n"))
}

/// A folder mounted by the test itself, unmounted when dropped; `None` where the machine lets nobody mount.
struct Mounted(PathBuf);

impl Mounted {
    fn new(at: &Path, arguments: &[&str]) -> Option<Mounted> {
        let done = Command::new("mount").args(arguments).arg(at).stderr(Stdio::null()).status();
        done.is_ok_and(|s| s.success()).then(|| Mounted(at.to_owned()))
    }
}

impl Drop for Mounted {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(&self.0).status();
    }
}

#[test]
fn a_disk_that_fills_up_at_any_byte_leaves_the_old_results() {
    let bench = Bench::new();
    let old_kib: usize = bench.old.values().map(|b| b.len().div_ceil(4096) * 4).sum();
    let new_kib: usize = bench.new.values().map(|b| b.len().div_ceil(4096) * 4).sum();
    for free_kib in [0, 4, 100, new_kib / 2, new_kib - 40] {
        let out = bench.path("out");
        let _ = std::fs::create_dir(&out);
        let size = format!("size={}k", old_kib + free_kib);
        let Some(mounted) = Mounted::new(&out, &["-t", "tmpfs", "-o", &size, "tmpfs"]) else {
            skip("this machine lets nobody mount a tmpfs");
            return;
        };
        for (name, bytes) in &bench.old {
            std::fs::write(out.join(name), bytes).expect("an old result");
        }
        let output = bench.run("new.toml").arg("--out").arg(&out).output().expect("starting armcal");
        let (left, after) = (hidden(&out), shown(&out));
        drop(mounted);
        refused(&output, "No space left on device");
        assert_eq!(left, Vec::<String>::new(), "{free_kib} KiB free");
        assert!(after == bench.old, "{free_kib} KiB free: an old result changed");
    }
}

/// The same without privileges: the shell limits the size of a file and has the signal for it ignored.
#[test]
fn a_file_that_may_not_grow_leaves_the_old_results() {
    let bench = Bench::new();
    let largest = bench.new.values().map(Vec::len).max().unwrap_or_default();
    // `ulimit -f` counts 512 bytes in dash, 1024 in bash: whichever, these are too few.
    for blocks in [0, 8, largest / 2048] {
        let out = bench.out_with_old();
        let script = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" \"$@\"");
        let mut command = Command::new("sh");
        command.args(["-c", &script, env!("CARGO_BIN_EXE_armcal"), "run"]);
        let output =
            command.arg(bench.path("new.toml")).arg("--out").arg(&out).output().expect("starting sh");
        refused(&output, "File too large");
        assert!(shown(&out) == bench.old, "{blocks} blocks: an old result changed");
        assert_eq!(hidden(&out), Vec::<String>::new());
    }
}

#[test]
fn a_folder_that_may_not_be_written_is_named() {
    use std::os::unix::fs::PermissionsExt as _;
    let bench = Bench::new();
    let out = bench.out_with_old();
    std::fs::set_permissions(&out, std::fs::Permissions::from_mode(0o555)).expect("own folder");
    let mut command = bench.run("new.toml");
    let mut read_only = None;
    if is_root() {
        // Modes do not stop root; a file system mounted read-only does.
        read_only = Mounted::new(&out, &["--bind", &out.to_string_lossy()]);
        let remounted = Mounted::new(&out, &["-o", "remount,ro,bind"]).map(std::mem::forget);
        if remounted.is_none() {
            skip("root may not mount here");
            return;
        }
    }
    let output = command.arg("--out").arg(&out).output().expect("starting armcal");
    let why = if is_root() { "Read-only file system" } else { "Permission denied" };
    let after = shown(&out);
    drop(read_only);
    std::fs::set_permissions(&out, std::fs::Permissions::from_mode(0o755)).expect("own folder");
    refused(&output, why);
    assert!(after == bench.old && hidden(&out).is_empty());
}

#[test]
fn names_that_are_taken_by_folders_change_nothing() {
    let bench = Bench::new();
    for taken in ["run.mcap", "report.html", "observations.parquet"] {
        let out = bench.out_with_old();
        std::fs::remove_file(out.join(taken)).expect("an old result");
        std::fs::create_dir(out.join(taken)).expect("a folder in its place");
        let output = bench.run("new.toml").arg("--out").arg(&out).output().expect("starting armcal");
        refused(&output, taken);
        assert_eq!(bench.whole(&out, taken), 0, "{taken}: other results were replaced");
        assert_eq!(hidden(&out), Vec::<String>::new());
    }
}

#[test]
fn odd_output_folders_are_made_or_refused_by_name() {
    let bench = Bench::new();
    // A relative name without a parent, a path of folders to be made, a link to another device.
    let shm = Path::new("/dev/shm");
    let far =
        if shm.is_dir() { tempfile::tempdir_in(shm) } else { tempfile::tempdir() }.expect("temporary folder");
    std::os::unix::fs::symlink(far.path(), bench.path("link")).expect("a link");
    for out in ["out", "a/b/c", "link"] {
        let mut command = bench.run("new.toml");
        let output =
            command.current_dir(bench.folder.path()).args(["--out", out]).output().expect("starting armcal");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(matches!(output.status.code(), Some(0 | 3)), "{out}: {said}");
        let mut made = shown(&bench.path(out));
        // It says where the pipeline is as seen from the folder.
        made.remove("view.toml");
        assert!(made.iter().all(|(name, bytes)| bench.new.get(name) == Some(bytes)), "{out}");
        assert_eq!(made.len() + 1, bench.new.len(), "{out}");
    }
    std::fs::write(bench.path("file-out"), "a file").expect("a file in the way");
    for out in ["file-out", "file-out/inside"] {
        let mut command = bench.run("new.toml");
        let output =
            command.current_dir(bench.folder.path()).args(["--out", out]).output().expect("starting armcal");
        refused(&output, "file-out");
    }
    assert_eq!(std::fs::read(bench.path("file-out")).expect("still there"), b"a file");
}

/// When to kill: so many parts are begun, or so many files have their names.
#[derive(Debug, Clone, Copy)]
enum Moment {
    Begun(usize),
    Named(usize),
}
use Moment::{Begun, Named};

/// The files of a folder that are not hidden, each with what tells it from another of the same name.
fn identities(out: &Path) -> BTreeSet<(String, u64)> {
    use std::os::unix::fs::MetadataExt as _;
    let files = entries(out).into_iter().filter(|p| !name(p).starts_with('.'));
    files.filter_map(|p| Some((name(&p), p.metadata().ok()?.ino()))).collect()
}

/// Killed before, while and after files get their names; the next run makes everything whole and leaves no litter.
#[test]
fn killed_at_any_moment_results_are_whole() {
    let bench = Bench::new();
    let out = bench.out_with_old();
    let reference = Instant::now();
    let done = bench.run("new.toml").arg("--out").arg(bench.path("third")).status().expect("starting armcal");
    assert!(matches!(done.code(), Some(0 | 3)));
    let whole_run = reference.elapsed();
    // Some moments anywhere in the run, the others when so many files are begun, or have got their names.
    let moments = [
        (Begun(0), 0.1),
        (Begun(0), 0.6),
        (Begun(1), 0.0),
        (Begun(8), 0.0),
        (Begun(11), 0.0),
        (Named(1), 0.0),
        (Named(2), 0.0),
        (Named(5), 0.0),
        (Named(9), 0.0),
    ];
    for (moment, share) in moments {
        let (litter, before) = (hidden(&out), identities(&out));
        let mut child = bench.run("new.toml").arg("--out").arg(&out).spawn().expect("starting armcal");
        let started = Instant::now();
        let reached = || match moment {
            Begun(parts) => hidden(&out).iter().filter(|part| !litter.contains(part)).count() >= parts,
            Named(files) => identities(&out).difference(&before).count() >= files,
        };
        while !reached() && started.elapsed() < 20 * whole_run {
            if child.try_wait().expect("our own child").is_some() {
                break;
            }
        }
        std::thread::sleep(whole_run.mul_f64(share));
        child.kill().expect("our own child");
        child.wait().expect("our own child");
        let new = bench.whole(&out, &format!("{moment:?}, {share} of a run later"));
        println!("killed at {moment:?} + {share}: {new} new files, {} parts left", hidden(&out).len());
        assert!(shown(&out).len() == bench.old.len(), "no result is missing");
        assert!(hidden(&out).iter().all(|n| n.ends_with(".part")), "{:?}", hidden(&out));
    }
    let done = bench.run("new.toml").arg("--out").arg(&out).status().expect("starting armcal");
    assert!(matches!(done.code(), Some(0 | 3)));
    assert_eq!(hidden(&out), Vec::<String>::new(), "litter of the killed runs");
    assert_eq!(bench.whole(&out, "in the end"), changed(&bench));
}

fn changed(bench: &Bench) -> usize {
    bench.new.iter().filter(|(name, bytes)| bench.old.get(*name) != Some(*bytes)).count()
}

/// Every command prints something, and says so when nobody gets it. The page server would run on, so it is given the time
/// of a test and no more.
#[test]
fn what_cannot_be_printed_fails_every_command() {
    let world = World::new();
    let shown: BTreeSet<String> = printing().iter().map(|arguments| arguments[0].to_owned()).collect();
    for command in armcal::cli::Cli::command().get_subcommands() {
        assert!(shown.contains(command.get_name()), "`{}` is not tried", command.get_name());
    }
    for arguments in printing() {
        let full = std::fs::File::options().write(true).open("/dev/full").expect("/dev/full");
        let output = world.command(&arguments).stdout(full).output().expect("starting armcal");
        let said = complaint(&output);
        assert_eq!(output.status.code(), Some(1), "{arguments:?} > /dev/full: {said}");
        assert!(
            said.contains("printing to stdout: No space left on device"),
            "{arguments:?} > /dev/full: {said}"
        );
    }
    for arguments in
        [&["effects"][..], &["run", "p.toml", "--out", "fresh"], &["inspect", "normal.mcap"], &["--help"]]
    {
        // Nobody wants to read it, or somebody has read enough: that is no failure.
        let mut shell = Command::new("sh");
        shell
            .args(["-c", "(\"$0\" \"$@\"; echo $? >code) | true; \"$0\" \"$@\" >/dev/null || echo $? >code"]);
        shell.arg(env!("CARGO_BIN_EXE_armcal")).args(arguments).current_dir(world.path(""));
        assert!(shell.status().expect("starting sh").success());
        let code = std::fs::read_to_string(world.path("code")).expect("the exit code");
        assert_eq!(code, "0\n", "{arguments:?} | true");
    }
    // The results that a run writes to files do not depend on who reads its table.
    assert!(world.path("fresh/run.mcap").is_file());
}

/// A file beside the results that cannot be written is as bad as the results.
#[test]
fn every_output_that_cannot_be_written_is_named() {
    let world = World::new();
    std::fs::create_dir(world.path("taken")).expect("a folder in the way");
    for case in cases() {
        let _ = std::fs::remove_dir_all(world.path("out"));
        let (out, named) = match &case.place {
            Place::File => (world.path("no/such/folder/file"), "no/such/folder/file".to_owned()),
            Place::Folder(names) => {
                let out = world.path("out");
                std::fs::create_dir_all(out.join(&names[0])).expect("a folder in the way");
                (out, names[0].clone())
            }
        };
        // Its own inputs are in it.
        if case.name[0] == "reduce" {
            continue;
        }
        let output = world.attempt(&case, &out);
        let said = complaint(&output);
        assert_eq!(output.status.code(), Some(1), "{:?} to {}: {said}", case.arguments, out.display());
        assert!(said.contains(&named), "{:?} to {}: {said}", case.arguments, out.display());
    }
}
