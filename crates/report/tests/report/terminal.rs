use crate::synthetic::{HOSTILE, synthetic};
use armcal_report::{TerminalStyle, conclusion, terminal};

#[test]
fn what_a_person_reads() {
    let s = synthetic();
    insta::assert_snapshot!(terminal(&s.run, TerminalStyle::Plain));
}

#[test]
fn it_fits_100_columns_and_obeys_no_control_characters_of_names() {
    let s = synthetic();
    let plain = terminal(&s.run, TerminalStyle::Plain);
    for line in plain.lines() {
        assert!(line.chars().count() <= 100, "{line}");
    }
    assert!(!plain.chars().any(|c| c.is_control() && c != '\n'));
    assert!(!plain.contains(HOSTILE) && plain.contains("</script>"));
}

#[test]
fn colour_adds_nothing_but_colour() {
    let s = synthetic();
    let (plain, colour) = (terminal(&s.run, TerminalStyle::Plain), terminal(&s.run, TerminalStyle::Colour));
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
    assert!(said.ends_with("; the noise floor is 0.18 mm."), "{said}");
    s.run.calibration.holdout = Default::default();
    let said = conclusion(&s.run.calibration);
    assert!(
        said.starts_with("Nothing was held out: on the 9 points the fit saw, the mean error falls"),
        "{said}"
    );
    s.run.calibration.train = Default::default();
    assert!(conclusion(&s.run.calibration).starts_with("No observation took part"));
}
