//! Cost over the number of poses: a campaign of a 6-axis arm, calibrated with ten folds, without diagnosis and with it.

use crate::campaign::Weighed;
use crate::child::{Cost, armcal_on_one};
use crate::page::{Bar, Section, Table, seconds};
use crate::{Options, Result, campaign};
use std::ffi::OsStr;

/// Numbers of poses; 2,000 and 16,811 are what the bars are of.
const POSES: [usize; 6] = [200, 632, 2_000, 6_325, 16_811, 20_000];
/// How many of them are weighed.
const RUNS: [Weighed; 3] = [Weighed::None, Weighed::Default, Weighed::All];
/// Poses, how many are weighed, processor time [s] and memory [MiB] at most.
const BARS: [(usize, Weighed, f64, f64); 3] = [
    (2_000, Weighed::All, 6.0, 250.0),
    (16_811, Weighed::All, 40.0, 500.0),
    (16_811, Weighed::None, 6.0, f64::INFINITY),
];

pub fn section(options: &Options) -> Result<Section> {
    let mut section = Section::new("Growth");
    section.say(
        "A simulated campaign: a 6-axis arm before a laser tracker in four series, ripple hidden in three joints, 65 rows of each of \
         two streams a pose, one recording a series, ten folds held out in turn; the whole `armcal run`, page and all outputs \
         included, in a process with one thread: without diagnosis, with explanations weighed on at most 400 of the poses, which \
         is what a pipeline does that does not say, and on all of them. The exponent is that of the CPU time between a row and the one \
         above it.",
    );
    let columns = RUNS
        .iter()
        .map(|weighed| weighed.word())
        .flat_map(|how| [format!("{how} [CPU s]"), "exponent".to_owned(), "peak [MiB]".to_owned()]);
    let head: Vec<String> = std::iter::once("poses".to_owned()).chain(columns).collect();
    let mut table = Table::new(&head.iter().map(String::as_str).collect::<Vec<_>>());
    let mut curve: Vec<(usize, Vec<Cost>)> = Vec::new();
    for poses in POSES.into_iter().filter(|poses| *poses <= options.poses) {
        let costs = RUNS.iter().map(|weighed| cost(options, poses, *weighed));
        let costs = costs.collect::<Result<Vec<Cost>>>()?;
        let exponent = |k: usize| {
            curve.last().map_or_else(String::new, |(fewer, cheaper)| {
                let grown = (costs[k].spent.cpu_s / cheaper[k].spent.cpu_s).ln();
                format!("{:.2}", grown / (poses as f64 / *fewer as f64).ln())
            })
        };
        let cells =
            |k: usize| [seconds(costs[k].spent.cpu_s), exponent(k), format!("{:.0}", costs[k].peak_mib)];
        table.row(std::iter::once(poses.to_string()).chain((0..RUNS.len()).flat_map(cells)));
        for (weighed, cost) in RUNS.iter().zip(&costs) {
            let of_these = |bar: &&(usize, Weighed, f64, f64)| bar.0 == poses && bar.1 == *weighed;
            let Some((_, _, most_s, most_mib)) = BARS.iter().find(of_these) else { continue };
            let memory = if most_mib.is_finite() { format!(", {most_mib} MiB") } else { String::new() };
            let bar = Bar {
                what: format!("{poses} poses, 6 axes, 10 folds, {}, one core", weighed.word()),
                limit: format!("<= {most_s} s{memory}"),
                measured: format!("{} s, {:.0} MiB", seconds(cost.spent.cpu_s), cost.peak_mib),
                met: cost.spent.cpu_s <= *most_s && cost.peak_mib <= *most_mib,
            };
            section.bar_of(bar, || {
                let (without, stages) =
                    (&costs[0], "stages and floor are a column of the table in \"Where the time goes\"");
                match weighed {
                    Weighed::None => stages.to_owned(),
                    _ => format!(
                        "{stages}; without a diagnosis it is {} s and {:.0} MiB",
                        seconds(without.spent.cpu_s),
                        without.peak_mib
                    ),
                }
            });
        }
        curve.push((poses, costs));
    }
    section.table(table);
    section.figure(diagram(&curve));
    Ok(section)
}

/// Processor time over poses, both by powers of ten: a straight line grows with a constant exponent.
fn diagram(curve: &[(usize, Vec<Cost>)]) -> String {
    let poses: Vec<String> = curve.iter().map(|(poses, _)| poses.to_string()).collect();
    let line = |k: usize| {
        let values = curve.iter().map(|(_, costs)| format!("{:.2}", costs[k].spent.cpu_s.log10()));
        format!("    line [{}]\n", values.collect::<Vec<_>>().join(", "))
    };
    format!(
        "xychart-beta\n    title \"CPU time: without diagnosis (lowest), 400 weighed, all weighed (highest)\"\n    x-axis \"poses\" \
         [{}]\n    y-axis \"log10 of CPU seconds\" -1 --> 3\n{}",
        poses.join(", "),
        (0..RUNS.len()).map(line).collect::<String>()
    )
}

fn cost(options: &Options, poses: usize, weighed: Weighed) -> Result<Cost> {
    let pipeline = campaign::place(options, poses, weighed)?;
    let out = pipeline.with_file_name("out");
    let cost =
        armcal_on_one([OsStr::new("run"), pipeline.as_os_str(), OsStr::new("--out"), out.as_os_str()])?;
    std::fs::remove_dir_all(&out)?;
    Ok(cost)
}
