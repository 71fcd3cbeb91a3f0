//! Recordings in a bucket of a real S3-compatible server on this machine, beside the same on disk.

use crate::support::{armcal, number, paper_pipeline, python_with, read_json, root};
use armcal::Pipeline;
use armcal_recording::{Recording, is_url, list_objects};
use serde_json::Value;
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};

const BUCKET: &str = "lab";

/// A server with one bucket; it ends with the test.
struct Store {
    process: Child,
    port: u16,
    folder: tempfile::TempDir,
}

impl Store {
    /// Starts the server with the files that `fill` puts into a folder; `None` without the Python for it, and the test is skipped.
    #[track_caller]
    fn start(fill: impl FnOnce(&Path)) -> Option<Store> {
        let python = python_with("moto.server, boto3, werkzeug, flask")?;
        let folder = tempfile::tempdir().expect("temporary folder");
        std::fs::create_dir(folder.path().join("objects")).expect("folder");
        fill(&folder.path().join("objects"));
        let mut process = Command::new(python)
            .arg(root().join("tests/python/s3_server.py"))
            .args([Path::new(BUCKET), &folder.path().join("objects"), &folder.path().join("log")])
            .env("NO_PROXY", "127.0.0.1")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("starting the server");
        let mut port = String::new();
        let stdout = process.stdout.take().expect("its stdout");
        BufReader::new(stdout).read_line(&mut port).expect("its port");
        let port = port.trim().parse().expect("the server prints its port");
        Some(Store { process, port, folder })
    }

    fn on_disk(&self, key: &str) -> PathBuf {
        self.folder.path().join("objects").join(key)
    }

    /// Points a command at the server, as a user would.
    fn reached_by<'a>(&self, command: &'a mut Command) -> &'a mut Command {
        command
            .env("AWS_ENDPOINT_URL", format!("http://127.0.0.1:{}", self.port))
            .env("AWS_ALLOW_HTTP", "true")
            .env("AWS_REGION", "us-east-1")
            .env("AWS_ACCESS_KEY_ID", "key")
            .env("AWS_SECRET_ACCESS_KEY", "secret")
            .env("NO_PROXY", "127.0.0.1")
    }

    fn armcal(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_armcal"));
        self.reached_by(command.args(arguments)).output().expect("starting armcal")
    }

    /// What the server says it sent of a key: requests answered with data, and their bytes.
    fn sent(&self, key: &str) -> (u64, u64) {
        let log = std::fs::read_to_string(self.folder.path().join("log")).expect("its log");
        let entries = log.lines().map(|line| serde_json::from_str::<Value>(line).expect("a line of JSON"));
        let of_key =
            |e: &Value| e["method"] == "GET" && e["path"] == format!("/{BUCKET}/{key}") && e["status"] == 206;
        let sizes: Vec<u64> = entries.filter(of_key).filter_map(|e| e["bytes"].as_u64()).collect();
        (sizes.len() as u64, sizes.iter().sum())
    }
}

