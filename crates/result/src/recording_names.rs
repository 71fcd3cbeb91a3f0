//! Recordings and moments by their names.
//!
//! The stages before a report know a recording by its index: a dwell is `recording 1 dwell 17`, an event
//! `tool_shift@1.17`. Whoever reads a sentence knows neither the count nor the spelling, so every sentence for people goes
//! through [`RecordingNames::in_words`]; files for programs keep the indices.

use armcal_core::{Warning, printable_name};
use armcal_model::{Since, place_and_moment};
use serde::{Deserialize, Serialize};

/// Names of recordings by their index in the pipeline.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct RecordingNames(Vec<String>);

impl RecordingNames {
    /// In the order of the pipeline.
    pub fn new(names: impl IntoIterator<Item = String>) -> RecordingNames {
        RecordingNames(names.into_iter().map(|name| printable_name(&name)).collect())
    }

    /// When an effect acts, in words that stand after its name: ` from dwell 17 of `roll` on`, ` in dwells 17 to 25 of `roll``,
    /// ` in `roll``; none where there is no such recording.
    pub fn moment(&self, since: Since) -> Option<String> {
        let name = |index: usize| self.0.get(index);
        Some(match since {
            Since::Recording(index) => format!(" in `{}`", name(index)?),
            Since::Dwell(first) => format!(" from dwell {} of `{}` on", first.dwell, name(first.recording)?),
            Since::Dwells { first, last } => {
                format!(" in dwells {} to {last} of `{}`", first.dwell, name(first.recording)?)
            }
        })
    }

    /// A sentence with recordings by their names, and events by their moment before their spelling: `tool_shift from dwell 17
    /// of `roll` on (tool_shift@1.17)`. What stands between backticks is for typing and stays.
    pub fn in_words(&self, sentence: &str) -> String {
        let parts = sentence.split('`').enumerate();
        let told = parts.map(|(k, part)| if k % 2 == 1 { part.to_owned() } else { self.without_code(part) });
        told.collect::<Vec<_>>().join("`")
    }

    /// Effects, or a parameter of one, as tables, axes and legends call them: an event by its moment and not by its spelling,
    /// `tool_shift from dwell 17 of roll on, x` for `tool_shift@1.17.x`.
    pub fn label(&self, name: &str) -> String {
        let each = name.split('+').map(|part| self.event_label(part).unwrap_or_else(|| part.to_owned()));
        each.collect::<Vec<_>>().join(" + ")
    }

    fn event_label(&self, name: &str) -> Option<String> {
        let moment_of = |spec: &str| {
            let (place, since) = place_and_moment(spec).filter(|(place, _)| !place.is_empty())?;
            Some(format!("{place}{}", self.moment(since?)?.replace('`', "")))
        };
        let shapes =
            |spec: &str| spec.split_once(',').map_or(String::new(), |(_, shapes)| format!(", {shapes}"));
        let whole = moment_of(name).map(|words| words + &shapes(name));
        whole.or_else(|| {
            let (event, parameter) = name.rsplit_once('.')?;
            Some(format!("{}{}, {parameter}", moment_of(event)?, shapes(event)))
        })
    }

    /// A number of the verdict as people call it: `probability of backlash:1` for `backlash:1.probability`.
    pub fn number_label(&self, number: &str) -> String {
        let of = |words: &str, effect: &str| format!("{words} {}", self.label(effect));
        match number.rsplit_once('.') {
            Some((effect, "probability")) => return of("probability of", effect),
            Some((effect, "gain")) => return of("evidence for", effect),
            Some((effect, "places")) => return of("places left out in turn, without and with", effect),
            Some((effect, "rival")) => return of("next best explanation after", effect),
            Some((effect, "contrast")) => return of("pairs of dwells that show", effect),
            _ => {}
        }
        let words = match number {
            "p_nothing" => "probability that nothing is missing",
            "p_adjusted" => "how often noise would look like it",
            "holdout_mm" => "mean error",
            "sigma_ratio" => "scatter",
            "not_testable" => "what these data could not have shown",
            "unknown" => "what has no listed cause",
            "tentative" => "what else the data ask for",
            "nested" => "the choice made again",
            other => other,
        };
        words.to_owned()
    }

    /// A warning for people.
    pub fn warning(&self, warning: &Warning) -> Warning {
        let Warning { subject, message, .. } = warning;
        Warning { subject: self.in_words(subject), message: self.in_words(message), ..warning.clone() }
    }

    fn without_code(&self, text: &str) -> String {
        let mut told = String::with_capacity(text.len());
        let mut rest = text;
        while let Some(next) = rest.chars().next() {
            let begins = !told.ends_with(|c: char| c.is_alphanumeric() || "_:@.".contains(c));
            let found = if begins { self.recording(rest).or_else(|| self.event(rest, &told)) } else { None };
            let (words, length) = found.unwrap_or_else(|| (next.to_string(), next.len_utf8()));
            told.push_str(&words);
            rest = &rest[length..];
        }
        told
    }

