//! What both programs are run over: shipped pipelines, and rigs of the lab that hide one thing each.

use crate::Result;
use crate::process::{self, Ended};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What the rigs hide; twenty rigs, every design of the catalogue's families once.
const HIDDEN: [&str; 20] = [
    "nothing",
    "nothing:autocorrelated",
    "nothing:heavy_tails",
    "backlash",
    "gravity_backlash",
    "belt_backlash",
    "friction_windup",
    "compliance",
    "hardening_compliance",
    "link_bending",
    "base_compliance",
    "axis_tilt",
    "eccentricity",
    "periodic",
    "gear_ratio",
    "frame_shift@dwell",
    "unsettled_reading",
    "zero_drift",
    "board_scale",
    "outside:cable_drag",
];
/// Seed of the first rig.
const SEED: usize = 7001;
/// Shipped pipelines whose diagnosis takes minutes: run without.
const LONG: &str = "ur10";

/// In the place of the pipeline's path.
const PIPELINE: &str = "";
/// Its recordings, a path a line.
const RECORDINGS: &str = "../recordings.txt";
/// Commands in their order: words, what they read, the folder they write to.
const COMMANDS: [(&str, &[&str], Option<&str>); 7] = [
    ("run --verbose", &[PIPELINE], Some("run")),
    ("check", &[PIPELINE], Some("check")),
    ("plan --json", &[PIPELINE], None),
    ("verify", &["run", PIPELINE], Some("verify")),
    ("pool", &[PIPELINE, "run"], Some("pool")),
    ("compare", &["run", "check"], None),
    ("batch --pipeline", &[PIPELINE, RECORDINGS], Some("campaign")),
];

/// One pipeline with everything it reads.
pub struct Case {
    pipeline: PathBuf,
    results: PathBuf,
}

/// What one program made of it.
pub struct Run {
    /// Where its files are.
    pub folder: PathBuf,
    /// What its commands printed, without the folder they wrote to.
    pub said: String,
    /// Exit codes, command by command.
    pub status: Vec<Option<i32>>,
    /// Least processor time of all repeats [s].
    pub cpu_s: f64,
    /// Highest high-water mark of their memory in the first round [MiB].
    pub peak_mib: f64,
}

/// Every case: shipped pipelines by their file, rigs by what they hide.
pub fn names(root: &Path) -> Result<Vec<String>> {
    let mut shipped = Vec::new();
    for entry in std::fs::read_dir(root.join("pipelines"))? {
        let path = entry?.path();
        if path.extension().is_some_and(|e| e == "toml") {
            shipped.extend(path.file_stem().and_then(|stem| stem.to_str()).map(str::to_owned));
        }
    }
    shipped.sort();
    Ok(shipped.into_iter().chain(HIDDEN.map(str::to_owned)).collect())
}

impl Case {
    /// Makes what it reads; none where a recording is not on this machine.
    pub fn made(name: &str, root: &Path, folder: &Path, program: &Path) -> Result<Option<Case>> {
        let results = folder.join("results").join(name.replace([':', '@'], "_"));
        if results.exists() {
            std::fs::remove_dir_all(&results)?;
        }
        std::fs::create_dir_all(&results)?;
        let pipeline = match HIDDEN.iter().position(|hidden| *hidden == name) {
            Some(at) => Some(rig(name, SEED + at, &results.join("rig"), program)?),
            None => shipped(&root.join("pipelines"), name, &results)?,
        };
        let Some(pipeline) = pipeline else { return Ok(None) };
        let here = pipeline.parent().ok_or("a pipeline is in a folder")?;
        let all = recorded(&std::fs::read_to_string(&pipeline)?.parse()?, here);
        let lines: String = all.iter().map(|path| format!("{}\n", path.display())).collect();
        std::fs::write(results.join("recordings.txt"), lines)?;
        Ok(Some(Case { pipeline, results }))
    }

    /// Both programs in turn, so that what else the machine does meets both.
    pub fn run(&self, programs: &[PathBuf; 2], repeats: usize) -> Result<[Run; 2]> {
        let mut runs = [self.once(programs, 0)?, self.once(programs, 1)?];
        for _ in 1..repeats {
            for (k, run) in runs.iter_mut().enumerate() {
                run.cpu_s = run.cpu_s.min(self.once(programs, k)?.cpu_s);
            }
        }
        Ok(runs)
    }

