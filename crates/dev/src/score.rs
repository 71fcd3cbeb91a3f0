//! `armcal-dev score`: how often the diagnosis is right on sealed scenarios.

use crate::error::Error;
use armcal::progress::Progress;
use armcal::stdout::{print, print_json};
use armcal_lab::LabError;
use armcal_lab::planted::{
    catalogue_families, check_family, family_pairs, null_families, uncatalogued_families,
};
use armcal_lab::scenario::{Design, Scenario, Size, parse_word};
use armcal_recording::{atomic, may_write_all};
use armcal_score::{
    Campaign, Judgement, Reliability, Way, check_laws, confusion_page, family_rows, score_scenarios,
    terminal_table,
};
use clap::Args;
use serde_json::json;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

/// What to score.
#[derive(Debug, Clone, Args)]
pub struct Request {
    /// Families, or `catalogue`, `nothing`, `outside`, `pairs`; several hidden at once are joined by +.
    #[arg(default_values = ["catalogue", "nothing", "outside"])]
    pub families: Vec<String>,
    /// Designs of motion.
    #[arg(long = "design", default_values = ["free-poses"])]
    pub designs: Vec<String>,
    /// Size of what is hidden: small, medium, large, drawn.
    #[arg(long, default_value = "drawn")]
    pub size: String,
    /// Seeds for each family and design.
    #[arg(long, default_value_t = 10)]
    pub seeds: u64,
    /// First seed.
    #[arg(long, default_value_t = 1)]
    pub from: u64,
    /// Write recordings to disk and run the whole pipeline on them, instead of handing over observations.
    #[arg(long)]
    pub sealed: bool,
    /// Declare the noise of sensor, seats and encoders this many times as large as it is: names should not depend on it.
    #[arg(long, value_name = "F", default_value_t = 1.0, conflicts_with_all = ["sealed", "sealed_seeds"])]
    pub noise_factor: f64,
    /// Write the tables, with intervals and every miss, as Markdown: docs/confusion.md.
    #[arg(long, value_name = "FILE")]
    pub page: Option<PathBuf>,
    /// For the page: so many of the seeds of what is in the catalogue also the whole way, as recordings on disk.
    #[arg(long, default_value_t = 0, requires = "page", conflicts_with = "sealed")]
    pub sealed_seeds: u64,
    /// Ask the laws of every answer instead, each scenario seen in five ways: with `--page`, docs/laws.md.
    #[arg(long, conflicts_with_all = ["sealed", "sealed_seeds", "noise_factor", "json"])]
    pub laws: bool,
    /// Print JSON, every scenario with its answer.
    #[arg(long)]
    pub json: bool,
}

/// Runs the scenarios and prints the confusion table.
pub fn run(request: &Request) -> Result<(), Error> {
    armcal::threads::start_workers()?;
    let scenarios = select_scenarios(request)?;
    may_write_all(&request.page).map_err(Error::Output)?;
    let whole_way = whole_way(request, &scenarios);
    let progress = Progress::new();
    let (finished, all) = (AtomicUsize::new(0), scenarios.len() + whole_way.len());
    let done = || {
        let n = finished.fetch_add(1, Ordering::Relaxed) + 1;
        progress.step(&format!("scenario {n} of {all}"));
    };
    if request.laws {
        let laws = check_laws(&scenarios, &done)?;
        progress.finish();
        let text = laws.page(&page_command(request));
        if let Some(file) = &request.page {
            atomic::write(file, text.as_bytes()).map_err(Error::Output)?;
        }
        return Ok(print(&text)?);
    }
    let noise_factor = request.noise_factor;
    let way = if request.sealed { Way::Recorded } else { Way::Observed { noise_factor } };
    let scored = score_scenarios(&scenarios, way, &done)?;
    let whole_way = score_scenarios(&whole_way, Way::Recorded, &done)?;
    progress.finish();
    if let Some(file) = &request.page {
        let command = page_command(request);
        let campaign = Campaign { command, scored: &scored, whole_way: &whole_way, noise_factor };
        atomic::write(file, confusion_page(&campaign).as_bytes()).map_err(Error::Output)?;
    }
    let rows = family_rows(&scored);
    if request.json {
        let all = json!({ "rows": rows, "scenarios": scored, "whole_way": whole_way });
        print_json(&all)?;
    } else {
        print(&terminal_table(&rows))?;
        let wrong = scored.iter().filter(|s| s.judgement == Judgement::Wrong).count();
        let (first, last) = (request.from, request.from + request.seeds.saturating_sub(1));
        let slowest = scored.iter().map(|s| s.answer.seconds).fold(0.0, f64::max);
        print(&format!(
            "\n{} scenarios, seeds {first} to {last}, size {}; {wrong} confidently wrong; {}; slowest diagnosis {slowest:.2} s\n",
            scored.len(),
            request.size,
            Reliability::of(scored.iter()).claim(),
        ))?;
    }
    Ok(())
}

fn select_scenarios(request: &Request) -> Result<Vec<Scenario>, Error> {
    if !(request.noise_factor > 0.0 && request.noise_factor.is_finite()) {
        let why = format!("must be positive, is {}", request.noise_factor);
        return Err(Error::Usage(LabError::Value { key: "noise-factor".to_owned(), why }));
    }
    let mut names: Vec<String> = Vec::new();
    for word in &request.families {
        match word.as_str() {
            "catalogue" => names.extend(catalogue_families().into_iter().map(str::to_owned)),
            "nothing" => names.extend(null_families().into_iter().map(str::to_owned)),
            "pairs" => names.extend(family_pairs().into_iter().map(str::to_owned)),
            "outside" => names.extend(uncatalogued_families().into_iter().map(str::to_owned)),
            name => {
                check_family(name).map_err(Error::Usage)?;
                names.push(name.to_owned());
            }
        }
    }
    let size: Size = parse_word("size", &request.size).map_err(Error::Usage)?;
    let mut all = Vec::new();
    for design in &request.designs {
        let design: Design = parse_word("design", design).map_err(Error::Usage)?;
        for name in &names {
            for seed in request.from..request.from + request.seeds {
                all.push(Scenario { size, ..Scenario::new(name, design, seed) });
            }
        }
    }
    Ok(all)
}

/// The first seeds of single effects of the catalogue, again.
fn whole_way(request: &Request, scenarios: &[Scenario]) -> Vec<Scenario> {
    let last = request.from + request.sealed_seeds.min(request.seeds);
    let listed = catalogue_families();
    let again = scenarios.iter().filter(|s| s.seed < last && listed.contains(&s.family.as_str()));
    again.cloned().collect()
}

/// The command that makes the page again.
fn page_command(request: &Request) -> String {
    let mut words = vec!["cargo run --release -p armcal-dev -- score".to_owned()];
    words.extend(request.families.iter().cloned());
    if request.designs != ["free-poses"] {
        words.extend(request.designs.iter().map(|design| format!("--design {design}")));
    }
    if request.size != "drawn" {
        words.push(format!("--size {}", request.size));
    }
    words.push(format!("--seeds {} --from {}", request.seeds, request.from));
    if request.sealed {
        words.push("--sealed".to_owned());
    }
    if request.noise_factor != 1.0 {
        words.push(format!("--noise-factor {}", request.noise_factor));
    }
    if request.sealed_seeds > 0 {
        words.push(format!("--sealed-seeds {}", request.sealed_seeds));
    }
    // Where it was written to is no part of what was found.
    words.push(
        if request.laws { "--laws --page docs/laws.md" } else { "--page docs/confusion.md" }.to_owned(),
    );
    words.join(" ")
}
