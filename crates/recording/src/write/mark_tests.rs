use super::*;
use crate::bytes::input;
use crate::write::atomic::{self, AtomicFile};
use crate::write::output::McapOutput;
use crate::{Over, make_folder, make_folder_in, may_put, may_write, may_write_all, may_write_over};
use std::collections::BTreeMap;
use std::io::Write as _;

fn kind_of(text: &str) -> Option<String> {
    Mark::of_text(text.as_bytes()).map(|mark| mark.kind().to_owned())
}

#[test]
fn texts_of_armcal_are_known_and_others_are_not() {
    for (text, kind) in [
        ("{\"schema\":\"armcal.observations/1\",", "observations"),
        ("\n { \"schema\" : \"armcal.closed-chain/2\" }", "closed-chain"),
        (
            "<!doctype html>\n<html>\n<head>\n<meta name=\"generator\" content=\"armcal.report-page/1\">\n",
            "report-page",
        ),
        ("<?xml version=\"1.0\"?>\n<!-- armcal.calibrated-model/1 -->\n<robot/>", "calibrated-model"),
        ("# armcal.simulated-board/1\nname = 'x'\n", "simulated-board"),
        ("# Where `armcal view` finds the pipeline of these results.\npipeline = 'p'\n", "view"),
        ("<!doctype html>\n<title>rig – armcal</title>\n", "page"),
        ("name,kind,t_s,x_m,y_m,z_m,nominal.joint1_rad,set_point.joint1_rad\n", "set-points"),
        ("joint,type,convention,theta_deg,d_mm,a_mm,alpha_deg\njoint1,", "dh-rows"),
    ] {
        assert_eq!(kind_of(text).as_deref(), Some(kind), "{text}");
    }
    for text in [
        "",
        "{\"schema\": \"mine/1\"}",
        "{\"name\": 1, \"schema\": \"armcal.summary/1\"}",
        "{\"schema\": \"armcal.summary\"}",
        "{\"schema\": \"armcal./1\"}",
        "# my notes on armcal.summary/1\n",
        "name = 'armcal'\n# armcal\n",
        "<!doctype html>\n<title>my robots</title>\n",
        "name,kind,t_s,x_m\n",
        "joint,type,convention,theta_deg,d_mm\n",
        "\u{0}\u{1}# armcal.view/1",
    ] {
        assert_eq!(kind_of(text), None, "{text}");
    }
    let late = format!("{}# armcal.view/1\n", "\n".repeat(8));
    assert_eq!(kind_of(&late), None, "a mark far down is somebody's text");
}

#[test]
fn a_page_of_an_earlier_version_gives_way_to_pages_only() {
    let [earlier, report, summary, other] =
        ["page", "report-page", "summary", "comparison-page"].map(|kind| unsealed_mark(kind.to_owned()));
    assert!(report.replaces(&earlier) && report.replaces(&report));
    assert!(!summary.replaces(&earlier) && !report.replaces(&other) && !earlier.replaces(&report));
}

fn write_mcap(path: &Path, records: &[&str], attached: &[(&str, &[u8])]) {
    let mut out = McapOutput::create(path, "").expect("created");
    for (name, data) in attached {
        out.attach(name, "text/plain", 0, 0, data).expect("attached");
    }
    records.iter().for_each(|name| out.metadata(name, &BTreeMap::new()).expect("written"));
    out.finish().expect("finished");
}

/// The kind that a recording has, written beside others so that nothing is replaced.
#[test]
fn a_recording_of_armcal_is_what_its_records_make_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let mark = |path: &Path| Mark::of_file(path).expect("readable").map(|mark| mark.kind().to_owned());
    for (records, kind) in [
        (&["armcal.lab"][..], Some("simulated-recording")),
        (&["armcal.lab", "armcal/run"], Some("run")),
        (&["armcal/run", "lab", EXTRACT_METADATA], Some("extract")),
        (&[SET_POINTS_METADATA], Some("set-points-recording")),
        (&["lab"], None),
        (&[], None),
    ] {
        let path = folder.path().join(format!("{}.mcap", records.join("-").replace('/', "-")));
        write_mcap(&path, records, &[]);
        assert_eq!(mark(&path).as_deref(), kind, "{records:?}");
        // Cut off, it is no result but what is left of one.
        let bytes = std::fs::read(&path).expect("readable");
        std::fs::write(&path, &bytes[..bytes.len() - 20]).expect("written");
        assert_eq!(mark(&path), None, "{records:?}, cut off");
    }
    let foreign = folder.path().join("foreign.mcap");
    let mut writer = mcap::Writer::new(std::fs::File::create(&foreign).expect("created")).expect("begun");
    let record = mcap::records::Metadata { name: "armcal/run".into(), metadata: BTreeMap::new() };
    writer.write_metadata(&record).expect("written");
    writer.finish().expect("finished");
    assert_eq!(mark(&foreign), None, "by another library");
}