impl Drop for Store {
    fn drop(&mut self) {
        // Its stdin ends with it, which ends it too; waiting leaves no zombie.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// The paper's normal recording with a camera whose images have chunks of their own.
fn with_camera() -> Vec<u8> {
    let recording = Recording::open(&[root().join("fixtures/paper/normal.mcap")]).expect("fixture");
    let options = mcap::WriteOptions::new().profile("ros2").compression_threads(0);
    let mut writer = options.create(std::io::Cursor::new(Vec::new())).expect("a writer into memory");
    let camera = writer.add_channel(0, "/camera", "jpeg", &Default::default()).expect("a channel");
    let (mut count, mut random) = (0_u64, 1_u64);
    recording
        .for_each_raw(&mut |m| {
            let header = |channel_id| mcap::records::MessageHeader {
                channel_id,
                sequence: m.sequence,
                log_time: m.log_ns,
                publish_time: m.publish_ns,
            };
            if count % 4000 == 0 {
                let noise = (0..800_000).map(|_| {
                    random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                    (random >> 56) as u8
                });
                writer.flush().expect("a chunk");
                writer.write_to_known_channel(&header(camera), &noise.collect::<Vec<_>>()).expect("written");
                writer.flush().expect("a chunk");
            }
            count += 1;
            let schema = m.channel.schema.as_ref().expect("a schema");
            let schema = writer.add_schema(&schema.name, &schema.encoding, &schema.data).expect("a schema");
            let (topic, encoding) = (&m.channel.topic, &m.channel.message_encoding);
            let metadata = m.channel.metadata.iter().cloned().collect();
            let id = writer.add_channel(schema, topic, encoding, &metadata).expect("a channel");
            writer.write_to_known_channel(&header(id), m.data).expect("written");
            Ok(())
        })
        .expect("nothing stops the pass");
    writer.finish().expect("finished in memory");
    writer.into_inner().into_inner()
}

/// The paper's pipeline on one recording, wherever that is.
fn pipeline_on(recording: &str, folder: &Path) -> PathBuf {
    let text = paper_pipeline(&root().join("fixtures/paper"));
    let sections = text.find("[streams").expect("its streams");
    let entry = format!("name = \"one\"\n[[recordings]]\nname = \"normal\"\npaths = [{recording:?}]\n");
    let path = folder.join(format!("{}.toml", if is_url(Path::new(recording)) { "remote" } else { "local" }));
    std::fs::write(&path, entry + &text[sections..]).expect("writing the pipeline");
    path
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&[output.stdout.as_slice(), &output.stderr].concat()).into_owned()
}

fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{e}: {}", said(output)))
}

#[test]
fn a_recording_in_a_bucket_gives_the_numbers_it_gives_on_disk() {
    let fill = |folder: &Path| {
        std::fs::create_dir(folder.join("day 1")).expect("folder");
        std::fs::write(folder.join("day 1/arm.mcap"), with_camera()).expect("written");
    };
    let Some(store) = Store::start(fill) else { return };
    let disk = store.on_disk("day 1/arm.mcap");
    let size = std::fs::metadata(&disk).expect("there").len();
    let folder = tempfile::tempdir().expect("temporary folder");
    let remote = pipeline_on("s3://lab/day 1/arm.mcap", folder.path());
    let local = pipeline_on(&disk.to_string_lossy(), folder.path());

    // What the pipeline reads: joints, tip, base, table, temperature; not the camera.
    let report = json(&store.armcal(&["inspect", &remote.to_string_lossy(), "--json"]));
    let file = &report[0]["report"]["files"][0];
    let fetched = (number(file, "/fetched/requests") as u64, number(file, "/fetched/bytes") as u64);
    println!("{} of {size} bytes fetched by {} requests", fetched.1, fetched.0);
    assert_eq!(store.sent("day 1/arm.mcap"), fetched, "the server and the report agree");
    assert!(fetched.1 < size / 4);
    assert!(file["object"]["etag"].as_str().is_some_and(|etag| !etag.is_empty()));
    let on_disk = json(&armcal(["inspect".as_ref(), local.as_os_str(), "--json".as_ref()]));
    assert_eq!(report[0]["report"]["streams"], on_disk[0]["report"]["streams"]);
    assert_eq!(
        report[0]["report"]["warnings"], on_disk[0]["report"]["warnings"],
        "nothing is said to be missing"
    );
    let counts = |report: &Value| -> Vec<Value> {
        let channels = report[0]["report"]["channels"].as_array().expect("channels");
        channels.iter().map(|c| serde_json::json!([c["topic"], c["messages"]])).collect()
    };
    assert_eq!(counts(&report), counts(&on_disk), "also those of the camera, which was not read");

    // Its own structure takes the end and the beginning of the file, and nothing more is read than is reported.
    let bare = json(&store.armcal(&["inspect", "s3://lab/day 1/arm.mcap", "--json"]));
    let bare = &bare[0]["report"];
    assert_eq!(number(bare, "/files/0/fetched/requests"), 2.0);
    assert_eq!(
        bare["channels"].as_array().map(Vec::len),
        on_disk[0]["report"]["channels"].as_array().map(Vec::len)
    );

    // The samples themselves, and the names of what is there, in a process with the store's environment.
    let mut child = Command::new(std::env::current_exe().expect("this program"));
    child.args([
        "--exact",
        "object_storage::in_a_process_that_reaches_the_store",
        "--ignored",
        "--nocapture",
    ]);
    child.env("ARMCAL_TEST_REMOTE", &remote).env("ARMCAL_TEST_LOCAL", &local);
    let output = store.reached_by(&mut child).output().expect("starting this program again");
    assert!(output.status.success(), "{}", said(&output));

    // And everything after.
    let problem = |pipeline: &Path| {
        let out = pipeline.with_extension("json");
        let output = store.armcal(&["export", &pipeline.to_string_lossy(), "--out", &out.to_string_lossy()]);
        assert!(output.status.success(), "{}", said(&output));
        read_json(&out)
    };
    assert_eq!(problem(&remote), problem(&local));
}

