//! What is being done now, on stderr, when somebody watches.

use indicatif::{ProgressBar, ProgressStyle};
use std::time::Duration;

/// A one-line spinner; silent when stderr is not a terminal.
pub struct Progress {
    bar: ProgressBar,
}

impl Progress {
    /// A spinner on stderr (hidden by indicatif when stderr is not a terminal).
    pub fn new() -> Progress {
        let bar = ProgressBar::new_spinner();
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} [{elapsed}]") {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(100));
        Progress { bar }
    }

    /// Says nothing.
    pub fn silent() -> Progress {
        Progress { bar: ProgressBar::hidden() }
    }

    /// Says what begins now.
    pub fn step(&self, what: &str) {
        self.bar.set_message(what.to_owned());
    }

    /// Removes the line.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

impl Default for Progress {
    fn default() -> Self {
        Progress::new()
    }
}
