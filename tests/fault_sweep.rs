use crate::damaged_inputs::as_bag;
use crate::support::failing_calls;
use crate::support::world::{Files, World};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Output;

/// Calls of each kind that are refused in a normal run; the ignored test refuses all of them, up to [`MOST`].
const FEW: u64 = 3;
const MOST: u64 = 20;

/// What SQLite makes of a read error of the disk, and of no other error: damage of the database.
const MALFORMED: &str = "disk image is malformed";
/// What the system refuses, once or from there on, with which error, and how that is worded where it is told.
const FAULTS: [(&str, &str, i32, &[&str]); 10] = [
    ("read", "", libc::EIO, &["Input/output error", "disk I/O error", MALFORMED]),
    ("read", "", libc::ESTALE, &["Stale file handle", "disk I/O error"]),
    (
        "open",
        "",
        libc::EACCES,
        &["Permission denied", "unable to open", "readonly database", "disk I/O error"],
    ),
    (
        "open",
        "",
        libc::EMFILE,
        &["Too many open files", "unable to open", "readonly database", "disk I/O error"],
    ),
    ("mmap", "", libc::ENOMEM, &["Cannot allocate memory", "disk I/O error"]),
    // Refused once, it is tried in another way.
    ("rename", "", libc::EACCES, &["Permission denied"]),
    ("rename", "-", libc::EACCES, &["Permission denied"]),
    ("write", "", libc::ENOSPC, &["No space left", "disk is full"]),
    ("fsync", "", libc::EIO, &["Input/output error", "disk I/O error"]),
    ("thread", "", libc::EAGAIN, &["Resource temporarily unavailable", "worker threads"]),
];

/// Every command that ends by itself and reads or writes files.
const READING: [&[&str]; 8] = [
    &["inspect", "normal.mcap"],
    &["inspect", "bag.db3"],
    &["diagnose", "p.toml"],
    &["diagnose", "result"],
    &["plan", "p.toml", "--effects", "backlash:1", "--dwells", "1"],
    &["compare", "result", "result", "--html", "compared.html"],
    &["check", "check.toml", "--junit", "check.xml"],
    &["transfer", "p.toml", "other.toml", "backlash:1"],
];
const WRITING: [&[&str]; 8] = [
    &["export", "p.toml", "--out", "problem.json"],
    &["extract", "normal.mcap", "--topic", "/joint_states", "--out", "thin.mcap"],
    &["init", "normal.mcap", "--dh", "arm.toml", "--board", "board.toml", "--out", "proposed.toml"],
    &["write", "result", "--as", "joint-zeros", "--out", "zeros.yaml"],
    &["compensate", "result", "targets.csv", "--out", "points.csv", "--mcap", "points.mcap"],
    &["simulate", "lab.toml", "--out", "simulated"],
    &["verify", "result", "p.toml", "--out", "verified"],
    &["reduce"],
];
const RUNNING: [&[&str]; 5] = [
    &["run", "p.toml", "--out", "made"],
    &["add", "backlash:1", "p.toml", "--out", "added", "--write", "more.toml"],
    &["pool", "p.toml", "result", "--out", "pooled"],
    &["batch", "bag.db3", "--pipeline", "p.toml", "--out", "campaign2"],
    &["map", "--shard", "1/1", "--manifest", "manifest.txt", "--pipeline", "p.toml", "--out", "campaign3"],
];

/// What a command left and said.
struct Ended {
    output: Output,
    made: Files,
    said: String,
}

struct Sweep {
    world: World,
    library: PathBuf,
    before: Files,
    tried: BTreeMap<(&'static str, Option<i32>), u32>,
}

impl Sweep {
    fn new() -> Option<Sweep> {
        let world = World::new();
        let sound = std::fs::read(world.path("normal.mcap")).expect("readable");
        let bag = as_bag(&sound, &world.path("written.db3"));
        let last = "PRAGMA journal_mode = WAL; INSERT INTO messages(topic_id, timestamp, data) \
                    SELECT topic_id, timestamp + 1, data FROM messages WHERE id = 1";
        bag.execute_batch(last).expect("a log");
        for ending in ["", "-wal"] {
            let to = world.path(format!("bag.db3{ending}"));
            std::fs::copy(world.path(format!("written.db3{ending}")), to).expect("copied");
        }
        drop(bag);
        std::fs::create_dir(world.path("tmp")).expect("a folder");
        let library = failing_calls(&world.path("fail.so"))?;
        let before = world.files();
        Some(Sweep { world, library, before, tried: BTreeMap::new() })
    }

    /// Runs a command, and takes away what it made.
    fn ends(&self, arguments: &[&str], variables: &[(&str, &str)]) -> Ended {
        let mut command = self.world.command(arguments);
        command.env("LD_PRELOAD", &self.library).env("TMPDIR", self.world.path("tmp"));
        let output = command.envs(variables.iter().copied()).output().expect("starting armcal");
        let said = [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text)).concat();
        let mut made = self.world.files();
        for (path, bytes) in &self.before {
            match made.remove(path) {
                Some(now) if now == *bytes => {}
                Some(now) => {
                    std::fs::write(path, bytes).expect("as it was");
                    made.insert(path.clone(), now);
                }
                None => panic!("{arguments:?} took {} away: {said}", path.display()),
            }
        }
        for path in made.keys().filter(|path| !self.before.contains_key(*path)) {
            std::fs::remove_file(path).expect("removed");
        }
        // A folder for temporary files that cannot be opened cannot be emptied; and what `batch` notes of its inputs, so that it need
        // not open them again, it can do without.
        let noted = |path: &Path| path.iter().any(|part| part == ".inputs");
        made.retain(|path, _| !path.starts_with(self.world.path("tmp")) && !noted(path));
        Ended { output, made, said }
    }

