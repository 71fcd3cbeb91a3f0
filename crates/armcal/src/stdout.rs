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
