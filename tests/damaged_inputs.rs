use crate::support::world::World;
use armcal::cli::Cli;
use clap::CommandFactory as _;
use rusqlite::Connection;
use std::collections::BTreeSet;
use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Output, Stdio};

/// The recording that is damaged, as the commands name it.
const RECORDING: &str = "normal.mcap";

/// Every command that reads a recording, or a result that was made of one; `lossy` holds the result of a run.
const READ: [&[&str]; 16] = [
    &["inspect", RECORDING],
    &["extract", RECORDING, "--topic", "/joint_states", "--out", "thin.mcap"],
    &["init", RECORDING, "--dh", "arm.toml", "--board", "board.toml", "--force", "--out", "proposed.toml"],
    &["run", "p.toml", "--out", "lossy"],
    &["diagnose", "p.toml"],
    &["diagnose", "lossy"],
    &["plan", "p.toml", "--effects", "backlash:1", "--dwells", "1"],
    &["export", "p.toml", "--out", "problem.json"],
    &["add", "backlash:1", "p.toml", "--out", "added", "--write", "more.toml"],
    &["check", "check.toml"],
    &["verify", "result", "p.toml"],
    &["transfer", "p.toml", "other.toml", "backlash:1"],
    &["batch", RECORDING, "--pipeline", "p.toml", "--out", "campaign2"],
    &["map", "--shard", "1/1", "--manifest", "manifest.txt", "--pipeline", "p.toml", "--out", "campaign3"],
    &["reduce", "campaign3"],
    &["pool", "p.toml", "lossy", "--out", "pooled"],
];
/// The others, and `view`, which does not end by itself.
const NO_RECORDING: [&str; 8] =
    ["compare", "compensate", "completions", "effects", "man", "simulate", "write", "view"];

/// A kind of damage, and what it makes of the sound recording.
type Damage = (&'static str, fn(&[u8], &Path));

const DAMAGE: [Damage; 6] = [
    ("a chunk becomes a footer by one bit", |sound, path| {
        let chunk = chunks(sound)[1];
        written(path, sound, |bytes| bytes[chunk] ^= 4);
    }),
    ("so does the last one", |sound, path| {
        let chunk = *chunks(sound).last().expect("chunks");
        written(path, sound, |bytes| bytes[chunk] ^= 4);
    }),
    ("one bit of a message", |sound, path| {
        let all = chunks(sound);
        let middle = (all[1] + all[2]) / 2;
        written(path, sound, |bytes| bytes[middle] ^= 0x10);
    }),
    ("bytes behind the end", |sound, path| written(path, sound, |bytes| bytes.extend([0; 7]))),
    ("the last bytes are missing", |sound, path| {
        written(path, sound, |bytes| bytes.truncate(sound.len() - 100))
    }),
    ("rows of a bag are deleted", |sound, path| {
        std::fs::remove_file(path).expect("removed");
        let database = as_bag(sound, path);
        database.execute("DELETE FROM messages WHERE id % 9 = 4", []).expect("deleted");
    }),
];

fn written(path: &Path, sound: &[u8], change: impl FnOnce(&mut Vec<u8>)) {
    let mut bytes = sound.to_vec();
    change(&mut bytes);
    std::fs::write(path, bytes).expect("written");
}

fn chunks(sound: &[u8]) -> Vec<usize> {
    let summary = mcap::Summary::read(sound).expect("sound").expect("a summary");
    let mut starts: Vec<usize> =
        summary.chunk_indexes.iter().map(|chunk| chunk.chunk_start_offset as usize).collect();
    starts.sort_unstable();
    assert!(starts.len() > 2);
    starts
}

/// The messages as rosbag2 stores them. What a file is decides, and not what it is called.
pub fn as_bag(sound: &[u8], path: &Path) -> Connection {
    let database = Connection::open(path).expect("a database");
    let tables = "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, \
                  serialization_format TEXT NOT NULL); \
                  CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, \
                  data BLOB NOT NULL); BEGIN";
    database.execute_batch(tables).expect("tables");
    let mut topics = Vec::new();
    for message in mcap::MessageStream::new(sound).expect("sound") {
        let message = message.expect("sound");
        let topic = message.channel.topic.clone();
        let id = topics.iter().position(|known| *known == topic).unwrap_or_else(|| {
            let kind = message.channel.schema.as_ref().expect("a schema").name.clone();
            let row = (topics.len() as i64, &topic, kind);
            database.execute("INSERT INTO topics VALUES(?, ?, ?, 'cdr')", row).expect("inserted");
            topics.push(topic.clone());
            topics.len() - 1
        });
        let row = (id as i64, message.log_time as i64, message.data.to_vec());
        let insert = "INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)";
        database.execute(insert, row).expect("inserted");
    }
    database.execute_batch("COMMIT").expect("stored");
    database
}

fn said(output: &Output) -> String {
    [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text)).concat()
}