    fn sweep(&mut self, arguments: &[&str], most: u64) {
        let counts = self.world.path("counts");
        let counted = |sweep: &Sweep| {
            let mut sound = sweep.ends(arguments, &[("COUNT", counts.to_str().expect("a name"))]);
            let counts = sound.made.remove(&counts).expect("the library counts");
            (sound, String::from_utf8(counts).expect("text"))
        };
        let (sound, counts) = counted(self);
        assert!(matches!(sound.output.status.code(), Some(0 | 3)), "{arguments:?}: {}", sound.said);
        for (kind, on, error, words) in FAULTS {
            let line = counts.lines().find_map(|line| line.strip_prefix(kind)).expect("a count");
            let calls: u64 = line.trim().parse().expect("a number");
            let some = calls.min(most);
            for n in (0..some).map(|i| i * calls / some + (calls / some) / 2) {
                let fail = format!("{kind}:{n}{on}");
                let ended = self.ends(arguments, &[("FAIL", &fail), ("FAIL_WITH", &error.to_string())]);
                let what = format!("{arguments:?}, {fail} of {calls}, error {error}");
                self.judge(&what, words, &sound, &ended);
                *self.tried.entry((kind, ended.output.status.code())).or_default() += 1;
            }
        }
    }

    /// It did the same as ever, or it says what failed, at which file, and left nothing that is not whole.
    fn judge(&self, what: &str, words: &[&str], sound: &Ended, ended: &Ended) {
        let said = &ended.said;
        assert!(!said.contains("panicked"), "{what}: {said}");
        if let Some(part) = ended.made.keys().find(|path| path.to_string_lossy().ends_with(".part")) {
            panic!("{what}: {} is left: {said}", part.display());
        }
        // What `check` writes for a machine says that there was no check, and why.
        let tells = |bytes: &[u8]| words.iter().any(|words| String::from_utf8_lossy(bytes).contains(words));
        let whole = |(path, bytes): (&PathBuf, &Vec<u8>)| sound.made.get(path) == Some(bytes) || tells(bytes);
        let code = ended.output.status.code();
        let same = code == sound.output.status.code() && ended.output.stdout == sound.output.stdout;
        if same && ended.made == sound.made {
            return;
        }
        println!("{what}: {code:?} {}", said.lines().last().unwrap_or_default());
        // A campaign goes on without a recording; `init` proposes what did not run when it tried it.
        let goes_on = ["[\"batch", "[\"map", "[\"init"].iter().any(|command| what.starts_with(command));
        let ended_well = code == Some(1) || code == Some(3) && (goes_on || said.contains(MALFORMED));
        let told = tells(said.as_bytes()) || goes_on && ended.made.values().any(|bytes| tells(bytes));
        assert!(ended_well && told, "{what}: other results, or not a word of it: {code:?} {said}");
        let within = |path: &PathBuf| path.strip_prefix(self.world.path("")).map(Path::to_owned).ok();
        let files: Vec<PathBuf> = self.before.keys().chain(sound.made.keys()).filter_map(within).collect();
        let parts = files.iter().flat_map(|path| path.iter()).map(|part| part.to_string_lossy());
        let mut named = parts.chain(["threads".into(), "roll.mcap".into()]);
        assert!(named.any(|name| said.contains(&*name)), "{what} names no file: {said}");
        // What a campaign leaves says which recording is missing from it.
        if code == Some(1) {
            let other = ended.made.iter().find(|made| !whole(*made));
            assert!(other.is_none(), "{what}: {} is not whole: {said}", other.expect("one").0.display());
        }
    }
}

fn sweep(commands: &[&[&str]], most: u64) {
    let Some(mut sweep) = Sweep::new() else { return };
    for arguments in commands {
        sweep.sweep(arguments, most);
    }
    println!("{:?}", sweep.tried);
    let failed = sweep.tried.iter().filter(|((_, code), _)| *code == Some(1)).map(|(_, times)| times);
    assert!(failed.sum::<u32>() > 0, "nothing was refused");
}

#[test]
fn a_refused_call_of_commands_that_read_is_reported_or_harmless() {
    sweep(&READING, FEW);
}

#[test]
fn a_refused_call_of_commands_that_write_is_reported_or_harmless() {
    sweep(&WRITING, FEW);
}

#[test]
fn a_refused_call_of_commands_that_fit_is_reported_or_harmless() {
    sweep(&RUNNING, FEW);
}

#[test]
#[ignore = "minutes; `cargo test --workspace --all-features --test integration -- --ignored every_call`"]
fn every_call_that_is_refused_is_reported_or_harmless() {
    for commands in [&READING[..], &WRITING, &RUNNING] {
        sweep(commands, MOST);
    }
}
