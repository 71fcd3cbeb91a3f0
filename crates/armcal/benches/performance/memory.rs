//! Peak resident memory over the size of the recordings: a session of the lab with ever more camera images between its
//! messages, inspected and run by processes that tell their own high-water mark.

use crate::child::armcal;
use crate::page::{Bar, Section, Table};
use crate::{Options, Result, recordings};
use armcal_lab::planted::seal;
use armcal_lab::scenario::{Design, Scenario};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// Sizes of the recording [MB].
const SIZES_MB: [u64; 4] = [10, 100, 1000, 2000];
/// The largest recording may take this many times the memory of the smallest.
const FLAT: f64 = 1.25;

pub fn section(options: &Options) -> Result<Section> {
    let mut section = Section::new("Memory over file size");
    section.say(
        "Peak resident set (VmHWM) of one process, one recording of 66 dwells whose joint and tracker messages are the same \
         at every size; the rest are camera images. `inspect` makes a full pass and hashes the file; `run` reads, calibrates, \
         diagnoses and writes every output, `run.mcap` with the streams included. Pages of a mapped file count as resident.",
    );
    let mut table = Table::new(&["recording [MB]", "inspect [MiB]", "run [MiB]"]);
    let folder = options.data.join("memory");
    let lab = folder.join("lab");
    if !lab.join("pipeline.toml").exists() {
        seal(&Scenario::new("nothing", Design::OneTiltBothWays, 1), &lab, &folder.join("truth.json"))?;
    }
    let mut peaks_mib: [Vec<f64>; 2] = Default::default();
    for size_mb in SIZES_MB {
        let (recording, pipeline) = place(&lab, &folder, size_mb)?;
        let out = folder.join("out");
        let inspect = armcal([OsStr::new("inspect"), recording.as_os_str()])?;
        let run = armcal([OsStr::new("run"), pipeline.as_os_str(), OsStr::new("--out"), out.as_os_str()])?;
        let megabytes = std::fs::metadata(&recording)?.len() as f64 * 1e-6;
        let peaks = [inspect.peak_mib, run.peak_mib];
        table.row([megabytes, peaks[0], peaks[1]].map(|v| format!("{v:.0}")));
        for (all, peak) in peaks_mib.iter_mut().zip(peaks) {
            all.push(peak);
        }
        // A gigabyte is quickly made again and long in the way.
        std::fs::remove_dir_all(&out)?;
        std::fs::remove_file(&recording)?;
    }
    section.table(table);
    for (what, peaks) in ["inspect", "run"].into_iter().zip(&peaks_mib) {
        let ratio = peaks.last().zip(peaks.first()).map_or(f64::NAN, |(last, first)| last / first);
        section.bar(Bar {
            what: format!("memory of {what} over file size, largest to smallest"),
            limit: format!("flat (<= {FLAT})"),
            measured: format!("{ratio:.2}"),
            met: ratio <= FLAT,
        });
    }
    Ok(section)
}

/// A folder with the session's pipeline and its recording grown to a size.
fn place(lab: &Path, folder: &Path, size_mb: u64) -> Result<(PathBuf, PathBuf)> {
    let place = folder.join(format!("{size_mb}mb"));
    std::fs::create_dir_all(&place)?;
    let mut recording = None;
    for entry in std::fs::read_dir(lab)? {
        let from = entry?.path();
        let to = place.join(from.file_name().ok_or("a file without a name")?);
        if from.extension().is_some_and(|e| e == "mcap") {
            recordings::with_camera(&from, &to, size_mb * 1_000_000, 1)?;
            recording = Some(to);
        } else {
            std::fs::copy(&from, &to)?;
        }
    }
    let recording = recording.ok_or("the lab left no recording")?;
    Ok((recording, place.join("pipeline.toml")))
}
