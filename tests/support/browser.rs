//! A real browser over the pages, driven by Playwright from node.

use super::{root, skip};
use std::path::{Path, PathBuf};
use std::process::Command;

/// What drives the browser.
pub struct Browser {
    scripts: PathBuf,
}

/// Node, Playwright and Chromium, if this machine has them; without them the test is skipped. `.ci/run` installs them.
#[track_caller]
pub fn browser() -> Option<Browser> {
    let scripts = root().join("tests/browser");
    let found = Command::new("node")
        .args(["--input-type=module", "-e"])
        .arg("import('./browser.mjs').then((b) => b.launch()).then((b) => b.close())")
        .current_dir(&scripts)
        .output();
    let why = match found {
        Ok(output) if output.status.success() => return Some(Browser { scripts }),
        Ok(output) => String::from_utf8_lossy(&output.stderr)
            .lines()
            .find(|l| l.contains("Error"))
            .unwrap_or("")
            .to_owned(),
        Err(e) => format!("node: {e}"),
    };
    assert!(std::env::var_os("ARMCAL_NEED_BROWSER").is_none(), "no browser: {why}");
    skip(&format!("no browser on this machine ({why}); `npm ci` in tests/browser and install chromium"));
    None
}

/// Runs a script of `tests/browser`, expects success, and returns what it said.
pub fn scripted(browser: &Browser, script: &str, arguments: &[&Path]) -> String {
    let output = Command::new("node")
        .arg(browser.scripts.join(script))
        .args(arguments)
        .output()
        .expect("starting node");
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{script}\n{said}\n{}", String::from_utf8_lossy(&output.stderr));
    said
}