/// A new command must be tried here, or be known to read no recording.
#[test]
fn every_command_is_tried_or_reads_no_recording() {
    let tried = READ.iter().map(|arguments| arguments[0]).chain(NO_RECORDING);
    let tried: BTreeSet<String> = tried.map(str::to_owned).collect();
    let typed: BTreeSet<String> = Cli::command().get_subcommands().map(|c| c.get_name().to_owned()).collect();
    assert_eq!(typed, tried);
}

/// Whatever is damaged, every command that reads it says that data were lost, and ends with exit code 3.
#[test]
fn no_command_is_silent_about_lost_data() {
    let world = World::new();
    let path = world.path(RECORDING);
    let sound = std::fs::read(&path).expect("readable");
    let words = |output: &Output| {
        let said = said(output);
        ["data lost", "data_lost", "damaged", "data were lost", "warning: normal.mcap: at byte"]
            .iter()
            .any(|words| said.contains(words))
    };
    for arguments in READ.iter().filter(|a| !a.contains(&"lossy") && a[0] != "reduce") {
        let output = world.armcal(*arguments);
        assert!(!words(&output), "sound: {arguments:?}: {}", said(&output));
    }
    for (kind, damage) in DAMAGE {
        damage(&sound, &path);
        for arguments in READ {
            let output = world.armcal(arguments);
            assert_eq!(output.status.code(), Some(3), "{kind}: {arguments:?}: {}", said(&output));
            assert!(words(&output), "{kind}: {arguments:?}: {}", said(&output));
        }
        for campaign in ["campaign2", "campaign3", "lossy", "added", "pooled"] {
            std::fs::remove_dir_all(world.path(campaign)).expect("removed");
        }
        std::fs::remove_file(world.path("more.toml")).expect("removed");
    }
    // The page is served until somebody ends it.
    let view = world.command(["view", "p.toml"]).stdout(Stdio::null()).stderr(Stdio::piped()).spawn();
    let mut view = view.expect("starting armcal");
    let lines = BufReader::new(view.stderr.take().expect("stderr")).lines();
    let told = lines.map_while(Result::ok).find(|line| line.contains("data lost"));
    view.kill().and_then(|()| view.wait()).expect("ended");
    assert!(told.is_some_and(|line| line.contains(RECORDING)));
}

/// Results made before a log beside a database grew are made again.
#[test]
fn results_are_of_the_log_that_was_read() {
    let world = World::new();
    let sound = std::fs::read(world.path(RECORDING)).expect("readable");
    std::fs::remove_file(world.path(RECORDING)).expect("removed");
    let database = as_bag(&sound, &world.path("bag.db3"));
    let mode: String =
        database.query_row("PRAGMA journal_mode = WAL", [], |row| row.get(0)).expect("a log beside it");
    assert_eq!(mode, "wal");
    let reused = || {
        let output = world.armcal(["batch", "bag.db3", "--pipeline", "p.toml", "--out", "campaign4"]);
        assert!(matches!(output.status.code(), Some(0 | 3)), "{}", said(&output));
        said(&output).contains("results were there already")
    };
    assert!(!reused() && reused());
    let again = "INSERT INTO messages(topic_id, timestamp, data) SELECT topic_id, timestamp + 1, data FROM messages WHERE id = 1";
    database.execute(again, []).expect("written to the log");
    assert!(!reused() && reused());
}
