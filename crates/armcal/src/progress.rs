//! What is being done now, on stderr, when somebody watches.

use armcal_archive::Counter;
use armcal_core::printable_name;
use armcal_stages::Steps;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::Write as _;
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
        // Nobody sees it turn elsewhere, and it would take a thread.
        if !bar.is_hidden() {
            bar.enable_steady_tick(Duration::from_millis(100));
        }
        Progress { bar }
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

impl Steps for Progress {
    fn step(&self, what: &str) {
        Progress::step(self, what);
    }
}

impl Counter for Progress {
    /// With their rate and the time left.
    fn count(&self, recordings: usize) {
        self.bar.set_length(recordings as u64);
        let shown = "{bar:30} {pos}/{len} recordings, {per_sec}, {eta} left  {msg}";
        if let Ok(style) = ProgressStyle::with_template(shown) {
            self.bar.set_style(style);
        }
    }

    fn advance(&self, name: &str) {
        self.bar.set_message(name.to_owned());
        self.bar.inc(1);
    }

    /// Above the line.
    fn say(&self, text: &str) {
        // A closed stderr leaves nowhere to tell it; results will.
        self.bar.suspend(|| drop(writeln!(std::io::stderr(), "{}", printable_name(text))));
    }
}

impl Default for Progress {
    fn default() -> Self {
        Progress::new()
    }
}