/// Not a test of its own: the one above runs it with its store's environment.
#[test]
#[ignore = "is run by a_recording_in_a_bucket_gives_the_numbers_it_gives_on_disk"]
fn in_a_process_that_reaches_the_store() {
    let pipeline = |variable: &str| {
        let path = std::env::var_os(variable).expect("set by the test that runs this");
        Pipeline::load(Path::new(&path)).expect("a pipeline")
    };
    let read = |pipeline: &Pipeline| {
        let path = pipeline.resolve(&pipeline.recordings[0].paths[0]);
        let recording = Recording::open(&[path]).expect("a recording");
        recording.read(&pipeline.streams).expect("its streams").0
    };
    let (remote, local) = (pipeline("ARMCAL_TEST_REMOTE"), pipeline("ARMCAL_TEST_LOCAL"));
    let (remote, local) = (read(&remote), read(&local));
    assert!(remote.joints.time_ns.len() > 1000);
    assert_eq!(remote.joints, local.joints);
    assert_eq!(remote.tip, local.tip);
    let found = |pattern: &str| list_objects(pattern).expect("a list");
    assert_eq!(found("s3://lab/*/a*.mcap"), ["s3://lab/day 1/arm.mcap"]);
    assert_eq!(found("s3://lab/**/*.mcap"), ["s3://lab/day 1/arm.mcap"]);
    assert_eq!(found("s3://lab/day 1/arm.mcap"), ["s3://lab/day 1/arm.mcap"]);
    assert!(found("s3://lab/*.mcap").is_empty(), "a star stays within one part of the key");
    let missing = list_objects("s3://no-such-bucket/*.mcap").expect_err("no bucket").to_string();
    assert!(missing.contains("no bucket \"no-such-bucket\""), "{missing}");
}

#[test]
fn a_cut_object_is_read_with_its_damage_told_and_a_busy_server_asked_again() {
    let fill = |folder: &Path| {
        let bytes = with_camera();
        std::fs::write(folder.join("cut.mcap"), &bytes[..bytes.len() / 2]).expect("written");
        std::fs::write(folder.join("flaky.mcap"), &bytes).expect("written");
        std::fs::write(folder.join("replaced.mcap"), &bytes).expect("written");
        std::fs::write(folder.join("empty.mcap"), b"").expect("written");
        std::fs::write(folder.join("other.txt"), b"certainly not a recording").expect("written");
    };
    let Some(store) = Store::start(fill) else { return };
    let output = store.armcal(&["inspect", "s3://lab/cut.mcap", "--json"]);
    assert_eq!(output.status.code(), Some(3), "{}", said(&output));
    let disk = armcal(["inspect".as_ref(), store.on_disk("cut.mcap").as_os_str(), "--json".as_ref()]);
    assert_eq!(disk.status.code(), Some(3));
    let (remote, local) = (json(&output), json(&disk));
    let (remote, local) = (&remote[0]["report"], &local[0]["report"]);
    assert_eq!(remote["channels"], local["channels"]);
    let (file, of_disk) = (&remote["files"][0], &local["files"][0]);
    assert_eq!(file["truncated_at"], of_disk["truncated_at"]);
    assert!(file["truncated_at"].is_u64());
    let told = |file: &Value| file["damaged"].as_array().expect("damage").clone();
    assert!(told(of_disk).iter().all(|damage| told(file).contains(damage)), "{file}");
    assert!(said(&output).contains("so all of it was read"));
    assert!(number(file, "/fetched/bytes") >= number(file, "/bytes"));

    let output = store.armcal(&["inspect", "s3://lab/flaky.mcap"]);
    assert!(output.status.success(), "{}", said(&output));
    let refused = [
        ("empty.mcap", "empty"),
        ("other.txt", "magic bytes"),
        ("replaced.mcap", "replaced while it was read"),
    ];
    for (key, word) in refused {
        let output = store.armcal(&["inspect", &format!("s3://lab/{key}")]);
        assert_eq!(output.status.code(), Some(1));
        assert!(said(&output).contains(word) && said(&output).contains(key), "{}", said(&output));
    }
}

