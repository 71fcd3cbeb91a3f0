use crate::support::world::{World, complaint};
use crate::support::{failing_calls, read_json, root, skip};
use std::process::{Command, Output};
use std::sync::atomic::{AtomicBool, Ordering};

/// Copies of one recording, with other names.
fn archive(world: &World, folder: &str, names: &[&str]) {
    std::fs::create_dir_all(world.path(folder)).expect("a folder");
    for name in names {
        let to = world.path(folder).join(format!("{name}.mcap"));
        std::fs::copy(root().join("fixtures/paper/normal.mcap"), to).expect("copied");
    }
}

/// How many recordings a campaign has a result of, and the others with the reason.
fn counted(world: &World, out: &str) -> (usize, Vec<(String, String)>) {
    let campaign = read_json(&world.path(out).join("campaign.json"));
    let calibrated = campaign["recordings"].as_array().expect("recordings").len();
    let text = |value: &serde_json::Value| value.as_str().unwrap_or_default().to_owned();
    let failed = campaign["failed"].as_array().expect("failed").iter();
    (calibrated, failed.map(|one| (text(&one["recording"]), text(&one["why"]))).collect())
}

#[test]
fn a_recording_that_is_shortened_while_it_is_read_costs_itself() {
    let world = World::new();
    let names = ["a", "b", "c", "d", "e", "f"];
    archive(&world, "lab", &names);
    let (path, over) = (world.path("lab/c.mcap"), AtomicBool::new(false));
    let whole = std::fs::read(&path).expect("a recording");
    std::thread::scope(|scope| {
        scope.spawn(|| {
            // The same file, shorter and whole again, at every moment of the campaigns.
            let file = std::fs::File::options().write(true).open(&path).expect("opened");
            while !over.load(Ordering::Relaxed) {
                file.set_len(20_000).expect("shortened");
                std::thread::yield_now();
                std::os::unix::fs::FileExt::write_all_at(&file, &whole, 0).expect("written");
                std::thread::sleep(std::time::Duration::from_millis(3));
            }
        });
        for round in 0..8 {
            let out = format!("campaign-{round}");
            let output = world.armcal(["batch", "lab/*.mcap", "--pipeline", "p.toml", "--out", &out]);
            let said = complaint(&output);
            if output.status.code().is_none_or(|code| code != 0 && code != 3) {
                over.store(true, Ordering::Relaxed);
                panic!("round {round}: {:?} {said}", output.status);
            }
            let (calibrated, failed) = counted(&world, &out);
            let others = failed.iter().filter(|(name, _)| name != "c").count();
            println!("round {round}: {calibrated} calibrated; {failed:?}");
            if calibrated + failed.len() != names.len() || others > 0 {
                over.store(true, Ordering::Relaxed);
                panic!("round {round}: {calibrated} calibrated, {failed:?}");
            }
        }
        over.store(true, Ordering::Relaxed);
    });
}

/// `armcal` as a user who may not read everything.
fn as_nobody(world: &World, arguments: &[&str]) -> Option<Output> {
    let program = env!("CARGO_BIN_EXE_armcal");
    let root = Command::new("id").arg("-u").output().is_ok_and(|o| o.stdout.starts_with(b"0\n"));
    let mut command = match root {
        true => {
            let mut command = Command::new("setpriv");
            command.args(["--reuid=65534", "--clear-groups", program]);
            command
        }
        false => Command::new(program),
    };
    let output = command.current_dir(world.path("")).args(arguments).output().ok()?;
    (output.status.code() != Some(127)).then_some(output)
}

