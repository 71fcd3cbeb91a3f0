//! The checks as Markdown, for the summary page of a job.

use super::text::causes;
use super::{Judged, Judgement};

/// The answer, a table of all checks, and the causes of what is broken.
pub fn markdown(judged: &Judged) -> String {
    let mark = match judged.judgement {
        Judgement::Holds => "✅",
        Judgement::CompletedWithWarnings => "⚠️",
        Judgement::LimitExceeded => "❌",
    };
    let mut page = format!("### {mark} {}\n\n", escape_markdown(&judged.line));
    page.push_str("| check | measured | limit | |\n|---|--:|--:|---|\n");
    for check in &judged.checks {
        page.push_str(&format!(
            "| {} | {} | {} | {} |\n",
            escape_markdown(&check.name),
            escape_markdown(&check.measured_text()),
            escape_markdown(&check.limit_text()),
            if check.holds { "holds" } else { "**broken**" }
        ));
    }
    let causes = causes(judged);
    if !causes.is_empty() {
        page.push_str("\n#### Why\n\n");
    }
    for (checks, sentences) in causes {
        page.push_str(&format!("- {}\n", escape_markdown(&checks)));
        page.push_str(&sentences.iter().map(|s| format!("  - {}\n", escape_markdown(s))).collect::<String>());
    }
    if !judged.doubts.is_empty() {
        page.push_str("\n#### What makes it doubtful\n\n");
        page.push_str(
            &judged.doubts.iter().map(|d| format!("- {}\n", escape_markdown(d))).collect::<String>(),
        );
    }
    page
}

/// A run that did not come to its checks.
pub fn markdown_failed(pipeline: &str, error: &str) -> String {
    format!(
        "### ❌ {}: no check was made, the run failed\n\n{}\n",
        escape_markdown(pipeline),
        escape_markdown(error)
    )
}

/// Words that are not markup, on one line: names come from recordings.
fn escape_markdown(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            // A backslash does not keep GitHub from mentioning people.
            '@' => escaped.push_str("&#64;"),
            '\\' | '`' | '*' | '_' | '{' | '}' | '[' | ']' | '#' | '|' | '~' | '!' => {
                escaped.extend(['\\', c])
            }
            c if c.is_control() => escaped.push(' '),
            c => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::escape_markdown;

    #[test]
    fn names_are_no_markup() {
        assert_eq!(escape_markdown("a|b\n<img src=x>"), "a\\|b &lt;img src=x&gt;");
        assert_eq!(escape_markdown("[x](y) `z` @me"), "\\[x\\](y) \\`z\\` &#64;me");
    }
}
