use crate::support::slurm::slurm;
use crate::support::{armcal, paper_pipeline, python_with, read_json, root, shipped, simulate};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::Duration;
use tempfile::TempDir;

/// An archive: a folder with recordings, a manifest and a pipeline.
struct Archive {
    folder: TempDir,
}

impl Archive {
    /// The shipped recordings, each under several names, and one that is no recording. Names make them different work.
    fn shipped(copies: usize) -> Archive {
        let archive = Archive { folder: tempfile::tempdir().expect("temporary folder") };
        archive.write_pipeline();
        let mut manifest = "pipeline = \"rig.toml\"\n".to_owned();
        for copy in 0..copies {
            for (name, tilt) in [
                ("normal", ""),
                ("roll", "tilt = { roll_deg = 11.7 }"),
                ("pitch", "tilt = { pitch_deg = 11.8 }"),
            ] {
                let path = root().join("fixtures/paper").join(format!("{name}.mcap"));
                manifest.push_str(&format!(
                    "[[recordings]]\nname = \"{copy}/{name}\"\npaths = [\"{}\"]\n{tilt}\n",
                    path.display()
                ));
            }
        }
        std::fs::write(archive.path("broken.mcap"), "no recording").expect("written");
        manifest.push_str("[[recordings]]\npaths = [\"broken.mcap\"]\n");
        std::fs::write(archive.path("manifest.toml"), manifest).expect("written");
        archive
    }

    /// The paper's pipeline without diagnosis, which is another test's question.
    fn write_pipeline(&self) {
        let shipped = paper_pipeline(Path::new("/nowhere"));
        let text = format!("{shipped}\n[diagnosis]\nenabled = false\n");
        std::fs::write(self.path("rig.toml"), text).expect("pipeline");
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn batch(&self, out: &str) -> Output {
        armcal([Path::new("batch"), &self.path("manifest.toml"), Path::new("--out"), &self.path(out)])
    }

    fn map(&self, out: &str, shard: &str) -> Output {
        let arg = Path::new;
        let (manifest, out) = (self.path("manifest.toml"), self.path(out));
        armcal([arg("map"), arg("--manifest"), &manifest, arg("--shard"), arg(shard), arg("--out"), &out])
    }

    /// Starts batches and kills each (SIGKILL) after so long; whatever is there then must be as in the `whole`. Returns
    /// how many results there are in the end.
    fn kill_at(
        &self,
        moments: impl Iterator<Item = Duration>,
        out: &str,
        whole: &BTreeMap<String, Vec<u8>>,
    ) -> usize {
        let mut survived = 0;
        for moment in moments {
            let mut batch = Command::new(env!("CARGO_BIN_EXE_armcal"))
                .arg("batch")
                .args([&self.path("manifest.toml"), Path::new("--out"), &self.path(out)])
                .stdout(Stdio::null())
                .stderr(Stdio::null())
                .spawn()
                .expect("starting armcal");
            std::thread::sleep(moment);
            batch.kill().expect("SIGKILL");
            batch.wait().expect("its end");
            let mut partial = if self.path(out).is_dir() { self.results(out) } else { BTreeMap::new() };
            // Unfinished folders are named as such; everything else must be whole.
            partial.retain(|name, _| !name.contains(".part"));
            survived = partial.keys().filter(|name| name.ends_with("row.json")).count();
            for (name, bytes) in &partial {
                assert!(bytes == &whole[name], "{name} is half or wrong after a kill");
            }
        }
        survived
    }

    fn reduce(&self, out: &str) -> Output {
        armcal([Path::new("reduce"), &self.path(out)])
    }

    /// Everything that is a result, by path.
    fn results(&self, out: &str) -> BTreeMap<String, Vec<u8>> {
        let mut found = BTreeMap::new();
        collect(&self.path(out), "", &mut found);
        // Receipts say how the work was shared, logs what the machines said.
        found.retain(|name, _| !name.starts_with("shards/") && !name.starts_with("log/"));
        found
    }
}

/// Files below a folder; what is remembered about inputs and the gate of the store are no results.
fn collect(folder: &Path, below: &str, found: &mut BTreeMap<String, Vec<u8>>) {
    for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let path = entry.path();
        match (name.as_str(), path.is_dir()) {
            (".inputs" | ".gate", _) => {}
            (_, true) => collect(&path, &format!("{below}{name}/"), found),
            (_, false) => drop(found.insert(format!("{below}{name}"), std::fs::read(path).expect("a file"))),
        }
    }
}

fn assert_same(one: &BTreeMap<String, Vec<u8>>, other: &BTreeMap<String, Vec<u8>>) {
    assert_eq!(one.keys().collect::<Vec<_>>(), other.keys().collect::<Vec<_>>());
    for (name, bytes) in one {
        assert!(bytes == &other[name], "{name} differs");
    }
}

fn expect(output: &Output, code: i32) -> String {
    let said =
        format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert_eq!(output.status.code(), Some(code), "{said}");
    said
}

