//! What a command prints: results all reach stdout, or the command fails; losses that they have no place for go to stderr.

use crate::error::Error;
use armcal_core::Warning;
use armcal_report::TerminalStyle;
use std::borrow::Cow;
use std::io::{self, ErrorKind, IsTerminal as _, Write as _};

/// Losses told one by one where there is no other place for them.
const TOLD: usize = 20;

/// Prints a result, at once. A reader that has seen enough and closed the pipe is no error.
///
/// # Errors
/// [`Error::Stdout`] where it cannot be written: a full disk.
pub fn print(text: &str) -> Result<(), Error> {
    write_stdout(|out| out.write_all(escape_control_characters(text, terminal_style()).as_bytes()))
}

/// Prints a value as JSON, without holding the text of all of it.
///
/// # Errors
/// As [`print`].
pub fn print_json(value: &impl serde::Serialize) -> Result<(), Error> {
    write_stdout(|out| {
        let mut lines = Lines { out, pending: Vec::new() };
        serde_json::to_writer_pretty(&mut lines, value)?;
        lines.pending.push(b'\n');
        lines.flush()
    })
}

/// Printed some lines at a time: a character is never cut in two.
struct Lines<'a> {
    out: &'a mut dyn io::Write,
    pending: Vec<u8>,
}

/// Lines are printed once there are so many bytes of them.
const LINES_BYTES: usize = 64 << 10;

impl io::Write for Lines<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.pending.extend_from_slice(bytes);
        if self.pending.len() >= LINES_BYTES && bytes.ends_with(b"\n") {
            self.flush()?;
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        let text = String::from_utf8_lossy(&self.pending);
        self.out.write_all(escape_control_characters(&text, terminal_style()).as_bytes())?;
        self.pending.clear();
        Ok(())
    }
}

/// Writes to stdout by other means than [`print`], such as the help of the command line.
///
/// # Errors
/// As [`print`].
pub fn write_stdout(write: impl FnOnce(&mut dyn io::Write) -> io::Result<()>) -> Result<(), Error> {
    #[allow(clippy::disallowed_methods, reason = "this is where results are printed")]
    let mut out = io::stdout().lock();
    match write(&mut out).and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(Error::Stdout(e)),
        _ => Ok(()),
    }
}

/// A text without control characters that a terminal would obey: names in it come from recordings. Lines, tabs and, where
/// we use them, colours stay; the others become `\u001b`, which also leaves JSON what it is.
pub fn escape_control_characters(text: &str, style: TerminalStyle) -> Cow<'_, str> {
    // Overrides of the writing direction would let a name rewrite the rest of its line.
    let turns = |c: char| matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    let is_harmless = |c: char| matches!(c, '\n' | '\t') || !c.is_control() && !turns(c);
    if text.chars().all(is_harmless) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        let colour = colour_code(rest).filter(|_| style == TerminalStyle::Colour);
        let taken = colour.unwrap_or(&rest[..c.len_utf8()]);
        match is_harmless(c) || colour.is_some() {
            true => shown.push_str(taken),
            false => shown.push_str(&format!("\\u{:04x}", u32::from(c))),
        }
        rest = &rest[taken.len()..];
    }
    Cow::Owned(shown)
}

/// The colour code a text begins with: `ESC [ numbers m`.
fn colour_code(text: &str) -> Option<&str> {
    let numbers = text.strip_prefix("\u{1b}[")?;
    let end = numbers.find(|c: char| !c.is_ascii_digit() && c != ';')?;
    numbers[end..].starts_with('m').then(|| &text[..end + "\u{1b}[m".len()])
}

/// Colours on a terminal, unless the user asked for none.
pub fn terminal_style() -> TerminalStyle {
    #[allow(clippy::disallowed_methods, reason = "nothing is written")]
    let colour = std::io::stdout().is_terminal() && std::env::var_os("NO_COLOR").is_none();
    if colour { TerminalStyle::Colour } else { TerminalStyle::Plain }
}

/// Says on stderr what recordings lost, where results have no place for it.
pub fn print_warnings(lost: &[Warning]) {
    let mut lines =
        lost.iter().take(TOLD).map(|w| format!("{}: {w}\n", w.severity.word())).collect::<String>();
    if lost.len() > TOLD {
        lines += &format!("and {} more; `armcal inspect` lists them\n", lost.len() - TOLD);
    }
    // A closed stderr leaves nowhere to complain to; the exit code still tells.
    let _ = std::io::stderr().write_all(escape_control_characters(&lines, TerminalStyle::Plain).as_bytes());
}

#[cfg(test)]
mod tests {
    use super::escape_control_characters;
    use armcal_report::TerminalStyle::{Colour, Plain};

    #[test]
    fn only_colours_and_lines_reach_the_terminal_as_they_are() {
        let ours = "\u{1b}[1mtitle\u{1b}[0m\n\tcell \u{1b}[38;5;11mü\u{1b}[39m";
        assert_eq!(escape_control_characters(ours, Colour), ours);
        assert_eq!(escape_control_characters("\u{1b}[1mtitle\n", Plain), "\\u001b[1mtitle\n");
        // Title, clipboard, screen, cursor, a C1 introducer, backspaces, carriage return.
        for (evil, shown) in [
            ("\u{1b}]0;pwned\u{7}", "\\u001b]0;pwned\\u0007"),
            ("\u{1b}[2J\u{1b}[H", "\\u001b[2J\\u001b[H"),
            ("\u{9b}31mx", "\\u009b31mx"),
            ("ab\u{8}\u{7f}\r", "ab\\u0008\\u007f\\u000d"),
            ("\u{1b}", "\\u001b"),
            ("a\u{202e}b", "a\\u202eb"),
            ("\u{1b}[31", "\\u001b[31"),
        ] {
            assert_eq!(escape_control_characters(evil, Colour), shown);
        }
        let json = serde_json::json!({ "name": "a\u{9b}b\u{7f}" });
        let printed =
            serde_json::from_str::<serde_json::Value>(&escape_control_characters(&json.to_string(), Plain));
        assert_eq!(printed.ok(), Some(json));
    }
}