/// Versions before the marks left a calibrated model that says nothing; their run.mcap has it attached.
#[test]
fn a_file_without_a_mark_is_known_by_the_run_that_has_it_attached() {
    let folder = tempfile::tempdir().expect("a folder");
    let model = folder.path().join("calibrated.toml");
    let new = crate::seal_text("# armcal.calibrated-model/1\nname = 'new'\n");
    let new = new.as_bytes();
    write_mcap(
        &folder.path().join("run.mcap"),
        &["armcal/run"],
        &[("armcal/calibrated.toml", b"name = 'old'\n")],
    );
    std::fs::write(&model, "name = 'mine'\n").expect("written");
    assert!(matches!(atomic::write(&model, new), Err(RecordingError::NotOurs { .. })));
    std::fs::write(&model, "name = 'old'\n").expect("written");
    assert!(matches!(atomic::write(&model, b"name = 'unmarked'\n"), Err(RecordingError::NotOurs { .. })));
    atomic::write(&model, new).expect("its successor");
    assert_eq!(std::fs::read(&model).expect("readable"), new);
}

#[test]
fn inputs_are_never_written_over_whatever_they_are() {
    let folder = tempfile::tempdir().expect("a folder");
    let [ours, link, hard, later] =
        ["a.toml", "b.toml", "c.toml", "d.toml"].map(|name| folder.path().join(name));
    let text = crate::seal_text("# armcal.test/1\none\n");
    let text = text.as_bytes();
    atomic::write(&ours, text).expect("written");
    atomic::write(&ours, b"# armcal.test/1\ntwo\n").expect("its own kind");
    let mut begun = AtomicFile::create(&ours).expect("begun before it is read");
    begun.write_all(text).expect("written");
    assert_eq!(
        input::read_to_string(&ours, input::Kind::Text).expect("readable"),
        crate::seal_text("# armcal.test/1\ntwo\n")
    );
    std::os::unix::fs::symlink(&ours, &link).expect("linked");
    std::fs::hard_link(&ours, &hard).expect("linked");
    for path in [&ours, &link, &hard, &folder.path().join("../").join(folder.path()).join("a.toml")] {
        let refused = [may_write(path), may_put(path, text), atomic::write(path, text)];
        for result in refused {
            assert!(matches!(result, Err(RecordingError::IsInput { .. })), "{}: {result:?}", path.display());
        }
    }
    assert!(matches!(begun.commit(), Err(RecordingError::IsInput { .. })), "asked again at the end");
    // The same bytes are not an input, and another inode is not.
    std::fs::copy(&ours, &later).expect("copied");
    atomic::write(&later, text).expect("a file of its own");
    std::fs::remove_file(&link).expect("removed");
    std::os::unix::fs::symlink(folder.path().join("nowhere"), &link).expect("linked");
    assert!(matches!(may_write(&link), Err(RecordingError::NotOurs { .. })), "a link that leads nowhere");
}

/// What appears while a file is written is looked at before it would be replaced.
#[test]
fn what_somebody_puts_there_meanwhile_stays() {
    let folder = tempfile::tempdir().expect("a folder");
    let target = folder.path().join("out.toml");
    let mut file = AtomicFile::create(&target).expect("begun");
    file.write_all(b"# armcal.test/1\n").expect("written");
    std::fs::write(&target, "mine").expect("written");
    assert!(matches!(file.commit(), Err(RecordingError::NotOurs { .. })));
    assert_eq!(std::fs::read(&target).expect("readable"), b"mine");
    // Without content there is nothing to lose, and the same content loses nothing.
    std::fs::write(&target, "").expect("written");
    atomic::write(&target, b"plain").expect("over an empty file");
    atomic::write(&target, b"plain").expect("the same again");
    assert!(atomic::write(&target, b"other").is_err());
}

