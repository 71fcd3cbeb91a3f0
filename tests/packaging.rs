use crate::support::{armcal, paper_pipeline, python_with, root, skip};
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn succeeds(command: &mut Command) -> String {
    let output = command.output().unwrap_or_else(|e| panic!("{command:?}: {e}"));
    let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{command:?}\n{out}\n{err}");
    out.into_owned()
}

fn read(path: impl AsRef<Path>) -> String {
    std::fs::read_to_string(root().join(path)).expect("a file of the repository")
}

/// The names of the program's commands, from its help.
fn commands() -> Vec<String> {
    let help = succeeds(Command::new(env!("CARGO_BIN_EXE_armcal")).arg("--help"));
    let listed =
        help.split("Commands:").nth(1).and_then(|rest| rest.split("\n\n").next()).expect("the commands");
    let names = listed.lines().filter_map(|line| line.strip_prefix("  ")?.split(' ').next());
    names.filter(|name| !name.is_empty() && *name != "help").map(str::to_owned).collect()
}

#[test]
fn a_shell_completes_every_command_and_its_options() {
    let scripts: BTreeSet<String> = ["bash", "zsh", "fish", "elvish", "powershell"]
        .map(|shell| succeeds(Command::new(env!("CARGO_BIN_EXE_armcal")).args(["completions", shell])))
        .into();
    for (script, command) in scripts.iter().flat_map(|s| commands().into_iter().map(move |c| (s, c))) {
        assert!(script.contains(&command), "{command} is missing in\n{script}");
    }
    let folder = tempfile::tempdir().expect("temporary folder");
    let script = folder.path().join("armcal.bash");
    std::fs::write(
        &script,
        succeeds(Command::new(env!("CARGO_BIN_EXE_armcal")).args(["completions", "bash"])),
    )
    .expect("written");
    // What bash itself makes of it.
    let completed = |typed: &str| {
        let ask = format!(
            "source {}; COMP_WORDS=({typed}); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); \
             _armcal armcal \"${{COMP_WORDS[-1]}}\"; echo \"${{COMPREPLY[@]}}\"",
            script.display()
        );
        succeeds(Command::new("bash").args(["-c", &ask]))
    };
    assert_eq!(completed("armcal compe").trim(), "compensate");
    assert_eq!(completed("armcal compensate --appr").trim(), "--approach");
}

#[test]
fn there_is_a_man_page_for_every_command_and_none_is_written_over_another_file() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let pages = folder.path().join("man");
    let man = || armcal(["man".as_ref(), pages.as_os_str()]);
    for _ in 0..2 {
        let output: Output = man();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    let page = |name: &str| std::fs::read_to_string(pages.join(name)).expect("a page");
    for command in commands() {
        let text = page(&format!("armcal-{command}.1"));
        assert!(
            text.contains(&format!(".TH armcal-{command} 1 ")) && text.contains(".SH SYNOPSIS"),
            "{text}"
        );
    }
    assert_eq!(std::fs::read_dir(&pages).expect("the folder").count(), commands().len() + 1);
    assert!(page("armcal-compensate.1").contains("approach"));
    std::fs::write(pages.join("armcal-run.1"), "mine").expect("written");
    let refused = man();
    assert_eq!(refused.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("was not made by armcal"));
    assert_eq!(page("armcal-run.1"), "mine");
}