#[test]
fn a_folder_that_cannot_be_read_costs_itself() {
    use std::os::unix::fs::PermissionsExt as _;
    let world = World::new();
    archive(&world, "lab/open", &["a"]);
    archive(&world, "lab/closed", &["b"]);
    let allow = |name: &str, mode| {
        let mode = std::fs::Permissions::from_mode(mode);
        std::fs::set_permissions(world.path(name), mode).expect("changed");
    };
    allow("", 0o777);
    allow("lab/closed", 0);
    for (round, pattern) in ["lab/*/*.mcap", "lab/**/*.mcap", "lab/*"].into_iter().enumerate() {
        let out = format!("campaign-{round}");
        let Some(output) =
            as_nobody(&world, &["batch", pattern, "normal.mcap", "--pipeline", "p.toml", "--out", &out])
        else {
            skip("this machine has no setpriv");
            break;
        };
        assert_eq!(output.status.code(), Some(3), "{pattern}: {}", complaint(&output));
        let (calibrated, failed) = counted(&world, &out);
        assert_eq!(calibrated, 2, "{pattern}: {failed:?}");
        assert!(
            failed.len() == 1 && failed[0].0 == "closed" && failed[0].1.contains("ermission"),
            "{pattern}: {failed:?}"
        );
    }
    allow("lab/closed", 0o755);
}

/// The files of a campaign.
fn made(world: &World, out: &str) -> [Vec<u8>; 3] {
    ["campaign.json", "campaign.html", "campaign.parquet"]
        .map(|name| std::fs::read(world.path(out).join(name)).expect("written"))
}

#[test]
fn threads_that_the_system_refuses_cost_nothing_as_long_as_there_is_one() {
    let world = World::new();
    archive(&world, "lab", &["a", "b", "c"]);
    let Some(library) = failing_calls(&world.path("fail.so")) else { return };
    let with = |fail: &str, arguments: &[&str]| {
        let mut command = world.command(arguments);
        command.env("LD_PRELOAD", &library).env("FAIL", fail).output().expect("starting armcal")
    };
    let batch = ["batch", "lab/*.mcap", "--pipeline", "p.toml", "--out"];
    world.done(&[&batch[..], &["all"]].concat());
    let refusals = (0..8).map(|n| format!("thread:{n}"));
    for fail in refusals.chain((1..4).map(|n| format!("thread:{n}-"))) {
        let output = with(&fail, &[&batch[..], &[&fail]].concat());
        assert!(output.status.code() == Some(0), "{fail}: {}", complaint(&output));
        assert!(made(&world, &fail) == made(&world, "all"), "{fail} has another result");
        let output = with(&fail, &["run", "p.toml", "--out", "run"]);
        assert!(matches!(output.status.code(), Some(0 | 3)), "{fail}: {}", complaint(&output));
    }
    let output = with("thread:0-", &["run", "p.toml", "--out", "none"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(complaint(&output).contains("starting worker threads"), "{}", complaint(&output));
}

/// One call after the other: a campaign is what it would have been, or says what is missing from it, or is none.
#[test]
fn a_read_or_a_rename_that_fails_costs_a_recording_or_the_campaign_and_is_said() {
    let world = World::new();
    archive(&world, "lab", &["a", "b", "c"]);
    let Some(library) = failing_calls(&world.path("fail.so")) else { return };
    let batch = ["batch", "lab/*.mcap", "--pipeline", "p.toml", "--jobs", "1", "--out"];
    world.done(&[&batch[..], &["all"]].concat());
    let mut ends = [0; 4];
    let reads = (0..100).step_by(2).map(|n| format!("read:{n}"));
    for fail in reads.chain((0..8).map(|n| format!("rename:{n}"))) {
        let mut command = world.command([&batch[..], &[&fail]].concat());
        let output =
            command.env("LD_PRELOAD", &library).env("FAIL", &fail).output().expect("starting armcal");
        let said = complaint(&output);
        assert!(!said.contains("panicked"), "{fail}: {said}");
        match output.status.code() {
            Some(0) => assert!(made(&world, &fail) == made(&world, "all"), "{fail} has another result"),
            Some(3) => {
                let (calibrated, failed) = counted(&world, &fail);
                assert!(failed.len() == 1 && calibrated == 2, "{fail}: {failed:?}");
                assert!(failed[0].1.contains("os error 5"), "{fail}: {failed:?}");
            }
            Some(1) => assert!(said.contains("os error 5"), "{fail}: {said}"),
            code => panic!("{fail}: {code:?} {said}"),
        }
        ends[usize::try_from(output.status.code().unwrap_or(0)).unwrap_or(0)] += 1;
    }
    println!("{ends:?} campaigns by exit code");
    assert!(ends[0] > 0 && ends[1] > 0 && ends[3] > 0, "{ends:?}: nothing was tried");
}
