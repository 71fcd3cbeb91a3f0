use crate::support::{armcal, number, paper_pipeline, python_with, root, run_pipeline, shipped, simulate};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;
use tempfile::TempDir;

/// Limits that the shipped recordings keep with room, as a user would set them once.
const LIMITS: &str = "
[check]
max_holdout_mean_mm = 0.3
max_holdout_p95_mm = 0.6
max_over_floor = 1.5
min_dwells = 30
max_rejected_share = 0.2
verdicts = [\"nothing_missing\"]
max_warnings = { inadequate = 0, data_lost = 0 }
teeth = { joint2 = 128 }
";

/// The same against an accepted run.
const SHIFTS: &str = "
reference = \"reference\"
max_shift_mm = 0.5
max_shift_deg = 0.1
max_frame_shift_mm = 1.0
max_frame_shift_deg = 0.1
";

/// A job: a folder with a pipeline, and what `armcal check` leaves there.
struct Job {
    folder: TempDir,
    recordings: PathBuf,
}

/// What a job said.
struct Said {
    code: i32,
    stdout: String,
    stderr: String,
    junit: String,
    markdown: String,
}

impl Job {
    /// On the shipped recordings.
    fn shipped() -> Job {
        let folder = tempfile::tempdir().expect("temporary folder");
        Job { folder, recordings: root().join("fixtures/paper") }
    }

    /// On the rig of the shipped recordings, with something hidden in it.
    fn hiding(mechanism: &str) -> Job {
        let folder = tempfile::tempdir().expect("temporary folder");
        let lab = folder.path().join("lab.toml");
        let text = shipped("lab/paper-small.toml") + "\n[[mechanisms]]\n" + mechanism;
        std::fs::write(&lab, text).expect("lab file");
        let recordings = folder.path().join("recordings");
        simulate(&lab, &recordings, &[]);
        Job { folder, recordings }
    }

    /// With the shipped recordings accepted as its reference.
    fn with_reference(self) -> Job {
        run_pipeline(&root().join("pipelines/paper.toml"), &self.path("reference"), &[0]);
        self
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn pipeline(&self, check: &str) -> PathBuf {
        let shipped = paper_pipeline(&self.recordings);
        let own = shipped.find("\n[check]").map_or(shipped.as_str(), |at| &shipped[..at]);
        let path = self.path("rig.toml");
        std::fs::write(&path, format!("{own}\n{check}")).expect("pipeline");
        path
    }

    fn check(&self, limits: &str) -> Said {
        let (junit, markdown) = (self.path("junit.xml"), self.path("summary.md"));
        let (arg, pipeline) = (Path::new, self.pipeline(limits));
        let output = armcal([arg("check"), &pipeline, arg("--junit"), &junit, arg("--markdown"), &markdown]);
        let read = |path: &Path| std::fs::read_to_string(path).unwrap_or_default();
        let said = Said {
            code: output.status.code().expect("an exit code"),
            stdout: String::from_utf8(output.stdout).expect("text"),
            stderr: String::from_utf8(output.stderr).expect("text"),
            junit: read(&junit),
            markdown: read(&markdown),
        };
        println!("exit {}\n{}{}", said.code, said.stdout, said.stderr);
        said
    }
}

impl Said {
    fn last_line(&self) -> &str {
        self.stdout.lines().last().expect("a last line")
    }

    /// Names of the cases that failed, with message and body; checks the counts on the way.
    fn failures(&self) -> Vec<(String, String)> {
        let document = roxmltree::Document::parse(&self.junit).expect("well-formed XML");
        let suite = document.descendants().find(|n| n.has_tag_name("testsuite")).expect("a suite");
        let cases: Vec<_> = suite.children().filter(|n| n.has_tag_name("testcase")).collect();
        let failures: Vec<(String, String)> = cases
            .iter()
            .filter_map(|case| {
                let failure = case.children().find(|n| n.has_tag_name("failure"))?;
                let message = failure.attribute("message").expect("a message");
                let body = failure.text().unwrap_or_default();
                Some((case.attribute("name").expect("a name").to_owned(), format!("{message}\n{body}")))
            })
            .collect();
        assert_eq!(suite.attribute("tests"), Some(cases.len().to_string().as_str()));
        assert_eq!(suite.attribute("failures"), Some(failures.len().to_string().as_str()));
        failures
    }

    fn broken(&self) -> Vec<String> {
        self.failures().into_iter().map(|(name, _)| name).collect()
    }

    /// What the file says about one broken limit.
    fn why(&self, check: &str) -> String {
        let found = self.failures().into_iter().find(|(name, _)| name == check);
        found.unwrap_or_else(|| panic!("{check} is not broken")).1
    }
}

/// Jenkins refuses a file that its schema does not allow.
fn assert_valid(junit: &str) {
    let Some(python) = python_with("xmlschema") else { return };
    let folder = tempfile::tempdir().expect("temporary folder");
    let file = folder.path().join("junit.xml");
    std::fs::write(&file, junit).expect("XML");
    let validate = "import sys, xmlschema; xmlschema.XMLSchema(sys.argv[1]).validate(sys.argv[2])";
    let schema = root().join("tests/schemas/junit-10.xsd");
    let output = Command::new(python).args(["-c", validate]).args([&schema, &file]).output().expect("Python");
    assert!(output.status.success(), "{}\n{junit}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn good_recordings_keep_every_limit() {
    let job = Job::shipped().with_reference();
    let said = job.check(&format!("{LIMITS}dwells = {{ normal = 61 }}{SHIFTS}"));
    assert_eq!(said.code, 0);
    assert_valid(&said.junit);
    assert!(said.failures().is_empty());
    // 3 errors, 3 recordings twice, one exact count, the verdict, two severities, 4 shifts.
    assert!(
        said.last_line().starts_with("paper: 17 of 17 checks hold; held out 0.1"),
        "{}",
        said.last_line()
    );
    assert!(said.last_line().ends_with(", nothing missing"), "{}", said.last_line());
    assert!(said.markdown.starts_with("### ✅ paper: 17 of 17 checks hold"), "{}", said.markdown);
    assert_eq!(said.markdown.matches("| holds |").count(), 17);
}

#[test]
fn a_slipped_encoder_is_named_with_its_joint_and_its_recording() {
    // A tooth of 128 is 2.8125 deg.
    let slip = "kind = \"zero_slip\"\njoint = 2\nslip_deg = 2.8125\nrecording = 2\n";
    let said = Job::hiding(slip).check(LIMITS);
    assert_eq!(said.code, 1);
    assert_valid(&said.junit);
    for check in ["max_holdout_mean_mm", "max_over_floor", "verdicts"] {
        let why = said.why(check);
        assert!(why.contains("`zero_slip:2@2`") && why.contains("at joint2, in `pitch`"), "{check}: {why}");
        assert!(why.contains("An encoder or a belt slipped") && why.contains("1.00 of 128 teeth"), "{why}");
    }
    assert!(said.last_line().contains("broken: max_holdout_mean_mm"), "{}", said.last_line());
    assert!(
        said.last_line().contains("missing zero_slip:2 in `pitch` (zero_slip:2@2)"),
        "{}",
        said.last_line()
    );
    assert!(said.markdown.contains("An encoder or a belt slipped"));
    // One cause of many broken limits is told once in the terminal.
    assert_eq!(said.stdout.matches("`zero_slip:2@2` at joint2").count(), 1);
}

#[test]
fn an_encoder_that_slips_during_a_recording_is_named_with_its_dwell() {
    let slip = "kind = \"zero_slip\"\njoint = 2\nslip_deg = 2.8125\nrecording = 1\nat_s = 60.0\n";
    let said = Job::hiding(slip).check(LIMITS);
    assert_eq!(said.code, 1);
    let why = said.why("max_over_floor");
    assert!(why.contains("at joint2, from dwell 1") && why.contains("of `roll` on"), "{why}");
}

#[test]
fn an_encoder_that_slipped_before_the_job_is_seen_against_the_reference() {
    // Half a tooth, within the bounds of the fit, which takes it for geometry: nothing else shows.
    let slip = "kind = \"zero_slip\"\njoint = 2\nslip_deg = -1.40625\nrecording = 0\n";
    let said = Job::hiding(slip).with_reference().check(&format!("{LIMITS}{SHIFTS}"));
    assert_eq!(said.code, 1);
    assert_eq!(said.broken(), ["max_shift_deg"]);
    let why = said.why("max_shift_deg");
    assert!(why.contains("`joint2.theta` moved by -1.4") && why.contains("0.50 of 128 teeth"), "{why}");
    assert!(why.contains("The zero of joint2 shifted"), "{why}");
}

#[test]
fn a_slip_beyond_the_bounds_of_the_fit_is_named_by_its_bound() {
    let slip = "kind = \"zero_slip\"\njoint = 2\nslip_deg = 2.8125\nrecording = 0\n";
    let said = Job::hiding(slip).check("[check]\nmax_over_floor = 1.5\n");
    assert_eq!(said.code, 1);
    let why = said.why("max_over_floor");
    assert!(why.contains("`joint2.theta` is on its bound") && why.contains("the zero of joint2"), "{why}");
    assert!(
        said.last_line().ends_with("setup: joint-zero; 2 warnings make it doubtful"),
        "{}",
        said.last_line()
    );
}

#[test]
fn a_table_that_was_bumped_before_the_job_is_seen_against_the_reference() {
    let bump = "kind = \"bump\"\nbody = \"board\"\nshift_mm = [12.0, -3.0, 0.0]\nrecording = 0\n";
    let said = Job::hiding(bump).with_reference().check(&format!("{LIMITS}{SHIFTS}"));
    assert_eq!(said.code, 1);
    assert_eq!(said.broken(), ["max_frame_shift_mm"]);
    let why = said.why("max_frame_shift_mm");
    for board in ["board.normal", "board.roll", "board.pitch"] {
        // sqrt(12^2 + 3^2) = 12.37 mm, as the sensor sees it.
        assert!(why.contains(&format!("`{board}` moved by 12.3")), "{why}");
    }
    assert!(why.contains("The base did not: the table was bumped") && !why.contains("`base` moved"), "{why}");
}

#[test]
fn a_table_that_is_bumped_during_a_recording_is_named() {
    let bump = "kind = \"bump\"\nbody = \"board\"\nshift_mm = [5.0, -3.0, 0.0]\nrecording = 1\nat_s = 60.0\n";
    let said = Job::hiding(bump).check(LIMITS);
    assert_eq!(said.code, 1);
    let why = said.why("max_over_floor");
    assert!(why.contains("In `roll` the table moved") && why.contains("jumped by 5.8"), "{why}");
    assert!(why.contains("The table was bumped"), "{why}");
}

/// Neither a robot that was pushed may pass, nor cameras that were calibrated anew fail.
#[test]
fn what_moved_against_what_is_told_apart() {
    let bump = |body: &str, turn: f64| {
        let motion = format!("shift_mm = [0.0, 9.0, 0.0]\nturn_deg = [0.0, 0.0, {turn:.1}]\n");
        let job = Job::hiding(&format!("kind = \"bump\"\nbody = \"{body}\"\n{motion}recording = 0\n"));
        job.with_reference().check(&format!("[check]{SHIFTS}"))
    };
    let base = bump("base", 0.0);
    assert_eq!((base.code, base.broken()), (1, vec!["max_frame_shift_mm".to_owned()]));
    let why = base.why("max_frame_shift_mm");
    let by_mm =
        why.split("`base` moved by ").nth(1).and_then(|rest| rest.split(' ').next()?.parse::<f64>().ok());
    assert!(by_mm.is_some_and(|mm| (mm - 9.0).abs() < 0.1) && why.contains("the robot's foot slid"), "{why}");

    let cameras = bump("cameras", 2.0);
    assert_eq!(cameras.code, 0);
    assert!(cameras.junit.contains("cameras calibrated anew"), "{}", cameras.junit);
}

#[test]
fn an_effect_that_is_allowed_breaks_nothing_and_errors_above_what_is_wanted_are_a_doubt() {
    let slip = "kind = \"zero_slip\"\njoint = 2\nslip_deg = 2.8125\nrecording = 2\n";
    let job = Job::hiding(slip);
    let allows = "[check]\nallowed_effects = [\"zero_slip:joint2\"]\n";
    let allowed = job.check(allows);
    assert_eq!(allowed.code, 0);
    assert!(allowed.failures().is_empty());
    let wanted = job.check(&format!("{allows}[accuracy]\nwanted_mm = 0.2\n"));
    assert_eq!((wanted.code, wanted.failures().len()), (3, 0));
    assert!(allowed.last_line().contains("1 of 1 checks hold"), "{}", allowed.last_line());
    let other = job.check("[check]\nallowed_effects = [\"zero_slip:1\", \"backlash\"]\n");
    assert_eq!((other.code, other.broken()), (1, vec!["allowed_effects".to_owned()]));
}

#[test]
fn lost_data_are_a_doubt_until_a_limit_accepts_them() {
    let job = Job::shipped();
    let copy = job.path("cut");
    std::fs::create_dir(&copy).expect("folder");
    for name in ["normal.mcap", "roll.mcap", "pitch.mcap"] {
        let mut bytes = std::fs::read(job.recordings.join(name)).expect("recording");
        if name == "roll.mcap" {
            bytes.truncate(bytes.len() * 6 / 10);
        }
        std::fs::write(copy.join(name), bytes).expect("recording");
    }
    let job = Job { recordings: copy, ..job };
    let doubtful = job.check("[check]\nmax_over_floor = 1.5\n");
    assert_eq!(doubtful.code, 3);
    assert!(doubtful.last_line().contains("doubtful"), "{}", doubtful.last_line());
    assert!(doubtful.markdown.starts_with("### ⚠️"), "{}", doubtful.markdown);
    assert_valid(&doubtful.junit);
    let accepted =
        job.check("[check]\nmax_over_floor = 1.5\nmax_warnings = { data_lost = 9, inadequate = 9 }\n");
    assert_eq!(accepted.code, 0);
    let refused = job.check("[check]\nmin_dwells = 50\nmax_warnings = { data_lost = 0 }\n");
    assert_eq!((refused.code, refused.broken().len()), (1, 2));
    assert!(refused.why("min_dwells.roll").contains("cut short"), "{}", refused.junit);
    assert!(refused.why("max_warnings.data_lost").contains("roll"), "{}", refused.junit);
}

#[test]
fn a_run_that_fails_leaves_its_error_where_ci_shows_it() {
    let job = Job::shipped();
    let job = Job { recordings: job.path("<nowhere> & away"), ..job };
    let said = job.check(LIMITS);
    assert_eq!(said.code, 1);
    assert_valid(&said.junit);
    let document = roxmltree::Document::parse(&said.junit).expect("well-formed XML");
    let error = document.descendants().find(|n| n.has_tag_name("error")).expect("an error");
    let message = error.attribute("message").expect("a message");
    assert!(message.contains("<nowhere> & away") && message.contains("normal.mcap"), "{message}");
    assert!(said.stderr.contains("normal.mcap"));
    assert_eq!(said.last_line(), "rig: no check was made, the run failed");
    assert!(said.markdown.contains("&lt;nowhere&gt; &amp; away"), "{}", said.markdown);
}

#[test]
fn limits_that_cannot_be_meant_are_refused_by_their_key() {
    let job = Job::shipped();
    for (line, named) in [
        ("max_holdout_mean = 0.2", "max_holdout_mean_mm"),
        ("max_over_floor = nan", "check.max_over_floor"),
        ("verdicts = [\"nothing\"]", "nothing_missing"),
        ("allowed_effects = [\"backlsh:1\"]", "did you mean \"backlash\"?"),
        ("dwells = { norml = 61 }", "normal, roll, pitch"),
        ("min_dwells = 1\nteeth = { join2 = 128 }", "check.teeth.join2"),
        ("max_shift_mm = 0.5", "needs reference"),
        ("max_shift_mm = 0.5\nreference = \"nowhere.json\"", "nowhere.json"),
        ("max_shift_mm = 0.5\nreference = \"rig.toml\"", "rig.toml is not a summary"),
        ("max_warnings = { lost = 0 }", "data_lost"),
    ] {
        let said = job.check(&format!("[check]\n{line}\n"));
        assert_eq!(said.code, 1, "{line}");
        // A reference is a file of its own, named instead of the pipeline.
        let file = if line.contains("nowhere") { "check.reference" } else { "rig.toml" };
        assert!(said.stderr.contains(named) && said.stderr.contains(file), "{line}: {}", said.stderr);
    }
}

#[test]
fn a_pipeline_without_limits_is_a_usage_error_that_says_which_to_add() {
    for section in ["", "[check]\n"] {
        let said = Job::shipped().check(section);
        assert_eq!(said.code, 2);
        assert!(
            said.stderr.contains("max_over_floor") && said.stderr.contains("verdicts"),
            "{}",
            said.stderr
        );
    }
}

/// What our own CI asks, and what a program reads of it.
#[test]
fn the_shipped_pipeline_keeps_its_own_limits() {
    let pipeline = root().join("pipelines/paper.toml");
    let output = armcal([Path::new("check"), &pipeline, Path::new("--json")]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let judged: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!((&judged["schema"], &judged["judgement"]), (&"armcal.check/1".into(), &"holds".into()));
    let checks = judged["checks"].as_array().expect("checks");
    assert!(
        checks.len() >= 5 && checks.iter().all(|c| c["holds"] == true && c["why"] == Value::Array(vec![]))
    );
    let mean = checks.iter().find(|c| c["name"] == "max_holdout_mean_mm").expect("the mean error");
    assert!(number(mean, "/measured") < number(mean, "/limit") && mean["unit"] == "mm");
}
