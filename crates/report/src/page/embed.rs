//! Putting data and scripts into a page so that neither can become anything else.

use crate::ReportError;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;
use sha2::{Digest as _, Sha256};

/// The charting library.
pub(crate) const PLOTLY: &str = include_str!("assets/vendor/plotly-basic.min.js");
/// The look of all pages.
pub(crate) const STYLE: &str = include_str!("assets/style.css");

/// How scripts make text of names.
pub(crate) const TEXT: &str = include_str!("assets/text.js");
/// How scripts draw charts.
pub(crate) const CHART: &str = include_str!("assets/chart.js");

/// How scripts draw an axis of recorded time.
pub(crate) const TIME: &str = include_str!("assets/time.js");

/// Scripts as one, which then starts.
pub(crate) fn script(parts: &[&str]) -> String {
    format!("\"use strict\";\n{}start();\n", parts.concat())
}

/// JSON that stays data inside `<script type="application/json">`: no `<` can end the element or open a comment.
pub(crate) fn json_for_html(value: &impl Serialize) -> Result<String, ReportError> {
    let text = serde_json::to_string(value).map_err(ReportError::Page)?;
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '<' => safe.push_str("\\u003c"),
            '>' => safe.push_str("\\u003e"),
            '&' => safe.push_str("\\u0026"),
            '\u{2028}' => safe.push_str("\\u2028"),
            '\u{2029}' => safe.push_str("\\u2029"),
            c => safe.push(c),
        }
    }
    Ok(safe)
}

/// The content security policy of a page that runs these scripts and no other, and talks to nobody.
pub(crate) fn content_security_policy(scripts: &[&str]) -> String {
    let hashes: Vec<String> = scripts
        .iter()
        .map(|s| format!("'sha256-{}'", STANDARD.encode(Sha256::digest(s.as_bytes()))))
        .collect();
    format!(
        "default-src 'none'; script-src {}; style-src 'unsafe-inline'; img-src data: blob:; connect-src 'none'; \
         base-uri 'none'; form-action 'none'",
        hashes.join(" ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_name_leaves_its_string() {
        let hostile = "</script><script>alert(1)</script><!-- & \u{2028} \"'";
        let safe = json_for_html(&[hostile]).expect("json");
        assert!(!safe.contains(['<', '>', '&', '\u{2028}']), "{safe}");
        assert_eq!(serde_json::from_str::<[String; 1]>(&safe).expect("json")[0], hostile);
    }

    #[test]
    fn the_library_does_not_end_its_element() {
        assert!(!PLOTLY.to_lowercase().contains("</script"));
        assert!(!STYLE.to_lowercase().contains("</style"));
    }
}
