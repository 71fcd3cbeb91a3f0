use crate::synthetic::{HOSTILE, synthetic};
use armcal_core::Severity;
use armcal_report::{Detail, TerminalStyle, run_text};
use armcal_wording::conclusion;

#[test]
fn what_a_person_reads() {
    let s = synthetic();
    insta::assert_snapshot!(run_text(&s.run, TerminalStyle::Plain, Detail::Everything));
}

#[test]
fn what_decides_fits_on_a_screen_and_ends_with_verdict_status_and_next_step() {
    let s = synthetic();
    let story = run_text(&s.run, TerminalStyle::Plain, Detail::Story);
    let everything = run_text(&s.run, TerminalStyle::Plain, Detail::Everything);
    assert!(story.lines().count() < 38, "{story}");
    let at = |text: &str, what: &str| text.find(what).unwrap_or_else(|| panic!("no {what:?} in {text}"));
    for text in [&story, &everything] {
        let answer = armcal_wording::answer(&s.run).sentence;
        let verdict = at(text, answer.split(' ').take(3).collect::<Vec<_>>().join(" ").as_str());
        assert!(at(text, "mean error falls") < verdict && verdict < at(text, "Status: "));
    }
    let overall = s.run.overall_warnings();
    let of_recordings = s.run.recordings.iter().flat_map(|r| r.all_warnings());
    let mut notices = 0;
    for w in overall.iter().chain(of_recordings) {
        notices += usize::from(w.severity == Severity::Notice);
        // Wrapped, so by its first words.
        let first = w.message.split(' ').take(2).collect::<Vec<_>>().join(" ");
        assert!(w.severity == Severity::Notice || story.contains(&first), "{first} in {story}");
    }
    assert!(story.contains(&format!("{notices} notice")), "{notices} in {story}");
    assert!(story.contains("parameters fitted, ") && !story.contains("notice  "));
}

#[test]
fn many_recordings_do_not_push_the_verdict_off_the_screen() {
    let mut s = synthetic();
    let one = s.run.recordings[0].clone();
    s.run.recordings.resize(40, one);
    let story = run_text(&s.run, TerminalStyle::Plain, Detail::Story);
    assert!(story.lines().count() < 38, "{story}");
    assert!(story.contains("and 36 more (`-v` lists them)"), "{story}");
    let everything = run_text(&s.run, TerminalStyle::Plain, Detail::Everything);
    assert!(!everything.contains("and 36 more"), "{everything}");
}

#[test]
fn where_nothing_is_left_out_nothing_is_said_to_be() {
    let mut s = synthetic();
    s.run.calibration.fit.estimates.iter_mut().for_each(|e| e.parameter.free = false);
    let said = run_text(&s.run, TerminalStyle::Plain, Detail::Story);
    assert!(!said.contains("parameters fitted") && said.contains(" notice"), "{said}");
    s.run.warnings.clear();
    s.run.calibration.warnings.clear();
    s.run.calibration.fit.warnings.clear();
    s.run.recordings.clear();
    assert_eq!(s.run.overall_warnings(), []);
    let said = run_text(&s.run, TerminalStyle::Plain, Detail::Story);
    assert!(!said.contains("lists them"), "{said}");
}

#[test]
fn it_fits_100_columns_and_obeys_no_control_characters_of_names() {
    let s = synthetic();
    let [plain, story] =
        [Detail::Everything, Detail::Story].map(|detail| run_text(&s.run, TerminalStyle::Plain, detail));
    for line in plain.lines().chain(story.lines()) {
        assert!(line.chars().count() <= 100, "{line}");
    }
    assert!(!plain.chars().any(|c| c.is_control() && c != '\n'));
    assert!(!plain.contains(HOSTILE) && plain.contains("</script>"));
}

#[test]
fn colour_adds_nothing_but_colour() {
    let s = synthetic();
    let (plain, colour) = (
        run_text(&s.run, TerminalStyle::Plain, Detail::Everything),
        run_text(&s.run, TerminalStyle::Colour, Detail::Everything),
    );
    let mut rest = colour.as_str();
    let mut without = String::new();
    while let Some((before, after)) = rest.split_once("\u{1b}[") {
        without.push_str(before);
        rest = after.split_once('m').unwrap().1;
    }
    without.push_str(rest);
    assert!(colour.contains("\u{1b}["));
    let trimmed = |text: &str| text.lines().map(|l| l.trim_end().to_owned()).collect::<Vec<_>>();
    assert_eq!(trimmed(&without), trimmed(&plain));
}

#[test]
fn the_closing_sentence_is_about_held_out_points() {
    let mut s = synthetic();
    let said = conclusion(&s.run.calibration);
    assert!(said.starts_with("On 4 held-out points the mean error falls from "), "{said}");
    assert!(said.ends_with("; the declared noise gives 0.18 mm."), "{said}");
    s.run.calibration.holdout = Default::default();
    let said = conclusion(&s.run.calibration);
    assert!(
        said.starts_with("Nothing was held out: on the 9 points the fit saw, the mean error falls"),
        "{said}"
    );
    s.run.calibration.train = Default::default();
    assert!(conclusion(&s.run.calibration).starts_with("No observation took part"));
}