#[test]
fn of_several_outputs_all_are_asked() {
    let folder = tempfile::tempdir().expect("a folder");
    let [free, ours, mine] = ["free.toml", "ours.toml", "mine.toml"].map(|name| folder.path().join(name));
    std::fs::write(&ours, "# armcal.test/1\n").expect("written");
    std::fs::write(&mine, "mine").expect("written");
    may_write_all([&free, &ours]).expect("nothing is lost");
    assert!(
        matches!(may_write_all([&free, &ours, &mine]), Err(RecordingError::NotOurs { path, .. }) if path == mine)
    );
}

#[test]
fn another_kind_of_result_and_a_link_with_the_same_content_stay() {
    let folder = tempfile::tempdir().expect("a folder");
    let (ours, link) = (folder.path().join("a.toml"), folder.path().join("link"));
    std::fs::write(&ours, "# armcal.test/1\n").expect("written");
    may_put(&ours, b"# armcal.test/1\nnew = 1\n").expect("of the same kind");
    let other = may_put(&ours, b"# armcal.other/1\n");
    assert!(
        matches!(other, Err(RecordingError::NotOurs { ref what, .. }) if what.contains("test")),
        "{other:?}"
    );
    // A link is as long as the name that it leads to.
    std::fs::write(&ours, "6bytes").expect("written");
    std::os::unix::fs::symlink("a.toml", &link).expect("linked");
    may_put(&ours, b"6bytes").expect("it is there already");
    assert!(matches!(may_put(&link, b"6bytes"), Err(RecordingError::NotOurs { .. })));
}

#[test]
fn a_place_that_cannot_be_looked_at_is_no_free_place() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("file");
    std::fs::write(&file, "mine").expect("written");
    assert!(matches!(may_write(&file.join("out.toml")), Err(RecordingError::Write { .. })));
}

/// Somebody's changes are nobody's to take away, unless they say so.
#[test]
fn what_was_changed_since_is_replaced_only_where_that_is_asked_for() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.toml");
    let over = |over| atomic::write_over(&path, b"# armcal.pipeline/1\nnew = 1\n", over);
    let put = |text: &str| std::fs::write(&path, text).expect("written");
    let refused = |what: &str| match over(Over::Unchanged) {
        Err(RecordingError::NotOurs { what: said, .. }) => assert!(said.contains(what), "{said}"),
        other => panic!("{other:?}"),
    };
    atomic::write(&path, b"# armcal.pipeline/1\nold = 1\n").expect("written");
    over(Over::Unchanged).expect("as it was written");
    let written = std::fs::read_to_string(&path).expect("readable");
    put(&written.replace("new", "mine"));
    refused("changed since");
    assert!(matches!(may_write(&path), Err(RecordingError::NotOurs { .. })), "before the work begins");
    assert!(may_put(&path, b"# armcal.pipeline/1\nnew = 1\n").is_err());
    may_write_over(&path, Over::Changed).expect("asked for");
    over(Over::Changed).expect("asked for");
    assert_eq!(std::fs::read_to_string(&path).expect("readable"), written);
    // Of an earlier version, or without its hash: nobody knows. Results of earlier versions give way.
    put("# armcal.pipeline/1\nmine = 1\n");
    refused("does not tell");
    put("# armcal.other/1\n");
    refused("another result");
    // Not even where it is asked for: what armcal did not make.
    put("mine = 1\n");
    assert!(matches!(over(Over::Changed), Err(RecordingError::NotOurs { .. })));
}

#[test]
fn a_url_is_no_output_and_a_link_is_no_folder_inside_one() {
    let folder = tempfile::tempdir().expect("a folder");
    for url in ["s3://bucket/out", "gs://b/o.toml", "S3://b", "file:///tmp/out", "https://host/out"] {
        let url = Path::new(url);
        let refused = [may_write(url), may_put(url, b""), make_folder(url), atomic::write(url, b"x")];
        for result in refused {
            assert!(matches!(result, Err(RecordingError::NoFile { .. })), "{}: {result:?}", url.display());
        }
        assert!(matches!(may_write(&url.join("run.mcap")), Err(RecordingError::NoFile { .. })));
    }
    let (elsewhere, out) = (folder.path().join("elsewhere"), folder.path().join("out"));
    std::fs::create_dir(&elsewhere).expect("a folder");
    std::os::unix::fs::symlink(&elsewhere, &out).expect("linked");
    make_folder_in(&out, "shards").expect("the user named the link");
    std::os::unix::fs::symlink(&elsewhere, out.join("recordings")).expect("linked");
    assert!(matches!(make_folder_in(&out, "recordings"), Err(RecordingError::NotOurs { .. })));
}
