use crate::support::browser::{browser, scripted};
use crate::support::{armcal, in_one_line, paper_pipeline, read_json, root, run_pipeline};
use serde_json::Value;
use std::borrow::Cow;
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// Where screenshots are left to be looked at.
fn screenshots(name: &str) -> PathBuf {
    let folder = root().join("target/screenshots").join(name);
    std::fs::create_dir_all(&folder).expect("folder for screenshots");
    folder
}

/// A rig drawn by a seed that hides an effect, and the results of its own pipeline.
fn sealed(family: &str, folder: &Path) -> PathBuf {
    let rig = folder.join("rig");
    let how = ["simulate", "--hide", family, "--size", "medium", "--seed", "3", "--out"];
    let output = armcal(how.iter().map(Path::new).chain([rig.as_path()]));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    run_pipeline(&rig.join("pipeline.toml"), &folder.join("out"), &[0, 3]);
    folder.join("out")
}

/// The document that a page draws.
fn document(page: &Path) -> Value {
    let page = std::fs::read_to_string(page).expect("report.html");
    let begin = "<script type=\"application/json\" id=\"data\">";
    let from = page.find(begin).expect("its document") + begin.len();
    let to = from + page[from..].find("</script>").expect("its end");
    serde_json::from_str(&page[from..to]).expect("JSON")
}

#[test]
fn the_report_opens_offline_and_a_click_shows_the_numbers_of_the_summary() {
    let Some(browser) = browser() else { return };
    let folder = tempfile::tempdir().expect("temporary folder");
    run_pipeline(&root().join("pipelines/paper.toml"), folder.path(), &[0]);
    let (page, summary) = (folder.path().join("report.html"), folder.path().join("summary.json"));
    let bytes = std::fs::metadata(&page).expect("report.html").len();
    assert!(bytes < 5_000_000, "{bytes} bytes");
    println!("{}", scripted(&browser, "report.mjs", &[&page, &summary, &screenshots("paper")]));
}

#[test]
fn a_combination_is_refitted_live_and_kept() {
    let Some(browser) = browser() else { return };
    let folder = tempfile::tempdir().expect("temporary folder");
    let out = sealed("backlash+eccentricity", folder.path());
    let summary = read_json(&out.join("summary.json"));
    let effects: Vec<&str> = summary["diagnosis"]["candidates"]
        .as_array()
        .expect("candidates")
        .iter()
        .filter_map(|c| c["spec"].as_str())
        .filter(|spec| spec.starts_with("backlash:") || spec.starts_with("eccentricity:"))
        .filter(|spec| !spec.contains('+'))
        .collect();
    let first = |kind: &str| *effects.iter().find(|e| e.starts_with(kind)).expect("a candidate of that kind");
    let pair = [first("backlash"), first("eccentricity")];

    let (_server, address) = view(&out);
    let name = format!("pipeline+{}+{}.toml", pair[0], pair[1]).replace(':', "-");
    let kept = folder.path().join("rig").join(name);
    let shots = screenshots("view");
    let arguments = [
        Path::new(&address),
        &out.join("summary.json"),
        &kept,
        &shots,
        Path::new(pair[0]),
        Path::new(pair[1]),
    ];
    println!("{}", scripted(&browser, "view.mjs", &arguments));

    // What was kept is a pipeline that stands on its own.
    let again = run_pipeline(&kept, &folder.path().join("again"), &[0, 3]);
    let effects = again["fit"]["effects"].as_array().expect("effects");
    assert!(pair.iter().all(|e| effects.iter().any(|own| own == e)), "{effects:?}");
}

#[test]
fn a_comparison_is_a_page_too() {
    let Some(browser) = browser() else { return };
    let folder = tempfile::tempdir().expect("temporary folder");
    let crippled = folder.path().join("crippled.toml");
    let fixed = "\n[[parameters]]\nname = \"joint?.a\"\nfree = false\n[diagnosis]\nenabled = false\n";
    std::fs::write(&crippled, paper_pipeline(&root().join("fixtures/paper")) + fixed).expect("pipeline");
    let (a, b) = (folder.path().join("a"), folder.path().join("b"));
    run_pipeline(&crippled, &a, &[0, 3]);
    run_pipeline(&root().join("pipelines/paper.toml"), &b, &[0]);
    let page = folder.path().join("compare.html");
    let output = armcal([Path::new("compare"), &a, &b, Path::new("--json"), Path::new("--html"), &page]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let json = folder.path().join("compare.json");
    std::fs::write(&json, &output.stdout).expect("JSON");
    println!("{}", scripted(&browser, "compare.mjs", &[&page, &json, &screenshots("compare")]));
}

#[test]
fn two_arms_have_the_page_and_it_says_what_the_terminal_says() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let out = folder.path().join("out");
    let arguments = [Path::new("run"), &root().join("pipelines/two-arms.toml"), Path::new("--out"), &out];
    let output = armcal(arguments.map(Path::as_os_str));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    says_the_same(&out, &String::from_utf8_lossy(&output.stdout));
}

