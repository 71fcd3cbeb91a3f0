//! The tools armcal is measured beside. Each is found or made, or skipped loudly.

use crate::{Options, Result};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A Python with the packages of `../peers/requirements.txt`.
pub struct Python {
    program: PathBuf,
}

impl Python {
    /// `$ARMCAL_BENCH_PYTHON`, else a virtual environment in the bench's data folder, made when it is not there.
    pub fn find(options: &Options) -> Result<Option<Python>> {
        let given = std::env::var_os("ARMCAL_BENCH_PYTHON").map(PathBuf::from);
        let made = options.data.join("venv");
        let program = given.clone().unwrap_or_else(|| made.join("bin/python"));
        let python = Python { program };
        if python.is_complete() {
            return Ok(Some(python));
        }
        if given.is_none() && run(Command::new("python3").args(["-m", "venv"]).arg(&made)) {
            let mut pip = Command::new(&python.program);
            pip.args(["-m", "pip", "install", "--quiet", "-r"]).arg(folder().join("requirements.txt"));
            if run(&mut pip) && python.is_complete() {
                return Ok(Some(python));
            }
        }
        let what = python.program.display();
        eprintln!("SKIPPED: {what} lacks packages of benches/peers/requirements.txt");
        Ok(None)
    }

    fn is_complete(&self) -> bool {
        let import = ["-c", "import mcap, mcap_ros2, numpy, rosbags, scipy"];
        Command::new(&self.program).args(import).output().is_ok_and(|o| o.status.success())
    }

    /// Runs a script of `../peers` on a file, on one core, and returns the JSON it prints.
    pub fn run(&self, script: &str, argument: &Path) -> Result<Value> {
        json(single_threaded(&self.program).arg(folder().join(script)).arg(argument))
    }

    /// Versions of the interpreter and the packages.
    pub fn versions(&self) -> Option<String> {
        let script = "import platform, importlib.metadata as m; print('Python', platform.python_version(), *(f'{n} {m.version(n)}' for n in ('mcap', 'mcap-ros2-support', 'rosbags', 'numpy', 'scipy')), sep=', ')";
        let output = Command::new(&self.program).args(["-c", script]).output().ok()?;
        let text = String::from_utf8(output.stdout).ok()?;
        Some(text.trim().replacen(", ", " ", 1))
    }
}

/// The program that solves the fit problem by Ceres, compiled against the system's library.
pub fn ceres(options: &Options) -> Option<PathBuf> {
    let program = options.data.join("fit_ceres");
    let mut compile = Command::new("c++");
    compile.args(["-std=c++17", "-O3", "-DNDEBUG", "-I/usr/include/eigen3"]);
    compile.arg(folder().join("fit_ceres.cpp")).arg("-o").arg(&program).args(["-lceres", "-lglog"]);
    if run(&mut compile) {
        return Some(program);
    }
    eprintln!("SKIPPED: Ceres; `apt-get install g++ libceres-dev` provides it");
    None
}

/// Runs a peer and returns the JSON it prints.
pub fn json(command: &mut Command) -> Result<Value> {
    let output = command.output().map_err(|e| format!("starting {command:?}: {e}"))?;
    if !output.status.success() {
        return Err(format!("{command:?}: {}", String::from_utf8_lossy(&output.stderr)).into());
    }
    Ok(serde_json::from_slice(&output.stdout)?)
}

/// A program that keeps its linear algebra on one core.
pub fn single_threaded(program: &Path) -> Command {
    let mut command = Command::new(program);
    command.envs([("OPENBLAS_NUM_THREADS", "1"), ("OMP_NUM_THREADS", "1")]);
    command
}

/// A number that a peer must have said.
pub fn number(said: &Value, key: &str) -> Result<f64> {
    said[key].as_f64().ok_or_else(|| format!("the peer did not say `{key}`: {said}").into())
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/peers")
}

/// Whether a command could be started and succeeded; what it complains about goes to stderr.
fn run(command: &mut Command) -> bool {
    command.status().is_ok_and(|status| status.success())
}
