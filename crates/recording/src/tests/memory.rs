//! Peak memory does not depend on the size of the file (`examples/peak_memory.rs` measures it up to 1 GB).

use crate::extract;
use crate::write::output::McapOutput;
use crate::{Access, Extract, Recording};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

const IMAGE_BYTES: usize = 500_000;

/// The same `/a` messages among more or fewer images, which do not compress.
fn generate(path: &Path, images: u64) {
    let mut out = McapOutput::create(path, "").expect("created");
    let wanted = out.add_channel("/a", None, "json", &BTreeMap::new()).expect("a channel");
    let camera = out.add_channel("/camera", None, "jpeg", &BTreeMap::new()).expect("a channel");
    let mut image = vec![0; IMAGE_BYTES];
    let mut random = 1_u64;
    for i in 0..240 {
        out.put(wanted, 0, i, i, b"{}").expect("written");
        for _ in i * images / 240..(i + 1) * images / 240 {
            for word in image.chunks_exact_mut(8) {
                random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                word.copy_from_slice(&(random ^ random >> 29).to_le_bytes());
            }
            out.put(camera, 0, i, i, &image).expect("written");
        }
    }
    out.finish().expect("finished");
}

#[test]
#[cfg(target_os = "linux")]
fn peak_memory_is_that_of_a_small_recording() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("recording.mcap");
    let mut peaks_mb = BTreeMap::new();
    for images in [24, 240] {
        let _ = std::fs::remove_file(&path);
        generate(&path, images);
        for access in ["mapped", "ranges"] {
            let output = Command::new(std::env::current_exe().expect("this program"))
                .args(["--exact", "tests::memory::reading_in_a_process_of_its_own", "--ignored"])
                .env("ARMCAL_TEST_READ", &path)
                .env("ARMCAL_TEST_ACCESS", access)
                .output()
                .expect("starting this program again");
            let said = String::from_utf8_lossy(&output.stdout).into_owned();
            assert!(output.status.success(), "{said}");
            let peak = std::fs::read_to_string(path.with_extension("peak")).expect("the peak");
            peaks_mb.insert((access, images), peak.parse::<f64>().expect("a number") / 1e3);
        }
    }
    // 12 and 120 MB of images, and buffers of some chunks for each of up to eight threads.
    for access in ["mapped", "ranges"] {
        let growth_mb = peaks_mb[&(access, 240)] - peaks_mb[&(access, 24)];
        assert!(growth_mb < 54.0, "{access}: {peaks_mb:?}");
    }
    assert!(peaks_mb[&("mapped", 240)] < 60.0, "{peaks_mb:?}");
}

/// Not a test of its own: the one above runs it, and reads the peak [kB] that it leaves beside the recording.
#[test]
#[ignore = "is run by peak_memory_is_that_of_a_small_recording"]
fn reading_in_a_process_of_its_own() {
    let path = PathBuf::from(std::env::var_os("ARMCAL_TEST_READ").expect("set by the test that runs this"));
    let ranges = std::env::var_os("ARMCAL_TEST_ACCESS").is_some_and(|access| access == "ranges");
    let access = if ranges { Access::Ranges } else { Access::Mapped };
    let recording = Recording::open_with(std::slice::from_ref(&path), access).expect("an MCAP file");
    let wanted = Extract { topics: &["/a".to_owned()], attachments: false };
    let thin = extract(&recording, &wanted, &path.with_extension("thin")).expect("extracted");
    assert_eq!(thin.topics, [("/a".to_owned(), 240)]);
    assert!(recording.report().warnings.is_empty());
    let status = std::fs::read_to_string("/proc/self/status").expect("Linux");
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).expect("a peak");
    let kilobytes = peak.split_whitespace().next().expect("a number");
    std::fs::write(path.with_extension("peak"), kilobytes).expect("written");
}
