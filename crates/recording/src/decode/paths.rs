//! Paths of fields: names joined by dots, `[]` behind a list; a name in single quotes may hold anything, a quote as two of them.

use super::types::{Field, Repeat};
use std::borrow::Cow;

/// The path of the message that a field is in; empty for a field of the message itself.
pub fn parent_of(path: &str) -> &str {
    let last = unquoted(path).filter(|(_, c)| *c == '.').last();
    last.map_or("", |(at, _)| &path[..at])
}

/// Whether a path leads to more than one value.
pub fn has_list(path: &str) -> bool {
    unquoted(path).any(|(_, c)| matches!(c, '[' | '*'))
}

/// The characters of a path outside quotes, with their places.
pub(super) fn unquoted(path: &str) -> impl Iterator<Item = (usize, char)> {
    let mut quoted = false;
    path.char_indices().filter(move |(_, c)| {
        quoted ^= *c == '\'';
        !quoted && *c != '\''
    })
}

/// A field's name as a path has it.
pub(super) fn spelled(name: &str) -> Cow<'_, str> {
    match name.is_empty() || name.contains(['.', '[', ']', '*', '\'']) {
        true => Cow::Owned(in_quotes(name)),
        false => Cow::Borrowed(name),
    }
}

/// What is left of a path behind a field that it begins with: nothing where it ends there. A name may stand without its quotes.
pub(super) fn step<'p>(path: &'p str, field: &Field) -> Option<&'p str> {
    let quoted = path.starts_with('\'').then(|| path.strip_prefix(in_quotes(&field.name).as_str())).flatten();
    let rest = quoted.or_else(|| path.strip_prefix(field.name.as_str()))?;
    let rest = match field.repeat {
        Repeat::Once => rest,
        _ => rest.strip_prefix("[]")?,
    };
    match rest {
        "" => Some(""),
        _ => rest.strip_prefix('.').filter(|rest| !rest.is_empty()),
    }
}

fn in_quotes(name: &str) -> String {
    format!("'{}'", name.replace('\'', "''"))
}

#[cfg(test)]
mod tests {
    use super::super::types::Kind;
    use super::*;

    #[test]
    fn a_path_reaches_any_name() {
        for name in ["a", "a.b", "a.pos[]", "*", "it's", "'", "", "a b", "\u{e9}.x"] {
            for (repeat, list) in [(Repeat::Once, ""), (Repeat::Sequence, "[]")] {
                let field = Field { name: name.to_owned(), kind: Kind::Other, repeat };
                let path = spelled(name).into_owned() + list;
                assert_eq!(step(&path, &field), Some(""), "{path}");
                assert_eq!(step(&format!("{path}.y"), &field), Some("y"), "{path}");
                assert_eq!((parent_of(&format!("{path}.y")), parent_of(&path)), (path.as_str(), ""));
                assert_eq!(has_list(&path), !list.is_empty(), "{path}");
                for other in ["x", "a.bc", "a.pos", "its", "a."] {
                    assert_eq!(step(&(spelled(other).into_owned() + list), &field), None, "{other}: {name}");
                }
            }
        }
        let dotted = Field { name: "a.b".to_owned(), kind: Kind::Other, repeat: Repeat::Once };
        assert_eq!((step("a.b", &dotted), step("a.b.c", &dotted)), (Some(""), Some("c")));
    }
}
