//! Cost over the number of poses: a campaign of a 6-axis arm, calibrated with ten folds, without and with diagnosis.

use crate::child::{Cost, armcal_on_one};
use crate::page::{Bar, Section, Table, seconds};
use crate::{Options, Result, campaign};
use std::ffi::OsStr;
use std::path::Path;

/// Numbers of poses; 2,000 and 16,811 are what the bars are of.
const POSES: [usize; 5] = [200, 632, 2_000, 6_325, 16_811];
/// Poses, whether diagnosed, processor time [s] and memory [MiB] at most.
const BARS: [(usize, bool, f64, f64); 3] =
    [(2_000, true, 6.0, 250.0), (16_811, true, 40.0, 500.0), (16_811, false, 6.0, f64::INFINITY)];

pub fn section(options: &Options) -> Result<Section> {
    let mut section = Section::new("Growth");
    section.say(
        "A simulated campaign: a 6-axis arm before a laser tracker in four series, ripple hidden in three joints, 65 rows of each of \
         two streams a pose, one recording a series, ten folds held out in turn; the whole `armcal run`, page and all outputs \
         included, in a process with one thread. The exponent is that of the cost between a row and the one above it.",
    );
    let mut table = Table::new(&[
        "poses",
        "run [CPU s]",
        "exponent",
        "peak [MiB]",
        "with diagnosis [CPU s]",
        "exponent",
        "peak [MiB]",
    ]);
    let mut before: Option<(usize, [Cost; 2])> = None;
    let mut curve: Vec<(usize, [f64; 2])> = Vec::new();
    for poses in POSES.into_iter().filter(|poses| *poses <= options.poses) {
        let costs = [cost(options, poses, false)?, cost(options, poses, true)?];
        let exponent = |k: usize| {
            before.as_ref().map_or_else(String::new, |(fewer, cheaper)| {
                let grown = (costs[k].spent.cpu_s / cheaper[k].spent.cpu_s).ln();
                format!("{:.2}", grown / (poses as f64 / *fewer as f64).ln())
            })
        };
        let cells =
            |k: usize| [seconds(costs[k].spent.cpu_s), exponent(k), format!("{:.0}", costs[k].peak_mib)];
        table.row([poses.to_string()].into_iter().chain(cells(0)).chain(cells(1)));
        for (_, diagnosed, most_s, most_mib) in BARS.iter().filter(|bar| bar.0 == poses) {
            let cost = &costs[usize::from(*diagnosed)];
            let what = if *diagnosed { "with diagnosis" } else { "without diagnosis" };
            let memory = if most_mib.is_finite() { format!(", {most_mib} MiB") } else { String::new() };
            section.bar(Bar {
                what: format!("{poses} poses, 6 axes, 10 folds, {what}, one core"),
                limit: format!("<= {most_s} s{memory}"),
                measured: format!("{} s, {:.0} MiB", seconds(cost.spent.cpu_s), cost.peak_mib),
                met: cost.spent.cpu_s <= *most_s && cost.peak_mib <= *most_mib,
            });
        }
        curve.push((poses, [0, 1].map(|k| costs[k].spent.cpu_s)));
        before = Some((poses, costs));
    }
    section.table(table);
    section.figure(diagram(&curve));
    Ok(section)
}

/// Processor time over poses, both by powers of ten: a straight line grows with a constant exponent.
fn diagram(curve: &[(usize, [f64; 2])]) -> String {
    let poses: Vec<String> = curve.iter().map(|(poses, _)| poses.to_string()).collect();
    let line = |k: usize| {
        let values = curve.iter().map(|(_, cpu_s)| format!("{:.2}", cpu_s[k].log10()));
        values.collect::<Vec<_>>().join(", ")
    };
    format!(
        "xychart-beta\n    title \"CPU time: below without, above with diagnosis\"\n    x-axis \"poses (steps of a power of \
         ten's root)\" [{}]\n    y-axis \"log10 of CPU seconds\" -1 --> 3\n    line [{}]\n    line [{}]\n",
        poses.join(", "),
        line(0),
        line(1)
    )
}

fn cost(options: &Options, poses: usize, diagnosed: bool) -> Result<Cost> {
    let folder = options.data.join(format!("campaign-{poses}"));
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../pipelines/models").canonicalize()?;
    let pipeline = campaign::place(&folder, poses, diagnosed, &models)?;
    let out = folder.join("out");
    let cost =
        armcal_on_one([OsStr::new("run"), pipeline.as_os_str(), OsStr::new("--out"), out.as_os_str()])?;
    std::fs::remove_dir_all(&out)?;
    Ok(cost)
}
