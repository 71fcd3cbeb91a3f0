//! The results that a command prints: all of them reach stdout, or the command fails.

use crate::commands::{harmless, style};
use crate::error::Error;
use std::io::{self, ErrorKind, Write as _};
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether stdout was closed when the process began. Only `main` can see that: before it runs, the standard library opens
/// `/dev/null` in the place of a closed descriptor, where everything can be written and nothing arrives.
pub static WAS_CLOSED: AtomicBool = AtomicBool::new(false);

/// Prints a result, at once. A reader that has seen enough and closed the pipe is no error.
///
/// # Errors
/// [`Error::Stdout`] where it cannot be written: a full disk, a closed descriptor.
pub fn print(text: &str) -> Result<(), Error> {
    written(|out| out.write_all(harmless(text, style()).as_bytes()))
}

/// Prints a value as JSON, without holding the text of all of it.
///
/// # Errors
/// As [`print`].
pub fn print_json(value: &impl serde::Serialize) -> Result<(), Error> {
    written(|out| {
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
        self.out.write_all(harmless(&text, style()).as_bytes())?;
        self.pending.clear();
        Ok(())
    }
}

/// Writes to stdout by other means than [`print`], such as the help of the command line.
///
/// # Errors
/// As [`print`].
pub fn written(write: impl FnOnce(&mut dyn io::Write) -> io::Result<()>) -> Result<(), Error> {
    if WAS_CLOSED.load(Ordering::Relaxed) {
        return Err(Error::Stdout(io::Error::other("it is closed")));
    }
    #[allow(clippy::disallowed_methods, reason = "this is where results are printed")]
    let mut out = io::stdout().lock();
    match write(&mut out).and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(Error::Stdout(e)),
        _ => Ok(()),
    }
}