/// One recording of the pool stands elsewhere than declared: geometry of three boards cannot explain it.
#[test]
fn a_pool_that_errs_above_twice_the_floor_is_inadequate_on_its_page_and_in_the_terminal() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path();
    let rig = path.join("rig");
    let how = ["simulate", "--hide", "frame_shift", "--size", "medium", "--seed", "3", "--out"];
    let output = armcal(how.iter().map(Path::new).chain([rig.as_path()]));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = std::fs::read_to_string(rig.join("pipeline.toml")).expect("pipeline");
    let begin = text.find("[[recordings]]").expect("recordings");
    let (recordings, rest) = text[begin..].split_once("[streams.joints]").expect("streams");
    for (at, recording) in recordings.split("[[recordings]]").skip(1).enumerate() {
        let own = rig.join(format!("{at}.toml"));
        let pipeline = format!(
            "{}[[recordings]]{recording}[streams.joints]{rest}\n[diagnosis]\nenabled = false\n",
            &text[..begin]
        );
        std::fs::write(&own, pipeline).expect("pipeline");
        run_pipeline(&own, &path.join("runs").join(at.to_string()), &[0]);
    }
    let out = path.join("pool");
    // One screen has no room for every step that the page has.
    let told = [
        Path::new("pool"),
        Path::new("-v"),
        &rig.join("0.toml"),
        &path.join("runs"),
        Path::new("--out"),
        &out,
    ];
    let output = armcal(told.map(Path::as_os_str));
    assert_eq!(output.status.code(), Some(3), "{}", String::from_utf8_lossy(&output.stderr));
    says_the_same(&out, &String::from_utf8_lossy(&output.stdout));
    let result = read_json(&out.join("pool.json"));
    let warnings = result["warnings"].as_array().expect("warnings");
    assert!(warnings.iter().any(|w| w["severity"] == "inadequate"), "{warnings:#?}");
    // With its diagnosis, that of a run: what moved between the recordings shows in all of them together.
    let (found, page) = (path.join("found"), rig.join("pipeline.toml"));
    let told = [Path::new("pool"), Path::new("-v"), &page, &path.join("runs"), Path::new("--out"), &found];
    let output = armcal(told.map(Path::as_os_str));
    let terminal = String::from_utf8_lossy(&output.stdout);
    says_the_same(&found, &terminal);
    assert!(terminal.contains("frame_shift") && !terminal.contains("armcal add"), "{terminal}");
    let page = std::fs::read_to_string(found.join("report.html")).expect("report.html");
    assert_eq!(
        page.matches("On recordings that it never saw").count(),
        2,
        "as it opens, and for its scripts"
    );
    let Some(browser) = browser() else { return };
    let files = [found.join("report.html"), found.join("summary.json"), screenshots("pool")];
    println!("{}", scripted(&browser, "report.mjs", &files.each_ref().map(PathBuf::as_path)));
}

/// Headline, status and steps of a page are in the text of the terminal.
fn says_the_same(out: &Path, terminal: &str) {
    let flat = |text: &str| {
        let plain = ["&#60;<", "&#62;>", "&#38;&", "&#39;'", "&#34;\""]
            .iter()
            .fold(text.to_owned(), |text, pair| text.replace(&pair[..5], &pair[5..]));
        in_one_line(&plain)
    };
    let page = std::fs::read_to_string(out.join("report.html")).expect("report.html");
    let header = page.split_once("</header>").expect("a header").0;
    let terminal = flat(terminal);
    let mut told = 0;
    for (begin, end) in
        [("<h1 id=\"verdict\"", "</h1>"), ("<p id=\"status\"", "</p>"), ("<strong>Next:</strong>", "</li>")]
    {
        for part in header.split(begin).skip(1) {
            let words = part.split_once(end).expect("its end").0.trim_start();
            let words = flat(
                words
                    .split_once('>')
                    .filter(|_| begin.starts_with("<h") || begin.starts_with("<p"))
                    .map_or(words, |w| w.1),
            );
            assert!(terminal.contains(&words), "{words:?} is not in {terminal}");
            told += 1;
        }
    }
    assert!(told >= 3, "headline, status and next step: {told}");
}

