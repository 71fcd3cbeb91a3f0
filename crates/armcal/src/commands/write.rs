//! `armcal write`: the calibrated arm in what robots, planners and simulators read.

use super::{Outcome, may_write, print};
use crate::error::Error;
use armcal_config::read_text;
use armcal_core::ErrorStats;
use armcal_core::printable_name;
use armcal_core::units::format_mm;
use armcal_deploy::write::left::{Recorded, remaining_errors};
use armcal_deploy::write::{Made, Source, make_file};
use armcal_formats::Format;
use armcal_recording::atomic;
use armcal_recording::input::Kind;
use armcal_report::{plain_table, table_text};
use armcal_result::{StoredArms, StoredModel, open_model};
use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser as _};
use comfy_table::ContentArrangement;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Places that are less apart are one [m]: rounding alone.
const NOTHING_M: f64 = 1e-9;

/// What `armcal write` is asked to do.
#[derive(Debug, Clone, Args)]
pub struct Request {
    /// Results of `armcal run` or `armcal add`: their folder, run.mcap or model.json.
    pub result: PathBuf,
    /// The format.
    #[arg(long = "as", value_name = "FORMAT",
        value_parser = PossibleValuesParser::new(Format::names()).try_map(|name| Format::named(&name).ok_or("no format")))]
    pub format: Format,
    /// File to write; named after the format when absent.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Which arm, of two.
    #[arg(long, value_name = "NAME")]
    pub arm: Option<String>,
    /// For ur-yaml: kinematics file of the arm itself, as ur_calibration extracts it; its hash is kept.
    #[arg(long, value_name = "FILE")]
    pub hash_from: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

/// Reads the result, writes the file, prints what is in it and what is not.
pub fn run(request: &Request) -> Result<Outcome, Error> {
    let format = request.format;
    let past = open_model(&request.result)?;
    let arms = past.arms()?;
    let source = Source::of(&past, &arms, select_arm(&arms, request.arm.as_deref())?);
    let hash_from = hash_from(format, request.hash_from.as_deref())?;
    let recorded = Recorded::beside(&request.result, &past)?;
    let out = request.out.clone().unwrap_or_else(|| format.file_name().into());
    may_write([&out])?;
    let made = make_file(&source, format, hash_from.as_deref(), &recorded)?;
    let left = remaining_errors(&source, &recorded, made.zeros.as_ref());
    atomic::write(&out, &made.text).map_err(Error::Output)?;
    let said = Said { format, made: &made, left, over: recorded.what, past: &past };
    if request.json {
        print(&super::json_text(&said.json(&out))?)?;
    } else {
        print(&format!("{}\nWritten to {}\n", said.text(&source.skeleton.name), out.display()))?;
    }
    Ok(if past.missing.is_empty() { Outcome::Done } else { Outcome::CompletedWithWarnings })
}

/// The arm that is meant, of several by its name.
fn select_arm(arms: &StoredArms, asked: Option<&str>) -> Result<usize, Error> {
    let names: Vec<&str> = arms.model.chain().arms().iter().map(|arm| arm.name.as_str()).collect();
    let bad = |problem: String| Error::BadOption {
        option: "--arm",
        value: asked.unwrap_or("nothing").to_owned(),
        problem,
    };
    match asked {
        None if names.is_empty() => Ok(0),
        _ if names.is_empty() => Err(bad("the result is of one arm; leave it out".into())),
        _ => names.iter().position(|name| Some(*name) == asked).ok_or_else(|| {
            bad(format!(
                "a file is of one arm, and the arms of this result are {}; name one",
                names.join(", ")
            ))
        }),
    }
}

/// The text of the arm's own kinematics file, for the one format that needs it.
fn hash_from(format: Format, path: Option<&Path>) -> Result<Option<String>, Error> {
    let bad = |value: String, problem: &str| Error::BadOption {
        option: "--hash-from",
        value,
        problem: problem.to_owned(),
    };
    match (format, path) {
        (Format::UrYaml, None) => Err(bad(
            "nothing".into(),
            "the driver compares the file's hash with the arm's, and only the arm has it: name the kinematics file that \
             ur_calibration extracted from it",
        )),
        (Format::UrYaml, Some(path)) => Ok(Some(read_text("kinematics file", Kind::Text, path)?)),
        (_, Some(path)) => Err(bad(path.display().to_string(), "only ur-yaml has a hash; leave it out")),
        (_, None) => Ok(None),
    }
}

/// What is said of a file.
struct Said<'a> {
    format: Format,
    made: &'a Made,
    left: ErrorStats,
    over: &'static str,
    past: &'a StoredModel,
}

impl Said<'_> {
    fn text(&self, name: &str) -> String {
        let Said { format, made, .. } = self;
        let lacks: Vec<String> = made.by_hand.iter().chain(&made.lacks).cloned().collect();
        let mut text = format!("\"{}\" as {format}, for {}\n", printable_name(name), format.readers());
        let leaves = self.leaves();
        for (title, lines) in [
            ("in it", &made.holds),
            ("not in it", &lacks),
            ("to know", &made.notes),
            ("what that leaves", &leaves),
        ] {
            let mut table = plain_table();
            table.set_content_arrangement(ContentArrangement::Dynamic).set_width(100);
            table.add_rows(lines.iter().map(|line| ["-", line]));
            text +=
                &if lines.is_empty() { String::new() } else { format!("\n{title}\n{}", table_text(&table)) };
        }
        text
    }

    /// How far off the file is, and the model.
    fn leaves(&self) -> Vec<String> {
        let Said { made, left, past, over, .. } = self;
        let [mean, p95, most] = [left.mean_m, left.p95_m, left.max_m].map(format_mm);
        let entered = if made.by_hand.is_some() { ", with the tip entered as above" } else { "" };
        let mut lines = vec![match (left.n, left.max_m < NOTHING_M) {
            (0, _) => format!("nothing is known of it: there are no {over}"),
            (n, true) => format!("at all {n} {over} the tip is where the calibrated model has it{entered}"),
            (n, false) => format!(
                "at {n} {over} the tip is {mean} mm on average (95 % within {p95}, at most {most}) from where the calibrated \
                 model has it{entered}"
            ),
        }];
        lines.extend(
            past.mean_error_m
                .map(|m| format!("the model's own mean error where it was tested is {} mm", format_mm(m))),
        );
        if !past.missing.is_empty() {
            lines.push(format!(
                "the diagnosis of `{}` would add {}: what the model lacks is in no file; `armcal add suggested` first",
                past.pipeline,
                past.missing.join(", ")
            ));
        }
        lines
    }

    fn json(&self, out: &Path) -> Value {
        let Said { format, made, left, over, past } = self;
        json!({
            "schema": "armcal.write/1",
            "format": format.to_string(),
            "file": out.display().to_string(),
            "holds": made.holds, "lacks": made.lacks, "by_hand": made.by_hand, "notes": made.notes,
            "left_mm": {"n": left.n, "mean": left.mean_m * 1e3, "p95": left.p95_m * 1e3, "max": left.max_m * 1e3},
            "over": over,
            "mean_error_mm": past.mean_error_m.map(|mean_m| mean_m * 1e3),
            "missing": past.missing,
        })
    }
}
