use crate::support::{failing_calls, paper_pipeline, root};
use serde_json::json;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Longer than any time the server gives a client.
const LONG: Duration = Duration::from_secs(120);

/// `armcal view` of the paper's rig, with few open files; it ends with the test.
struct Server {
    child: Child,
    _folder: TempDir,
    host: String,
    path: String,
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Server {
    fn start(open_files: usize) -> Server {
        Server::with(open_files, &[])
    }

    fn with(open_files: usize, environment: &[(&str, &str)]) -> Server {
        let folder = tempfile::tempdir().expect("a folder");
        let pipeline = folder.path().join("p.toml");
        let text = paper_pipeline(&root().join("fixtures/paper")) + "\n[diagnosis]\nenabled = false\n";
        std::fs::write(&pipeline, text).expect("a pipeline");
        let mut child = Command::new("sh")
            .args(["-c", &format!("ulimit -n {open_files}; LD_PRELOAD=$PRELOAD exec \"$0\" view \"$1\"")])
            .args([env!("CARGO_BIN_EXE_armcal").as_ref(), pipeline.as_os_str()])
            .envs(environment.iter().copied())
            .stdout(Stdio::piped())
            .spawn()
            .expect("starting armcal view");
        let lines = BufReader::new(child.stdout.take().expect("its output")).lines();
        let address =
            lines.map_while(Result::ok).find_map(|line| Some(line.strip_prefix("Open http://")?.to_owned()));
        let address = address.expect("an address");
        let (host, path) = address.split(' ').next().and_then(|a| a.split_once('/')).expect("a path");
        let (host, path) = (host.to_owned(), path.to_owned());
        Server { child, _folder: folder, host, path }
    }

    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(&self.host).expect("connected");
        stream.set_read_timeout(Some(LONG)).expect("set");
        stream
    }

    /// Asks, and does not wait.
    fn ask(&self, what: &str, body: &str) -> TcpStream {
        let Server { host, path, .. } = self;
        let mut stream = self.connect();
        let length = body.len();
        let head = match body {
            "" => format!("GET /{path}{what} HTTP/1.1\r\nHost: {host}\r\n\r\n"),
            _ => format!(
                "POST /{path}{what} HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\n\
                 Content-Type: application/json\r\nContent-Length: {length}\r\n\r\n{body}"
            ),
        };
        stream.write_all(head.as_bytes()).expect("asked");
        stream
    }

    fn answer(&self, what: &str, body: &str) -> String {
        whole(self.ask(what, body))
    }
}

fn whole(mut stream: TcpStream) -> String {
    let mut answer = String::new();
    stream.read_to_string(&mut answer).expect("an answer");
    answer
}

#[test]
fn connections_that_say_nothing_neither_end_the_server_nor_keep_others_out() {
    let server = Server::start(48);
    // More than there are places and open files; none asks for anything, some only for half.
    let mut silent: Vec<TcpStream> = (0..150).map(|_| server.connect()).collect();
    for half in silent.iter_mut().skip(100) {
        let _ = half.write_all(b"GET / HTTP/1.1\r\nHost: ");
    }
    let body_to_come = server.ask("refit", "{}").try_clone().expect("cloned");
    drop(body_to_come);
    let page = server.answer("", "");
    assert!(page.starts_with("HTTP/1.1 200") && page.contains("</html>"), "{}", &page[..page.len().min(200)]);
    // The first is told that it took too long, or simply left alone.
    let mut rest = Vec::new();
    let _ = silent[0].read_to_end(&mut rest);
    assert!(rest.is_empty() || rest.starts_with(b"HTTP/1.1 408"), "{}", String::from_utf8_lossy(&rest));
}

#[test]
fn a_request_that_does_not_arrive_is_given_up() {
    let server = Server::start(256);
    let Server { host, path, .. } = &server;
    let mut slow = server.connect();
    let head = format!(
        "POST /{path}keep HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\nContent-Type: application/json\r\n\
         Content-Length: 9\r\n\r\n{{"
    );
    slow.write_all(head.as_bytes()).expect("begun");
    assert!(whole(slow).starts_with("HTTP/1.1 408"));
    let large = server.answer("refit", &"x".repeat(65 << 10));
    assert!(large.starts_with("HTTP/1.1 413"), "{large}");
    let many = json!({ "effects": vec!["backlash:1"; 65] }).to_string();
    for what in ["keep", "refit"] {
        let answer = server.answer(what, &many);
        assert!(answer.starts_with("HTTP/1.1 400") && answer.contains("64 at most"), "{what}: {answer}");
    }
}

#[test]
fn the_refit_of_a_client_that_left_is_stopped() {
    let server = Server::start(256);
    let effects =
        ["error_curve:1", "error_curve:2", "error_curve:3", "backlash:1", "backlash:2", "backlash:3"];
    let wanted = json!({ "effects": effects, "holdout": { "kind": "cavity-folds", "k": 18 } }).to_string();
    let timed = || {
        let begun = Instant::now();
        let answer = server.answer("refit", &wanted);
        assert!(answer.starts_with("HTTP/1.1 200"), "{}", &answer[..answer.len().min(300)]);
        begun.elapsed()
    };
    let alone = timed();
    for round in 0..2 {
        // They take all places but one, leave, and are not waited for.
        drop((0..7).map(|_| server.ask("refit", &wanted)).collect::<Vec<_>>());
        let after = timed();
        assert!(after < 5 * alone, "round {round}: {after:?} behind seven that left, {alone:?} alone");
    }
    println!("{alone:?} alone");
}

#[test]
fn a_connection_that_the_system_does_not_give_is_not_the_last() {
    let folder = tempfile::tempdir().expect("a folder");
    let Some(library) = failing_calls(&folder.path().join("fail.so")) else { return };
    let library = library.to_str().expect("a name");
    for fail in ["accept:0", "accept:1", "accept:2", "thread:3-"] {
        let server = Server::with(256, &[("PRELOAD", library), ("FAIL", fail)]);
        for round in 0..4 {
            let page = server.answer("", "");
            assert!(page.starts_with("HTTP/1.1 200"), "{fail}, {round}: {page}");
        }
    }
}
