//! Who hears how far the work is.

/// Hears how many recordings there are, which of them are done, and what fails.
pub trait Counter: Sync {
    /// From now on so many recordings are counted.
    fn count(&self, recordings: usize);
    /// One of them is done.
    fn advance(&self, name: &str);
    /// Something that is to be told at once.
    fn say(&self, text: &str);
}