/// A server that ends with the test.
struct Server(Child);

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Starts `armcal view` and waits for its address.
fn view(out: &Path) -> (Server, String) {
    let mut child = Command::new(env!("CARGO_BIN_EXE_armcal"))
        .arg("view")
        .arg(out)
        .stdout(Stdio::piped())
        .spawn()
        .expect("starting armcal view");
    let lines = BufReader::new(child.stdout.take().expect("its output")).lines();
    let server = Server(child);
    for line in lines {
        let line = line.expect("a line of text");
        if let Some(address) = line.strip_prefix("Open ").and_then(|rest| rest.split(' ').next()) {
            return (server, address.to_owned());
        }
    }
    panic!("armcal view ended without an address");
}

/// Asks the server as a program would that is no browser: `Some(body)` where it answers 200.
fn ask(request: &str, port: &str) -> String {
    use std::io::{Read as _, Write as _};
    let mut stream = std::net::TcpStream::connect(format!("127.0.0.1:{port}")).expect("connecting");
    stream.write_all(request.as_bytes()).expect("asking");
    let mut answer = String::new();
    stream.read_to_string(&mut answer).expect("an answer in UTF-8");
    answer
}

#[test]
fn the_live_page_answers_to_its_own_address_only() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let out = folder.path().join("out");
    run_pipeline(&root().join("pipelines/paper.toml"), &out, &[0]);
    let (_server, address) = view(&out);
    let (host, path) = address.strip_prefix("http://").and_then(|a| a.split_once('/')).expect("an address");
    let port = host.rsplit(':').next().expect("a port");
    let get = |host: &str, path: &str| {
        ask(&format!("GET /{path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n"), port)
    };
    assert!(get(host, path).starts_with("HTTP/1.1 200"));
    assert!(get(&format!("rebound.example:{port}"), path).starts_with("HTTP/1.1 403"), "DNS rebinding");
    assert!(get(host, "").starts_with("HTTP/1.1 404"), "the secret is needed");
    assert!(get(host, "0123456789abcdef/").starts_with("HTTP/1.1 404"));
    let post = |origin: &str, body: &str| {
        let length = body.len();
        ask(
            &format!(
                "POST /{path}keep HTTP/1.1\r\nHost: {host}\r\nOrigin: {origin}\r\nContent-Type: application/json\r\n\
                 Content-Length: {length}\r\nConnection: close\r\n\r\n{body}"
            ),
            port,
        )
    };
    let effect = "{\"effects\":[\"backlash:1\"]}";
    assert!(post("http://evil.example", effect).starts_with("HTTP/1.1 403"));
    let written = root().join("pipelines/paper+backlash-1.toml");
    assert!(!written.exists(), "another page made it write {}", written.display());
    for nonsense in
        ["", "{", "{\"effects\":[\"nonsense:9\"]}", "{\"effects\":[\"backlash:99\"]}", "{\"else\":1}"]
    {
        let answer = post(&format!("http://{host}"), nonsense);
        assert!(answer.starts_with("HTTP/1.1 4") && answer.contains("\"error\""), "{nonsense}: {answer}");
    }
}

