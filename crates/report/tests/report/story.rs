//! The first screen of the page, the first panel of the layout and the last lines of the terminal say the same.

use crate::findings::with_play_found;
use crate::recording::{get, own, read, string, write};
use crate::synthetic::{Synthetic, synthetic};
use armcal_config::InputMessages;
use armcal_core::{Code, Severity, Stage, Warning};
use armcal_report::{Detail, TerminalStyle, report_html, run_text, summary_json};
use armcal_result::Status;
use armcal_result::sensitivity::Basis;

/// Text without line breaks, indents and markup of characters.
fn flat(text: &str) -> String {
    let plain = text.replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&");
    let plain = plain.replace("&#60;", "<").replace("&#62;", ">").replace("&#38;", "&").replace("&#39;", "'");
    plain.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// What the three say of a run: lamp, and the lines of the story, found in page and terminal too.
fn said(s: &Synthetic, folder: &str) -> (String, Vec<String>) {
    let out = write(s, InputMessages::Reference, folder);
    let story = own(&read(&out.join("run.mcap")), "/armcal/story").remove(0);
    let lines: Vec<String> = get(&story, "lines")
        .as_list()
        .unwrap()
        .iter()
        .map(|line| line.as_str().unwrap().to_owned())
        .collect();
    let page = flat(&std::fs::read_to_string(out.join("report.html")).unwrap());
    let header = page.split("</header>").next().unwrap().to_owned();
    let everything = flat(&run_text(&s.run, TerminalStyle::Plain, Detail::Everything));
    let brief = flat(&run_text(&s.run, TerminalStyle::Plain, Detail::Story));
    for line in &lines {
        // The terminal sets the label in a column of its own, as the list of what was found its dash. What a panel has no room
        // for, it has elsewhere than the terminal.
        let words = flat(line.trim_start_matches("found: ").trim_start_matches("next: "));
        let (words, text) = match words.split_once(", on the tab") {
            Some((more, _)) => (more.to_owned(), &brief),
            None if line.starts_with("found: ") => (words, &brief),
            None => (words, &everything),
        };
        assert!(text.contains(&words), "{words:?} in {text}");
    }
    for line in &lines[..3] {
        assert!(header.contains(&flat(line)), "{line:?} in {header}");
        assert!(brief.contains(&flat(line)), "{line:?} in {brief}");
    }
    for next in lines.iter().filter_map(|l| l.strip_prefix("next: ")).take(2) {
        assert!(header.contains(&flat(next)) && brief.contains(&flat(next)), "{next:?}");
    }
    let all = |field: &str| get(&story, field).as_list().unwrap().to_vec();
    for entry in all("next").iter().chain(&all("found")) {
        assert!(everything.contains(&flat(entry.as_str().unwrap())), "{entry:?} in {everything}");
    }
    (string(&story, "lamp"), lines)
}

#[test]
fn page_layout_and_terminal_say_the_same() {
    let plain = synthetic();
    let (lamp, lines) = said(&plain, "plain");
    assert_eq!(lines[0], armcal_wording::answer(&plain.run).sentence);
    assert!(lines[2].starts_with("Status: "));
    if plain.run.status() != Status::Ok {
        assert!(["inadequate", "data_lost", "unexplained", "setup"].contains(&lamp.as_str()), "{lamp}");
    }
    let mut found = synthetic();
    with_play_found(&mut found, 1e-3);
    said(&found, "found");
}

#[test]
fn people_are_told_names_of_recordings_and_programs_their_indices() {
    let mut s = synthetic();
    let (subject, message) =
        ("recording 0 dwell 5 (cavity a)", "frame_shift@0 and tool_shift@1.4 tell of it");
    s.run.warnings.push(Warning::new(
        Severity::Inadequate,
        Stage::Calibrate,
        Code::NotConverged,
        subject,
        message,
    ));
    let told = "dwell 5 of `normal` (cavity a): frame_shift in `normal` (frame_shift@0) and tool_shift from dwell 4 of `roll` on \
                (tool_shift@1.4) tell of it";
    said(&s, "named");
    assert!(flat(&run_text(&s.run, TerminalStyle::Plain, Detail::Everything)).contains(told));
    let page = report_html(&s.run, &Basis::of(&s.run)).unwrap();
    let [subject_told, message_told] = told.split_once(": ").map(|(a, b)| [a, b]).unwrap();
    assert!(flat(&page).contains(&format!("<td>{subject_told}</td><td>{message_told}</td>")));
    let summary = summary_json(&s.run).unwrap();
    assert!(summary.contains(subject) && summary.contains(message));
}

#[test]
fn a_lamp_is_green_only_where_the_result_stands() {
    let mut s = synthetic();
    s.run.warnings.push(Warning::new(
        Severity::DataLost,
        Stage::Recording,
        Code::RecordingDamaged,
        "normal",
        "a chunk is gone",
    ));
    let (lamp, lines) = said(&s, "lost");
    assert_eq!(s.run.status(), Status::DataLost);
    assert!(lamp != "nothing_missing" && lines[2].contains("data lost"), "{lamp} {lines:?}");
}
