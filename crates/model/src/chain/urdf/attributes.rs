//! How many attributes an element may have: whoever parses XML compares each with those before it.

/// URDF knows elements of six; a document of any size is read in time in proportion with this.
const MOST: usize = 256;

/// The line of an element that has more, if there is one.
pub(crate) fn too_many(xml: &str) -> Option<u32> {
    let mut rest = xml;
    while let Some(start) = rest.find('<') {
        rest = &rest[start..];
        let skipped = [("<!--", "-->"), ("<![CDATA[", "]]>"), ("<?", "?>")];
        if let Some((begin, end)) = skipped.into_iter().find(|(begin, _)| rest.starts_with(begin)) {
            let from = begin.len();
            rest = rest[from..].find(end).map_or("", |at| &rest[from + at..]);
            continue;
        }
        let (mut quote, mut count, mut length) = (None, 0, rest.len());
        for (at, c) in rest.char_indices().skip(1) {
            match (quote, c) {
                (Some(open), c) if c == open => quote = None,
                (Some(_), _) => {}
                (None, '"' | '\'') => quote = Some(c),
                (None, '=') => count += 1,
                (None, '>' | '<') => {
                    length = at;
                    break;
                }
                _ => {}
            }
        }
        if count > MOST {
            let before = &xml[..xml.len() - rest.len()];
            return u32::try_from(before.matches('\n').count() + 1).ok();
        }
        rest = &rest[length..];
    }
    None
}

/// Says so.
pub(crate) fn too_many_problem() -> String {
    format!("has more than {MOST} attributes; a URDF needs no more than six")
}

/// Why a text is not parsed as XML at all.
///
/// # Errors
/// An element with very many attributes.
pub fn check_xml(xml: &str) -> Result<(), String> {
    match too_many(xml) {
        None => Ok(()),
        Some(line) => Err(format!("line {line}: an element {}", too_many_problem())),
    }
}

#[cfg(test)]
mod tests {
    use super::{MOST, check_xml};

    #[test]
    fn attributes_are_counted_where_they_are_ones() {
        let element = |n: usize| {
            format!(
                "<robot>\n<joint {}/></robot>",
                (0..n).map(|i| format!("a{i}=\"<=>\" ")).collect::<String>()
            )
        };
        assert_eq!(check_xml(&element(MOST)), Ok(()));
        assert!(check_xml(&element(MOST + 1)).is_err_and(|why| why.contains("line 2")));
        let signs = "=".repeat(2 * MOST);
        for text in [
            format!("<!-- {signs} -->"),
            format!("<a>{signs}</a>"),
            format!("<a b=\"{signs}\"/>"),
            format!("<![CDATA[<{signs}]]>"),
        ] {
            assert_eq!(check_xml(&text), Ok(()), "{text}");
        }
        // Not a document, and still no more than looked at.
        for text in ["<", "<a b=\"", "<!--", "<<<<", ""] {
            assert_eq!(check_xml(text), Ok(()), "{text}");
        }
    }
}
