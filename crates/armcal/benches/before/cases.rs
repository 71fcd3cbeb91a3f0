//! What both programs are run over: shipped pipelines, and rigs of the lab that hide one thing each.

use crate::Result;
use crate::process::{self, Ended};
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

/// One pipeline with everything it reads.
pub struct Case {
    pipeline: PathBuf,
    results: PathBuf,
}

/// What one program made of it.
pub struct Run {
    /// Where its files are.
    pub folder: PathBuf,
    /// What it printed, without the folder it wrote to.
    pub said: String,
    /// Exit code.
    pub status: Option<i32>,
    /// Least processor time of all repeats [s].
    pub cpu_s: f64,
    /// High-water mark of its memory in the first run [MiB].
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
        Ok(pipeline.map(|pipeline| Case { pipeline, results }))
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

    fn once(&self, programs: &[PathBuf; 2], k: usize) -> Result<Run> {
        let folder = self.results.join(["before", "now"][k]);
        let mut command = Command::new(&programs[k]);
        command.args(["run", "--verbose"]).arg(&self.pipeline).arg("--out").arg(&folder);
        let Ended { output, cpu_s, peak_mib } = process::run(command.env("RAYON_NUM_THREADS", "1"))?;
        let text = String::from_utf8_lossy(&output.stdout);
        let said = text.replace(&folder.display().to_string(), "OUT");
        Ok(Run { folder, said, status: output.status.code(), cpu_s, peak_mib })
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
    let recorded = |value: &toml::Value| -> Vec<PathBuf> {
        let paths = value.get("paths").and_then(toml::Value::as_array).into_iter().flatten();
        paths.filter_map(toml::Value::as_str).map(|p| pipelines.join(p)).collect()
    };
    let recordings = value.get("recordings").and_then(toml::Value::as_array).into_iter().flatten();
    if recordings.flat_map(recorded).any(|p| !p.to_string_lossy().contains('*') && !p.exists()) {
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