    /// The run, then what else makes something of the pipeline or of that result.
    fn once(&self, programs: &[PathBuf; 2], k: usize) -> Result<Run> {
        let folder = self.results.join(["before", "now"][k]);
        let place = |name: &str| folder.join(name).into_os_string();
        let mut run = Run {
            folder: folder.clone(),
            said: String::new(),
            status: Vec::new(),
            cpu_s: 0.0,
            peak_mib: 0.0,
        };
        for (command, results, out) in COMMANDS {
            let mut arguments: Vec<OsString> = command.split(' ').map(OsString::from).collect();
            arguments.extend(
                results
                    .iter()
                    .map(|name| if *name == PIPELINE { self.pipeline.clone().into() } else { place(name) }),
            );
            arguments.extend(out.iter().flat_map(|out| ["--out".into(), place(out)]));
            let mut process = Command::new(&programs[k]);
            let Ended { output, cpu_s, peak_mib } =
                process::run(process.args(arguments).env("RAYON_NUM_THREADS", "1"))?;
            let text = String::from_utf8_lossy(&output.stdout);
            run.said += &text.replace(&folder.display().to_string(), "OUT");
            run.status.push(output.status.code());
            (run.cpu_s, run.peak_mib) = (run.cpu_s + cpu_s, run.peak_mib.max(peak_mib));
        }
        Ok(run)
    }
}

fn rig(name: &str, seed: usize, folder: &Path, program: &Path) -> Result<PathBuf> {
    let output = Command::new(program)
        .args(["simulate", "--hide", name, "--seed", &seed.to_string(), "--out"])
        .arg(folder)
        .output()?;
    if !output.status.success() {
        return Err(format!("simulating {name}: {}", String::from_utf8_lossy(&output.stderr)).into());
    }
    Ok(folder.join("pipeline.toml"))
}

/// The shipped file, or a copy of it without diagnosis.
fn shipped(pipelines: &Path, name: &str, results: &Path) -> Result<Option<PathBuf>> {
    let path = pipelines.join(name).with_extension("toml");
    let text = std::fs::read_to_string(&path)?;
    let mut value: toml::Table = text.parse()?;
    let missing = |p: &PathBuf| !p.to_string_lossy().contains('*') && !p.exists();
    if recorded(&value, pipelines).iter().any(missing) {
        return Ok(None);
    }
    if !name.starts_with(LONG) {
        return Ok(Some(path));
    }
    value.insert("diagnosis".into(), toml::Table::from_iter([("enabled".to_owned(), false.into())]).into());
    let mut value = toml::Value::Table(value);
    absolute(&mut value, pipelines);
    let copy = results.join("pipeline.toml");
    std::fs::write(&copy, toml::to_string(&value)?)?;
    Ok(Some(copy))
}

/// Paths of the recordings of a pipeline in this folder.
fn recorded(pipeline: &toml::Table, folder: &Path) -> Vec<PathBuf> {
    let paths = |value: &toml::Value| -> Vec<PathBuf> {
        let paths = value.get("paths").and_then(toml::Value::as_array).into_iter().flatten();
        paths.filter_map(toml::Value::as_str).map(|p| folder.join(p)).collect()
    };
    let recordings = pipeline.get("recordings").and_then(toml::Value::as_array).into_iter().flatten();
    recordings.flat_map(paths).collect()
}

/// Makes the paths of a pipeline absolute, so that its copy finds them.
fn absolute(value: &mut toml::Value, folder: &Path) {
    let placed = |path: &mut toml::Value| {
        if let Some(text) = path.as_str() {
            *path = folder.join(text).display().to_string().into();
        }
    };
    match value {
        toml::Value::Table(table) => {
            for (key, value) in table.iter_mut() {
                match (key.as_str(), value) {
                    ("dh" | "urdf" | "board", path) if path.is_str() => placed(path),
                    ("paths", toml::Value::Array(paths)) => paths.iter_mut().for_each(placed),
                    (_, other) => absolute(other, folder),
                }
            }
        }
        toml::Value::Array(values) => values.iter_mut().for_each(|v| absolute(v, folder)),
        _ => {}
    }
}
