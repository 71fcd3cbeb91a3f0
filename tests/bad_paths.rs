use crate::support::world::{INPUT, Place, Read, World, cases, complaint, reads};
use std::os::unix::fs::symlink;
use std::os::unix::net::UnixListener;
use std::path::Path;
use std::process::Command;

/// What may lie where a file belongs, and the word that names it.
const IN_PLACE: [(&str, &str); 6] = [
    ("pipe", "pipe"),
    ("socket", "socket"),
    ("device", "device"),
    ("folder", "folder"),
    ("pointer", "git lfs pull"),
    ("large", "256 MiB"),
];

/// Puts it there.
fn put(kind: &str, path: &Path) {
    let done = match kind {
        "pipe" => Command::new("mkfifo").arg(path).status().map(drop),
        // It lives on when the listener is gone.
        "socket" => UnixListener::bind(path).map(drop),
        "device" => symlink("/dev/zero", path),
        "folder" => std::fs::create_dir(path),
        "pointer" => {
            let text = "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a2146\nsize 12345\n";
            std::fs::write(path, text)
        }
        _ => std::fs::File::create(path).and_then(|file| file.set_len(1 << 40)),
    };
    done.unwrap_or_else(|e| panic!("{}: {e}", path.display()));
}

fn remove(path: &Path) {
    let _ = if path.is_dir() { std::fs::remove_dir(path) } else { std::fs::remove_file(path) };
}

/// Runs `armcal` on it, which must end at once, in words that name it and what it is.
fn named(world: &World, arguments: &[&str], name: &str, word: &str) {
    let output = world.ends(arguments);
    let said = complaint(&output) + &String::from_utf8_lossy(&output.stdout);
    let what = format!("armcal {}: {said}", arguments.join(" "));
    // A campaign goes on without it.
    let codes: &[i32] = if arguments[0] == "batch" { &[1, 3] } else { &[1] };
    assert!(output.status.code().is_some_and(|code| codes.contains(&code)), "{:?}, {what}", output.status);
    assert!(said.contains(name) && said.contains(word), "{name} is not called a {word} by {what}");
    assert!(!said.contains("panicked"), "{what}");
}

#[test]
fn no_command_reads_or_waits_for_what_is_no_file() {
    let world = World::new();
    for (kind, word) in IN_PLACE {
        for read in reads() {
            if read.read == Read::Recording && kind == "large" {
                continue;
            }
            // Of 16 MiB where people write it.
            let word = if kind == "large" { "MiB" } else { word };
            let name = format!("bad.{}", read.ending);
            put(kind, &world.path(&name));
            let arguments: Vec<&str> =
                read.arguments.iter().map(|a| if *a == INPUT { &name } else { *a }).collect();
            // A folder of results is looked into.
            let word = if kind == "folder" && read.ending != "toml" { "" } else { word };
            named(&world, &arguments, &name, word);
            remove(&world.path(&name));
        }
    }
}

/// What a pipeline, a lab file or a list of recordings names is read the same way.
#[test]
fn no_file_that_another_one_names_is_waited_for() {
    let world = World::new();
    let text = |name: &str| std::fs::read_to_string(world.path(name)).expect("a text");
    let tracked = "name = \"points\"\n[[recordings]]\npaths = [\"normal.mcap\"]\npoints = { csv = \"bad\", sigma_mm = 0.1 }\n\
                   [streams.joints]\ntopic = \"/joint_states\"\nnames = [\"joint1\", \"joint2\", \"joint3\"]\n\
                   [model]\ndh = \"arm.toml\"\n";
    let check = "[check]\nreference = \"bad\"\nmax_shift_mm = 1\nmin_dwells = 3\n";
    for (name, content) in [
        ("board.toml", text("p.toml").replace("board.toml", "bad")),
        ("arm.toml", text("p.toml").replace("arm.toml", "bad")),
        ("normal.mcap", text("p.toml").replace("normal.mcap", "bad")),
        ("points", tracked.to_owned()),
        ("reference", text("check.toml").replace("[check]\nmin_dwells = 3\n", check)),
        ("lab", text("lab.toml").replace("board.toml", "bad")),
    ] {
        world.write("naming.toml", &content);
        assert!(content.contains("bad"), "{name}");
        let arguments: &[&str] = match name {
            "reference" => &["check", "naming.toml"],
            "lab" => &["simulate", "naming.toml"],
            _ => &["run", "naming.toml"],
        };
        for (kind, word) in IN_PLACE {
            put(kind, &world.path("bad"));
            let skipped = name == "normal.mcap" && kind == "large" || name == "reference" && kind == "folder";
            if !skipped {
                named(&world, arguments, "bad", if kind == "large" { "MiB" } else { word });
            }
            remove(&world.path("bad"));
        }
    }
}

/// A folder called `s3:` is nobody's wish.
#[test]
fn no_command_writes_to_a_place_that_it_cannot_write_to() {
    let world = World::new();
    let before = world.files();
    for case in cases() {
        for url in
            ["s3://bucket/out", "gs://bucket/out", "S3://bucket/out", "https://host/out", "file:///tmp/out"]
        {
            if case.name[0] == "reduce" {
                // Its folder is where its inputs are.
                continue;
            }
            let output = world.attempt(&case, Path::new(url));
            let said = complaint(&output);
            let what = format!("armcal {} {} {url}: {said}", case.arguments.join(" "), case.option);
            assert_eq!(output.status.code(), Some(1), "{what}");
            assert!(said.contains(url) && said.contains("files of this machine only"), "{what}");
            assert!(world.files() == before, "{what} has left something");
            let left = url.split_once('/').map(|(scheme, _)| world.path(scheme).exists());
            assert_eq!(left, Some(false), "{what} has made a folder");
        }
    }
    // A folder that is called so here has a name that says so.
    world.done(&["export", "p.toml", "--out", "./here/s3:"]);
}

/// Inside a folder of results a link would lead the results somewhere else.
#[test]
fn links_in_the_folder_of_results_are_not_followed() {
    let world = World::new();
    let elsewhere = world.path("elsewhere");
    std::fs::create_dir(&elsewhere).expect("a folder");
    for case in cases() {
        let Place::Folder(names) = &case.place else { continue };
        let inner: Vec<&str> = match case.name[0] {
            "batch" | "reduce" => vec!["recordings"],
            "map" => vec!["recordings", "shards"],
            _ => vec![],
        };
        for link in
            inner.into_iter().chain(names.iter().map(String::as_str).filter(|name| !name.contains('/')))
        {
            let out = world.path("linked");
            std::fs::create_dir(&out).expect("a folder");
            if case.name[0] == "reduce" {
                let mut copy = Command::new("cp");
                copy.args(["-r", "campaign/shards", "linked"]).current_dir(world.path(""));
                assert!(copy.status().is_ok_and(|status| status.success()));
            }
            symlink(&elsewhere, out.join(link)).expect("linked");
            let output = world.attempt(&case, &out);
            let said = complaint(&output);
            let what = format!("armcal {} with {link} a link: {said}", case.arguments.join(" "));
            assert_eq!(output.status.code(), Some(1), "{what}");
            assert!(said.contains(link), "{what}");
            assert_eq!(elsewhere.read_dir().expect("a folder").count(), 0, "{what}");
            std::fs::remove_dir_all(&out).expect("removed");
        }
    }
}