#[test]
fn killed_at_any_moment_it_goes_on_and_ends_in_the_same_bytes() {
    let archive = Archive::shipped(4);
    let start = std::time::Instant::now();
    let said = expect(&archive.batch("undisturbed"), 3);
    let undisturbed = start.elapsed();
    assert!(said.contains("12 of 13 recordings calibrated"), "{said}");
    assert!(said.contains("broken: "), "{said}");
    let whole = archive.results("undisturbed");
    assert_eq!(whole.len(), 3 + 12 * 5, "{:?}", whole.keys());
    // Odd moments, from the first file on to a quarter of the work, so that the turns together do not finish.
    let moments = (0..8).map(|kill| undisturbed.mul_f64(0.02 + 0.033 * f64::from(kill)));
    let survived = archive.kill_at(moments, "killed", &whole);
    println!("{survived} of 12 results survived the kills");
    let said = expect(&archive.batch("killed"), 3);
    assert!(survived == 0 || said.contains(&format!("{survived} results were there already")), "{said}");
    assert_same(&whole, &archive.results("killed"));
    let again = expect(&archive.batch("killed"), 3);
    assert!(again.contains("12 results were there already"), "{again}");
}

#[test]
#[ignore = "a thousand recordings: eight minutes on two cores"]
fn a_thousand_recordings_killed_ten_times() {
    let archive = Archive { folder: tempfile::tempdir().expect("temporary folder") };
    archive.write_pipeline();
    let lab = archive.path("lab");
    std::fs::create_dir(&lab).expect("a folder");
    // A lab keeps a session in memory: twenty of them.
    (0..20).for_each(|k| sessions(&lab, 100 + k, 50 * k..50 * k + 50, DAY_S, ""));
    let recordings = (0..1000).map(|number| format!("lab/week{number:02}.mcap\n"));
    let manifest = format!(
        "pipeline = \"rig.toml\"\n{}",
        recordings.map(|r| format!("[[recordings]]\npaths = [\"{}\"]\n", r.trim())).collect::<String>()
    );
    std::fs::write(archive.path("manifest.toml"), manifest).expect("written");
    let start = std::time::Instant::now();
    expect(&archive.batch("undisturbed"), 0);
    let undisturbed = start.elapsed();
    let whole = archive.results("undisturbed");
    // At random within a tenth of the whole, so that the ten turns together do not finish.
    let mut draw = 0x9e37_79b9_7f4a_7c15u64;
    let moments = (0..10).map(|_| {
        draw = draw.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        undisturbed.mul_f64(0.1 * (draw >> 11) as f64 / (1u64 << 53) as f64)
    });
    let survived = archive.kill_at(moments, "killed", &whole);
    println!("undisturbed in {undisturbed:.1?}; {survived} of 1000 results survived ten kills");
    assert!(survived > 0);
    let said = expect(&archive.batch("killed"), 0);
    assert!(said.contains(&format!("{survived} results were there already")), "{said}");
    assert_same(&whole, &archive.results("killed"));
}

#[test]
fn shares_of_any_number_give_the_bytes_of_a_batch() {
    let archive = Archive::shipped(2);
    expect(&archive.batch("whole"), 3);
    let whole = archive.results("whole");
    for shares in [1, 3, 17] {
        let out = format!("in-{shares}");
        for number in (1..=shares).rev() {
            let said = archive.map(&out, &format!("{number}/{shares}"));
            // The broken recording is the seventh.
            expect(&said, if (7 - 1) % shares == number - 1 { 3 } else { 0 });
        }
        expect(&archive.reduce(&out), 3);
        assert_same(&whole, &archive.results(&out));
    }
    std::fs::remove_file(archive.path("in-3/shards/2-of-3.json")).expect("a receipt");
    let said = expect(&archive.reduce("in-3"), 1);
    assert!(said.contains("share 2/3 is missing"), "{said}");
    expect(&archive.map("in-3", "2/17"), 0);
    let said = expect(&archive.reduce("in-3"), 1);
    assert!(said.contains("two partitions"), "{said}");
}

#[test]
fn a_changed_pipeline_or_recording_is_worked_on_again_and_nothing_else_is() {
    let archive = Archive::shipped(1);
    expect(&archive.batch("out"), 3);
    let pipeline = std::fs::read_to_string(archive.path("rig.toml")).expect("pipeline");
    std::fs::write(archive.path("rig.toml"), format!("# a remark\n{pipeline}")).expect("written");
    assert!(expect(&archive.batch("out"), 3).contains("3 results were there already"));
    let manifest = std::fs::read_to_string(archive.path("manifest.toml")).expect("manifest");
    std::fs::write(archive.path("manifest.toml"), manifest.replace("11.8", "11.9")).expect("written");
    assert!(expect(&archive.batch("out"), 3).contains("2 results were there already"));
    std::fs::write(archive.path("rig.toml"), pipeline.replace("k = 5", "k = 4")).expect("written");
    assert!(!expect(&archive.batch("out"), 3).contains("there already"));
}

const DAY_S: u64 = 86_400;
const WEEK_S: u64 = 7 * DAY_S;