    /// `recording 1 dwell 17` or `recording 1` at the beginning of a text, in words, and its length there.
    fn recording(&self, text: &str) -> Option<(String, usize)> {
        let (index, after) = leading_number(text.strip_prefix("recording ")?)?;
        let name = self.0.get(index)?;
        match after.strip_prefix(" dwell ").and_then(leading_number) {
            Some((dwell, after)) => Some((format!("dwell {dwell} of `{name}`"), text.len() - after.len())),
            None => Some((format!("recording `{name}`"), text.len() - after.len())),
        }
    }

    /// The same of an event; one that stands in parentheses was told by the words before them.
    fn event(&self, text: &str, before: &str) -> Option<(String, usize)> {
        let end = text.find(|c: char| !(c.is_alphanumeric() || "_:@.-,=".contains(c))).unwrap_or(text.len());
        let spec = text[..end].trim_end_matches(['.', ',', ':', '-']);
        let (place, since) = place_and_moment(spec).filter(|(place, _)| !place.is_empty())?;
        let moment = self.moment(since?)?;
        let told_already = before.ends_with('(') && text[spec.len()..].starts_with(')');
        let words = if told_already { spec.to_owned() } else { format!("{place}{moment} ({spec})") };
        Some((words, spec.len()))
    }
}

/// The number that a text begins with, and what comes after it.
fn leading_number(text: &str) -> Option<(usize, &str)> {
    let end = text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
    Some((text[..end].parse().ok()?, &text[end..]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(sentence: &str) -> String {
        RecordingNames::new(["normal", "recording 0", "π"].map(str::to_owned)).in_words(sentence)
    }

    #[test]
    fn dwells_and_recordings_have_their_names() {
        assert_eq!(
            told("recording 0 dwell 3 (cavity a), recording 2 dwell 14 and 3 more"),
            "dwell 3 of `normal` (cavity a), dwell 14 of `π` and 3 more"
        );
        assert_eq!(told("largest in recording 1, less in recording 0."), {
            "largest in recording `recording 0`, less in recording `normal`."
        });
        for as_it_is in
            ["recording 7 dwell 2", "the recording", "2 recordings", "`recording 0`", "a recording"]
        {
            assert_eq!(told(as_it_is), as_it_is);
        }
    }

    #[test]
    fn tables_and_legends_have_words_and_no_spelling_of_moments() {
        let names = RecordingNames::new(["normal", "roll"].map(str::to_owned));
        let label = |name| names.label(name);
        assert_eq!(label("frame_shift@0"), "frame_shift in normal");
        assert_eq!(label("frame_shift@0.x"), "frame_shift in normal, x");
        assert_eq!(label("tool_shift@1.50"), "tool_shift from dwell 50 of roll on");
        assert_eq!(label("tool_shift@1.50.rx"), "tool_shift from dwell 50 of roll on, rx");
        assert_eq!(
            label("zero_slip:2@0.3-25,rest=0.5+backlash:1"),
            "zero_slip:2 in dwells 3 to 25 of normal, rest=0.5 + backlash:1"
        );
        for as_it_is in ["joint1.theta", "backlash:1.width", "frame_shift@9", "base_compliance,height=0.1"] {
            assert_eq!(label(as_it_is), as_it_is);
        }
        assert_eq!(names.number_label("frame_shift@0.probability"), "probability of frame_shift in normal");
        assert_eq!(names.number_label("backlash:1.rival"), "next best explanation after backlash:1");
        assert_eq!(names.number_label("p_nothing"), "probability that nothing is missing");
        assert_eq!(names.number_label("verdict"), "verdict");
    }

    #[test]
    fn events_have_their_moment_before_their_spelling() {
        assert_eq!(told("frame_shift@0: x 0.3 mm"), "frame_shift in `normal` (frame_shift@0): x 0.3 mm");
        assert_eq!(
            told("tool_shift@2.17 or zero_slip:2@0.3-25,rest=0.5."),
            "tool_shift from dwell 17 of `π` on (tool_shift@2.17) or \
             zero_slip:2 in dwells 3 to 25 of `normal` (zero_slip:2@0.3-25,rest=0.5)."
        );
        // Said once, however often a sentence passes through; what is typed stays.
        let once = told("`armcal add tool_shift@0 PIPELINE` for tool_shift@0+backlash:1");
        assert_eq!(
            once,
            "`armcal add tool_shift@0 PIPELINE` for tool_shift in `normal` (tool_shift@0)+backlash:1"
        );
        assert_eq!(told(&once), once);
        for as_it_is in ["backlash:1,rest=0.2", "me@home.org", "frame_shift@9", "frame_shift@0.x", "@0", "é@"]
        {
            assert_eq!(told(as_it_is), as_it_is);
        }
    }
}