/// The wheel of the Python module holds all it needs: installed without the network into an environment that has nothing.
#[test]
fn the_python_module_works_from_its_wheel_in_a_clean_environment() {
    let Some(python) = python_with("hatchling") else { return };
    let folder = tempfile::tempdir().expect("temporary folder");
    let (wheels, clean) = (folder.path().join("wheels"), folder.path().join("clean"));
    let tests = std::env::current_exe().expect("this test");
    // Built already, as a debug build; a release builds its own.
    let library = tests.parent().expect("its folder").join("libarmcal_kinematics.so");
    succeeds(
        Command::new(&python)
            .current_dir(root().join("crates/kinematics"))
            .env("ARMCAL_KINEMATICS_LIBRARY", &library)
            .env("PYTHONDONTWRITEBYTECODE", "1")
            .args(["-m", "hatchling", "build", "-t", "wheel", "-d"])
            .arg(&wheels),
    );
    let wheel =
        std::fs::read_dir(&wheels).expect("wheels").next().expect("a wheel").expect("an entry").path();
    let name = wheel.file_name().expect("its name").to_string_lossy().into_owned();
    let version = env!("CARGO_PKG_VERSION");
    assert!(name.starts_with(&format!("armcal_kinematics-{version}-py3-none-linux_")), "{name}");
    succeeds(Command::new(&python).args(["-m", "venv", "--without-pip"]).arg(&clean));
    let installed = clean.join("bin/python");
    succeeds(
        Command::new(&python)
            .args(["-m", "pip", "--disable-pip-version-check", "--python"])
            .arg(&installed)
            .args(["install", "--quiet", "--no-index"])
            .arg(&wheel),
    );
    let script = "from armcal_kinematics import Arm, version\n\
                  import sys, armcal_kinematics, os\n\
                  arm = Arm.open(sys.argv[1])\n\
                  motion = arm.motion(in_base=True)\n\
                  motion.start([0.0] * len(arm.joints))\n\
                  point = motion.correct([0.1, -0.4, 0.3])\n\
                  assert point.reached.after_m < 1e-6 < 1e-3 < point.reached.before_m, point\n\
                  here = os.path.dirname(armcal_kinematics.__file__)\n\
                  print(version(), arm.effects, sorted(name for name in os.listdir(here) if '.' in name or 'LICENSE' in name))";
    let model = root().join("fixtures/models/paper-play.json");
    // -I: neither the folder nor the environment of the caller is looked at.
    let said =
        succeeds(Command::new(&installed).current_dir(folder.path()).args(["-I", "-c", script]).arg(model));
    assert!(said.starts_with(version) && said.contains("backlash:1"), "{said}");
    for file in ["armcal_kinematics.h", "libarmcal_kinematics.so", "LICENSE-MIT"] {
        assert!(said.contains(file), "{said}");
    }
}

/// The example for GitHub, its own words run by bash as the runner would.
#[test]
fn the_step_of_the_ci_example_reports_and_fails_as_it_should() {
    let Some(python) = python_with("yaml") else { return };
    let extract = "import sys, yaml\n\
                   jobs = yaml.safe_load(open(sys.argv[1]))['jobs']\n\
                   print([step['run'] for step in jobs['check']['steps'] if step.get('name') == 'Check the calibration'][0])";
    let script = succeeds(Command::new(python).args(["-c", extract]).arg(root().join("docs/ci-example.yml")));
    let program = PathBuf::from(env!("CARGO_BIN_EXE_armcal"));
    let path = format!(
        "{}:{}",
        program.parent().expect("its folder").display(),
        std::env::var("PATH").expect("PATH")
    );
    for (limit, code) in [(0.5, 0), (0.05, 1)] {
        let folder = tempfile::tempdir().expect("temporary folder");
        let limits = format!("\n[check]\nmax_holdout_mean_mm = {limit}\n");
        let rig = paper_pipeline(&root().join("fixtures/paper"));
        let rig = rig.split("\n[check]").next().expect("a pipeline").to_owned();
        let quick = "\n[diagnosis]\nenabled = false\n";
        let quick = if rig.contains("[diagnosis]") { "" } else { quick };
        std::fs::write(folder.path().join("rig.toml"), rig + quick + &limits).expect("written");
        let summary = folder.path().join("step-summary.md");
        let output = Command::new("bash")
            .args(["-e", "-c", &script])
            .current_dir(folder.path())
            .env("PATH", &path)
            .env("GITHUB_STEP_SUMMARY", &summary)
            .output()
            .expect("starting bash");
        let said = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{said}");
        let summary = std::fs::read_to_string(summary).expect("a summary");
        assert!(summary.contains("| check | measured | limit | |"), "{summary}");
        for kept in ["check.xml", "check.md", "out/report.html", "out/summary.json"] {
            assert!(folder.path().join(kept).is_file(), "{kept} is not there to keep");
        }
    }
}