/// Simulates these of many recordings of the rig that this seed draws, one every so often, with something hidden in them.
fn sessions(folder: &Path, seed: u64, numbers: std::ops::Range<u64>, every_s: u64, hidden: &str) {
    let shipped = shipped("lab/paper-small.toml");
    let own = shipped.split("[[recordings]]").next().expect("a head");
    let start_s = 1_760_000_000 + numbers.start * every_s;
    let every = format!("interval_s = {every_s}.0");
    let mut lab = own.replace("interval_s = 900.0", &every);
    lab = lab.replace("1_760_000_000", &start_s.to_string()).replace("seed = 4", &format!("seed = {seed}"));
    lab.push_str(hidden);
    numbers.for_each(|number| lab.push_str(&format!("\n[[recordings]]\nname = \"week{number:02}\"\n")));
    let file = folder.join("lab.toml");
    std::fs::write(&file, lab).expect("lab file");
    simulate(&file, folder, &[]);
}

fn changes(json: &Value) -> Vec<(String, String, String, f64)> {
    let name = |row: &Value| {
        let row = row.as_u64().expect("a row") as usize;
        json["recordings"][row]["recording"].as_str().expect("a name").to_owned()
    };
    let all = json["changes"].as_array().expect("changes");
    all.iter()
        .map(|c| {
            let place = if c["after"].is_null() { String::new() } else { name(&c["after"]) };
            let text = |key: &str| c[key].as_str().expect("a word").to_owned();
            (text("quantity"), text("kind"), place, c["size"].as_f64().expect("a size"))
        })
        .collect()
}

#[test]
fn a_bumped_table_and_a_slipped_tooth_are_flagged_in_their_week() {
    let archive = Archive { folder: tempfile::tempdir().expect("temporary folder") };
    archive.write_pipeline();
    let lab = archive.path("lab");
    std::fs::create_dir(&lab).expect("a folder");
    let hidden = "
        [[mechanisms]]
        kind = \"bump\"
        body = \"board\"
        shift_mm = [4.0, 0.0, 0.0]
        recording = 5
        [[mechanisms]]
        kind = \"zero_slip\"
        joint = 2
        slip_deg = -1.5
        recording = 9
    ";
    sessions(&lab, 4, 0..13, WEEK_S, hidden);
    let arg = Path::new;
    let glob = lab.join("*.mcap");
    let output = armcal([
        arg("batch"),
        &glob,
        arg("--pipeline"),
        &archive.path("rig.toml"),
        arg("--out"),
        &archive.path("out"),
    ]);
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    println!("{said}");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let found = changes(&read_json(&archive.path("out/campaign.json")));
    let in_week = |week: &str, quantity: &str| {
        found.iter().find(|(q, kind, after, _)| q == quantity && kind == "step" && after == week)
    };
    let table = in_week("week05", "board_in_base.x").unwrap_or_else(|| panic!("{found:?}"));
    assert!((table.3 - 4e-3).abs() < 5e-4, "{table:?}");
    let slip = in_week("week09", "joint2.theta").unwrap_or_else(|| panic!("{found:?}"));
    assert!((slip.3.abs() - 1.5f64.to_radians()).abs() < 3e-3, "{slip:?}");
    // Nothing moves in any other week.
    assert!(found.iter().all(|(_, _, after, _)| ["week05", "week09"].contains(&after.as_str())), "{found:?}");
}

#[test]
fn a_slurm_job_array_gives_the_bytes_of_a_batch() {
    let Some(slurm) = slurm() else { return };
    let archive = Archive::shipped(2);
    expect(&archive.batch("whole"), 3);
    let output = slurm
        .command(&root().join("pipelines/cluster/slurm.sh").display().to_string())
        .args([archive.path("manifest.toml"), archive.path("rig.toml"), archive.path("slurm")])
        .arg("3")
        .env("ARMCAL", env!("CARGO_BIN_EXE_armcal"))
        .output()
        .expect("submitting");
    expect(&output, 0);
    slurm.wait_for_jobs();
    let log = std::fs::read_to_string(archive.path("slurm/log/reduce.log")).unwrap_or_default();
    assert!(log.contains("6 of 7 recordings calibrated"), "{log}");
    assert_same(&archive.results("whole"), &archive.results("slurm"));
}

#[test]
fn a_snakemake_workflow_gives_the_bytes_of_a_batch() {
    let Some(python) = python_with("snakemake") else { return };
    let archive = Archive::shipped(2);
    expect(&archive.batch("whole"), 3);
    let setting = |name: &str, file: &str| format!("{name}={}", archive.path(file).display());
    let run = || {
        let output = Command::new(&python)
            .args(["-m", "snakemake", "--cores", "2", "--directory"])
            .arg(archive.path("work"))
            .arg("-s")
            .arg(root().join("pipelines/cluster/Snakefile"))
            .arg("--config")
            .args([
                setting("manifest", "manifest.toml"),
                setting("pipeline", "rig.toml"),
                setting("out", "snake"),
            ])
            .arg("shards=3")
            .env("ARMCAL", env!("CARGO_BIN_EXE_armcal"))
            .output()
            .expect("starting Snakemake");
        expect(&output, 0)
    };
    run();
    assert_same(&archive.results("whole"), &archive.results("snake"));
    let again = run();
    assert!(again.contains("Nothing to be done"), "{again}");
}