/// Whoever names things in a recording, or in the files beside it, gets text.
#[test]
fn hostile_names_stay_text() {
    let folder = tempfile::tempdir().expect("temporary folder");
    // The same length as the names in the recording's messages, which are replaced in place.
    let joints = ["\"><b>1", "\"><b>2", "\"><b>3"];
    let topic = "/../<img src=x onerror=globalThis.pwned=1>/tip";
    let recording = "</script><script>globalThis.pwned = 2</script>";
    let cavity = "../../<svg onload='globalThis.pwned = 3'>";
    for name in ["normal", "roll", "pitch"] {
        let file = format!("{name}.mcap");
        let bytes = std::fs::read(root().join("fixtures/paper").join(&file)).expect("fixture");
        let renamed = std::fs::File::create(folder.path().join(&file)).expect("copy");
        let mut writer = mcap::Writer::new(renamed).expect("copy");
        for message in mcap::MessageStream::new(&bytes).expect("fixture") {
            let mut message = message.expect("message");
            let mut channel = (*message.channel).clone();
            if channel.topic == "/vicon/tip/tip" {
                channel.topic = topic.into();
            }
            if channel.topic == "/joint_states" {
                let mut data = message.data.to_vec();
                for (k, joint) in joints.iter().enumerate() {
                    replace(&mut data, format!("joint{}", k + 1).as_bytes(), joint.as_bytes());
                }
                message.data = Cow::Owned(data);
            }
            message.channel = std::sync::Arc::new(channel);
            writer.write(&message).expect("copy");
        }
        writer.finish().expect("copy");
    }
    let copied = |from: &str, changes: &[(&str, &str)]| {
        let from = root().join("pipelines").join(from);
        let mut text = std::fs::read_to_string(&from).expect("a file of the pipeline");
        for (old, new) in changes {
            assert!(text.contains(old), "no {old} in {}", from.display());
            text = text.replacen(old, new, 1);
        }
        let to = folder.path().join(from.file_name().expect("name"));
        std::fs::write(&to, text).expect("copy");
        to
    };
    let dh =
        copied("models/right_arm.toml", &[("name = \"joint2\"", "name = '<a href=javascript:0>elbow</a>'")]);
    let board = copied("boards/paper.toml", &[("name = \"circle01\"", &format!("name = \"{cavity}\""))]);
    let quoted = joints.map(|j| format!("'{j}'")).join(", ");
    let text = paper_pipeline(folder.path())
        .replace("\"joint1\", \"joint2\", \"joint3\"", &quoted)
        .replace("/vicon/tip/tip", topic)
        .replacen("[[recordings]]", &format!("[[recordings]]\nname = \"{recording}\""), 1)
        .replace(
            &format!("{}/models/right_arm.toml", root().join("pipelines").display()),
            &dh.to_string_lossy(),
        )
        .replace(
            &format!("{}/boards/paper.toml", root().join("pipelines").display()),
            &board.to_string_lossy(),
        );
    let pipeline = folder.path().join("pipeline.toml");
    std::fs::write(&pipeline, text).expect("pipeline");
    let out = folder.path().join("out");
    run_pipeline(&pipeline, &out, &[0]);

    let Some(browser) = browser() else { return };
    let names = [topic, recording, cavity, "<a href=javascript:0>elbow</a>"].map(Path::new);
    let page = out.join("report.html");
    let arguments: Vec<&Path> = [page.as_path()].into_iter().chain(names).collect();
    println!("{}", scripted(&browser, "hostile.mjs", &arguments));
}

fn replace(data: &mut [u8], from: &[u8], to: &[u8]) {
    assert_eq!(from.len(), to.len());
    for at in 0..=data.len().saturating_sub(from.len()) {
        if data[at..].starts_with(from) {
            data[at..at + to.len()].copy_from_slice(to);
        }
    }
}

/// What the page draws of the effect it found: its channel and driver, and by direction of arrival how the mean of what is
/// measured there runs along the driver.
#[test]
fn each_family_shows_its_own_shape() {
    for (family, channels, drivers) in [
        ("backlash", "joint", &["q1", "q2", "q3"][..]),
        ("compliance", "joint", &["tau1", "tau2", "tau3"]),
        ("eccentricity", "joint", &["q1", "q2", "q3"]),
        ("thermal_growth", "lengths", &["temperature", "time"]),
        // The temperature, too, is another in every recording.
        ("frame_shift", "world", &["time"]),
    ] {
        let folder = tempfile::tempdir().expect("temporary folder");
        let document = document(&sealed(family, folder.path()).join("report.html"));
        let last = document["path"].as_array().expect("path").last().and_then(Value::as_u64).expect("a step");
        let signature = &document["refits"][last as usize]["signatures"][0];
        let channel = &document["channels"][signature["channel"].as_u64().expect("channel") as usize]["key"];
        let driver = signature["driver"].as_str().expect("driver");
        println!(
            "{family}: {} seen at {channel} over {driver}, {} of it",
            signature["effect"], signature["share"]
        );
        assert!(channel.as_str().expect("key").starts_with(channels), "{family} at {channel}");
        assert!(drivers.contains(&driver), "{family} over {driver}");

        let means = |direction: Option<i64>| -> Vec<f64> {
            let bands = signature["bands"].as_array().expect("bands").iter();
            let own = bands.filter(|b| b["direction"].as_i64() == direction);
            own.flat_map(|b| b["mean"].as_array().expect("means")).filter_map(Value::as_f64).collect()
        };
        let (up, down) = (means(Some(1)), means(Some(-1)));
        let all: Vec<f64> = means(None).into_iter().chain(up.iter().chain(&down).copied()).collect();
        let (low, high) = extremes(&all);
        if family == "backlash" {
            // Two branches that do not touch.
            assert!(extremes(&up).1 < extremes(&down).0, "{up:?} {down:?}");
        } else {
            // One curve: it moves along the driver by far more than the directions differ.
            let gap = mean(&up) - mean(&down);
            assert!(up.is_empty() || gap.abs() < 0.3 * (high - low), "{family}: {gap} of {}", high - low);
        }
    }
}

fn extremes(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)))
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
