//! Whether a text is as armcal wrote it: its mark carries a hash of everything else in it.
//!
//! `# armcal.pipeline/1, proposed by ..` is written as `# armcal.pipeline/1 sha256:0123456789abcdef, proposed by ..`. Texts that
//! people edit have it, TOML, URDF and Markdown; JSON, tables and pages have none.

use sha2::{Digest as _, Sha256};
use std::borrow::Cow;
use std::io::{self, Read};

/// A mark stands in one of so many lines.
const HEAD_LINES: usize = 8;
/// How a comment that is a mark begins, and whether it carries a hash.
const COMMENTS: [(&str, bool); 4] = [
    ("# armcal.", true),
    ("<!-- armcal.", true),
    (".\\\" armcal.", false),
    ("<meta name=\"generator\" content=\"armcal.", false),
];
/// Between the word for the kind and the hash.
const WORD: &str = " sha256:";
/// Hexadecimal digits of the hash: against oversights, not against forgers.
const DIGITS: usize = 16;

/// What the hash of a text says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Seal {
    /// There is none: another form, or an earlier version.
    None,
    /// The text is as it was written.
    Whole,
    /// It was changed since.
    Broken,
}

/// The mark of a text.
pub(crate) struct Comment {
    pub kind: String,
    /// Where the word for the kind ends, of a text that carries a hash.
    seal_at: Option<usize>,
}

/// The comment in the first lines of a text that says what armcal made it as.
pub(crate) fn mark_comment(head: &str) -> Option<Comment> {
    let mut at = 0;
    for line in head.split_inclusive('\n').take(HEAD_LINES) {
        for (begins, seals) in COMMENTS {
            let word = line.strip_prefix(begins);
            if let Some((kind, bytes)) = word.and_then(parse_kind) {
                let seal_at = seals.then_some(at + begins.len() + bytes);
                return Some(Comment { kind, seal_at });
            }
        }
        at += line.len();
    }
    None
}

/// `KIND` of `KIND/N...`, and how many bytes `KIND/N` has.
pub(crate) fn parse_kind(text: &str) -> Option<(String, usize)> {
    let (kind, version) = text.split_once('/')?;
    let plain = !kind.is_empty() && kind.bytes().all(|b| b.is_ascii_alphanumeric() || b"-_".contains(&b));
    let digits = version.bytes().take_while(u8::is_ascii_digit).count();
    (plain && digits > 0).then(|| (kind.to_owned(), kind.len() + 1 + digits))
}

/// A text whose mark says what the rest of it is; one without a mark, or of a form that has no hash, as it is.
pub fn seal_text(text: &str) -> Cow<'_, str> {
    let Some(at) = mark_comment(text).and_then(|comment| comment.seal_at) else { return Cow::Borrowed(text) };
    let (before, after) = text.split_at(at);
    let after = &after[of_word(after.as_bytes()).map_or(0, <[u8]>::len)..];
    Cow::Owned(format!("{before}{WORD}{}{after}", hash_parts([before.as_bytes(), after.as_bytes()])))
}

/// The same of bytes, which stay as they are where they are no text.
pub(crate) fn sealed_bytes(bytes: &[u8]) -> Cow<'_, [u8]> {
    match std::str::from_utf8(bytes).map(seal_text) {
        Ok(Cow::Owned(text)) => Cow::Owned(text.into_bytes()),
        _ => Cow::Borrowed(bytes),
    }
}

/// Whether a text has a mark that can carry a hash.
pub fn is_marked(text: &str) -> bool {
    mark_comment(text).is_some_and(|comment| comment.seal_at.is_some())
}

impl Comment {
    /// What the hash says of a text with this mark, given its beginning and what follows.
    pub fn seal(&self, head: &[u8], mut rest: impl Read) -> io::Result<Seal> {
        let Some((before, after)) = self.seal_at.and_then(|at| head.split_at_checked(at)) else {
            return Ok(Seal::None);
        };
        let Some(word) = of_word(after) else { return Ok(Seal::None) };
        let mut hasher = Sha256::new();
        hasher.update(before);
        hasher.update(&after[word.len()..]);
        let mut buffer = [0; 16 << 10];
        loop {
            match rest.read(&mut buffer) {
                Ok(0) => break,
                Ok(count) => hasher.update(&buffer[..count]),
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                Err(e) => return Err(e),
            }
        }
        let now = hash_digits(hasher);
        Ok(if word.ends_with(now.as_bytes()) { Seal::Whole } else { Seal::Broken })
    }
}

/// The hash that a text begins with, and the word before it.
fn of_word(text: &[u8]) -> Option<&[u8]> {
    let word = text.get(..WORD.len() + DIGITS)?;
    (word.starts_with(WORD.as_bytes()) && word[WORD.len()..].iter().all(u8::is_ascii_hexdigit))
        .then_some(word)
}

fn hash_parts<const N: usize>(parts: [&[u8]; N]) -> String {
    let mut hasher = Sha256::new();
    parts.iter().for_each(|part| hasher.update(part));
    hash_digits(hasher)
}

fn hash_digits(hasher: Sha256) -> String {
    let mut digits = hex::encode(hasher.finalize());
    digits.truncate(DIGITS);
    digits
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seal(text: &str) -> Seal {
        mark_comment(text).map_or(Seal::None, |c| c.seal(text.as_bytes(), io::empty()).expect("read"))
    }

    #[test]
    fn any_change_breaks_a_seal_and_sealing_again_mends_it() {
        for text in [
            "# armcal.pipeline/1, proposed by `armcal init`\nname = 'a'\n",
            "<?xml version=\"1.0\"?>\n<!-- armcal.calibrated-model/12 -->\n<robot/>\n",
            "# armcal.board/1\n",
        ] {
            let whole = seal_text(text).into_owned();
            assert_eq!(whole.len(), text.len() + WORD.len() + DIGITS, "{whole}");
            assert_eq!((seal(text), seal(&whole)), (Seal::None, Seal::Whole), "{whole}");
            assert_eq!(seal_text(&whole), whole, "sealed twice");
            for changed in [whole.clone() + "\n", whole.replacen("armcal.", "armcal.x", 1)] {
                assert_eq!(seal(&changed), Seal::Broken, "{changed}");
                assert_eq!(seal(&seal_text(&changed)), Seal::Whole, "{changed}");
            }
            let (head, rest) = whole.as_bytes().split_at(whole.len() - 1);
            let parted = mark_comment(&whole).expect("a mark").seal(head, rest);
            assert_eq!(parted.expect("read"), Seal::Whole, "{whole}");
        }
        for plain in ["name = 'a'\n", "{\"schema\": \"armcal.summary/1\"}", ".\\\" armcal.man/1\n", ""] {
            assert_eq!(seal_text(plain), plain);
        }
    }
}
