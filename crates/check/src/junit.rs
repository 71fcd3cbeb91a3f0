//! The checks as JUnit XML, which CI systems show beside tests: a suite a pipeline, a case a limit.
//!
//! Without times and identifiers, so that the same result gives the same bytes.

use super::{Check, Judged};
use crate::error::CheckError;
use armcal_result::VERSION;
use quick_junit::{NonSuccessKind, Property, Report, TestCase, TestCaseStatus, TestSuite};
use quick_xml::events::{BytesStart, Event};
use quick_xml::{Reader, Writer};

/// Every check a case; a broken one fails with its sentence, and its causes in the body.
pub fn junit(judged: &Judged) -> Result<String, CheckError> {
    let mut suite = new_suite(&judged.pipeline);
    suite.add_property(Property::new("armcal.line", judged.line.as_str()));
    suite.add_test_cases(judged.checks.iter().map(|check| test_case(&judged.pipeline, check)));
    if !judged.doubts.is_empty() {
        suite.set_system_err(judged.doubts.join("\n"));
    }
    suite_xml(suite)
}

/// A run that did not come to its checks: one case in error.
pub fn junit_failed(pipeline: &str, error: &str) -> Result<String, CheckError> {
    let mut status = TestCaseStatus::non_success(NonSuccessKind::Error);
    status.set_message(error).set_type("armcal.failed").set_description(error);
    let mut case = TestCase::new("run", status);
    case.set_classname(class_name(pipeline));
    let mut suite = new_suite(pipeline);
    suite.add_test_case(case);
    suite_xml(suite)
}

fn new_suite(pipeline: &str) -> TestSuite {
    let mut suite = TestSuite::new(pipeline);
    suite.add_property(Property::new("armcal.version", VERSION));
    suite
}

fn test_case(pipeline: &str, check: &Check) -> TestCase {
    let status = if check.holds {
        TestCaseStatus::success()
    } else {
        let mut status = TestCaseStatus::non_success(NonSuccessKind::Failure);
        let numbers = format!("measured {}, limit {}", check.measured_text(), check.limit_text());
        status
            .set_message(format!("{}; {numbers}", check.said))
            .set_type("armcal.limit")
            .set_description(check.why.join("\n"));
        status
    };
    let mut case = TestCase::new(check.name.as_str(), status);
    case.set_classname(class_name(pipeline));
    if check.holds {
        case.set_system_out(check.said.as_str());
    }
    case
}

fn class_name(pipeline: &str) -> String {
    format!("armcal.{pipeline}")
}

fn suite_xml(suite: TestSuite) -> Result<String, CheckError> {
    let mut report = Report::new("armcal check");
    report.add_test_suite(suite);
    let xml = report.to_string().map_err(|e| CheckError::Junit(Box::new(e)))?;
    // The library drops control characters; these two are no characters of XML either.
    let xml = xml.replace(['\u{fffe}', '\u{ffff}'], "\u{fffd}");
    drop_skipped_count(&xml).map_err(|e| CheckError::Junit(Box::new(e)))
}

/// Without the `skipped` count of the root: the schema of Jenkins knows it of a suite only, and its xUnit plugin refuses
/// the file.
fn drop_skipped_count(xml: &str) -> Result<String, std::io::Error> {
    let mut reader = Reader::from_str(xml);
    let mut writer = Writer::new(Vec::new());
    loop {
        match reader.read_event().map_err(std::io::Error::other)? {
            Event::Eof => break,
            Event::Start(tag) if tag.name().as_ref() == b"testsuites" => {
                let mut root = BytesStart::new("testsuites");
                let kept = tag.attributes().flatten().filter(|a| a.key.as_ref() != b"skipped");
                root.extend_attributes(kept);
                writer.write_event(Event::Start(root))?;
            }
            event => writer.write_event(event)?,
        }
    }
    String::from_utf8(writer.into_inner()).map_err(std::io::Error::other)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hostile_words_stay_words() {
        let hostile = "]]> <failure/> & \"quoted\" 'x' \u{1b}[31m\u{0}\u{fffe}\u{ffff} </testsuites>";
        let xml = junit_failed(hostile, hostile).expect("XML");
        let document = roxmltree::Document::parse(&xml).expect("well-formed");
        let errors: Vec<_> = document.descendants().filter(|n| n.has_tag_name("error")).collect();
        assert_eq!(errors.len(), 1);
        assert_eq!(document.descendants().filter(|n| n.has_tag_name("failure")).count(), 0);
        let message = errors[0].attribute("message").expect("a message");
        assert!(message.starts_with("]]> <failure/> & \"quoted\" 'x' "), "{message}");
        assert!(!message.contains(['\u{1b}', '\u{0}', '\u{fffe}', '\u{ffff}']), "{message:?}");
    }
}