/// What `cargo deny check licenses` holds, without it: every package that any feature brings is under a licence in deny.toml.
#[test]
fn every_dependency_is_under_a_licence_that_is_allowed() {
    let deny: toml::Table = read("deny.toml").parse().expect("deny.toml");
    let allowed: Vec<&str> =
        deny["licenses"]["allow"].as_array().expect("licences").iter().filter_map(|v| v.as_str()).collect();
    let host = succeeds(Command::new("rustc").arg("-vV"));
    let host = host.lines().find_map(|line| line.strip_prefix("host: ")).expect("the host");
    let all = ["metadata", "--offline", "--all-features", "--format-version", "1", "--filter-platform", host];
    let metadata = Command::new(env!("CARGO")).args(all).current_dir(root()).output().expect("cargo runs");
    if !metadata.status.success() {
        return skip(&format!("cargo metadata: {}", String::from_utf8_lossy(&metadata.stderr)));
    }
    let metadata: Value = serde_json::from_slice(&metadata.stdout).expect("JSON");
    let packages = metadata["packages"].as_array().expect("packages");
    assert!(packages.len() > 200, "only {} packages", packages.len());
    let mut used: BTreeSet<&str> = BTreeSet::new();
    for package in packages {
        let (name, licence) = (&package["name"], package["license"].as_str().unwrap_or("none"));
        let expression = spdx::Expression::parse_mode(licence, spdx::ParseMode::LAX)
            .unwrap_or_else(|e| panic!("{name} {licence}: {e}"));
        let holds = |licence: &spdx::LicenseReq| {
            let licence = licence.to_string();
            used.extend(allowed.iter().copied().filter(|allowed| *allowed == licence));
            allowed.contains(&licence.as_str())
        };
        assert!(expression.evaluate(holds), "{name} is under {licence}, which deny.toml does not allow");
    }
    assert_eq!(used.len(), allowed.len(), "deny.toml allows what nothing needs: {used:?}");
}

/// Whatever somebody else wrote is named where everybody looks for it.
#[test]
fn everything_vendored_stands_in_the_notice() {
    let notice = read("docs/notices.md");
    let Ok(listed) = Command::new("git").args(["ls-files"]).current_dir(root()).output() else {
        return skip("no git to list the files of the repository");
    };
    let listed = String::from_utf8_lossy(&listed.stdout).into_owned();
    if listed.is_empty() {
        return skip("this is no clone of the repository");
    }
    let foreign = |path: &&str| {
        let (folder, name) = path.rsplit_once('/').unwrap_or(("", path));
        (folder.split('/').any(|part| part == "vendor") || name.ends_with("LICENSE")) && !folder.is_empty()
            || path.starts_with("tests/schemas/")
    };
    let foreign: Vec<&str> = listed.lines().filter(foreign).collect();
    assert!(foreign.len() >= 3, "{foreign:?}");
    for path in foreign {
        assert!(notice.contains(&format!("`{path}`")), "docs/notices.md does not name {path}");
    }
}

/// The workflows do what the repository says they do.
#[test]
fn the_workflows_run_the_script_that_holds_everywhere_and_the_advisories() {
    let workflow = read(".github/workflows/ci.yml");
    assert!(
        workflow.contains(".ci/run")
            && workflow.contains("cargo-deny-action")
            && workflow.contains("advisories")
    );
    let release = read(".github/workflows/release.yml");
    for part in ["crates/armcal/Cargo.toml", "./crates/kinematics", "completions", " man "] {
        assert!(release.contains(part), "the release lacks {part}");
    }
}