#[test]
fn an_archive_in_a_bucket_gives_the_campaign_it_gives_on_disk() {
    let fill = |folder: &Path| {
        for (day, name) in [("monday", "normal"), ("tuesday", "roll")] {
            std::fs::create_dir_all(folder.join("2026").join(day)).expect("folder");
            let fixture = root().join("fixtures/paper").join(format!("{name}.mcap"));
            std::fs::copy(fixture, folder.join("2026").join(day).join("arm.mcap")).expect("copied");
        }
        std::fs::write(folder.join("2026/notes.txt"), "no recording").expect("written");
    };
    let Some(store) = Store::start(fill) else { return };
    let folder = tempfile::tempdir().expect("temporary folder");
    let at = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    let settings = format!("{}\n[diagnosis]\nenabled = false\n", paper_pipeline(Path::new("/nowhere")));
    std::fs::write(at("rig.toml"), settings).expect("pipeline");
    let batch = |inputs: &str, out: &str| {
        let output = store.armcal(&["batch", inputs, "--pipeline", &at("rig.toml"), "--out", &at(out)]);
        // Without the declared tilt the rolled board is doubtful, in the bucket as on disk.
        assert!(matches!(output.status.code(), Some(0 | 3)), "{}", said(&output));
        let rows = read_json(&folder.path().join(out).join("campaign.json"))["recordings"].clone();
        let mut rows = rows.as_array().expect("rows").clone();
        // Where a recording is and what tells it from others differ; what it says does not.
        for row in rows.iter_mut().filter_map(Value::as_object_mut) {
            for place in ["paths", "identity", "folder"] {
                row.remove(place).expect(place);
            }
        }
        (rows, said(&output))
    };
    let (remote, _) = batch("s3://lab/2026/**/*.mcap", "remote");
    let (local, _) = batch(&store.on_disk("2026/**/*.mcap").to_string_lossy(), "local");
    assert_eq!(remote.len(), 2);
    assert_eq!(remote, local);

    // A second time, one request tells that they are still the same.
    let before = store.sent("2026/monday/arm.mcap");
    let (again, said) = batch("s3://lab/2026/**/*.mcap", "remote");
    assert_eq!(again, remote);
    assert!(said.contains("2 results were there already"), "{said}");
    let after = store.sent("2026/monday/arm.mcap");
    assert!(after.0 - before.0 == 1 && after.1 - before.1 <= 256 << 10, "{before:?} {after:?}");
}

#[test]
fn what_cannot_be_read_is_named_with_what_to_do() {
    let Some(store) = Store::start(|_| ()) else { return };
    let cases = [
        ("s3://lab/missing.mcap", "no object \"missing.mcap\" in bucket \"lab\""),
        ("s3://nowhere/arm.mcap", "no bucket \"nowhere\""),
        ("s3://denied/arm.mcap", "AWS_ACCESS_KEY_ID"),
        ("s3://elsewhere/arm.mcap", "AWS_REGION"),
        ("s3://lab", "s3://BUCKET/KEY"),
        ("gs://lab/arm.mcap", "only s3://"),
    ];
    for (url, words) in cases {
        let output = store.armcal(&["inspect", url]);
        assert_eq!(output.status.code(), Some(1), "{url}");
        assert!(said(&output).contains(words) && said(&output).contains(url), "{url}: {}", said(&output));
    }
    let mut plain = Command::new(env!("CARGO_BIN_EXE_armcal"));
    let plain = store.reached_by(plain.args(["inspect", "s3://lab/arm.mcap"])).env_remove("AWS_ALLOW_HTTP");
    let output = plain.output().expect("starting armcal");
    assert!(said(&output).contains("AWS_ALLOW_HTTP=true"), "{}", said(&output));
}
