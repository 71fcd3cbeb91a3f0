//! What a campaign found, as a value. Everything is in the order of the manifest; nothing depends on when or where a recording was
//! worked on.

use armcal_campaign::{Change, Row, Series, Status, find_changes, quantity_series};

/// Many recordings of one rig, each calibrated by itself.
#[derive(Debug, Clone)]
pub struct Campaign {
    /// Name of the pipeline.
    pub pipeline: String,
    /// What was calibrated, in the order of the manifest.
    pub rows: Vec<Row>,
    /// Folder of the results of each row, relative to the campaign's.
    pub folders: Vec<String>,
    /// What could not be, in the same order.
    pub failed: Vec<FailedRecording>,
    /// Recordings that hold what an earlier one holds.
    pub repeats: Vec<Repeat>,
    /// Quantities over time; points name rows by index.
    pub series: Vec<Series>,
    /// What changes in them.
    pub changes: Vec<Change>,
}

/// A recording without a result.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct FailedRecording {
    /// Its name.
    pub recording: String,
    /// Its files as given.
    pub paths: Vec<String>,
    /// Why, as `armcal run` says it.
    pub why: String,
}

/// A recording with dwells that an earlier one of the campaign has too; both by their rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct Repeat {
    /// The recording.
    pub row: usize,
    /// The one that has them already.
    pub of: usize,
    /// How many dwells.
    pub dwells: usize,
    /// Of so many.
    pub all: usize,
}

impl Repeat {
    /// Whether the recording is no evidence of its own: at least half of it is in the other.
    pub fn counts_once(&self) -> bool {
        2 * self.dwells >= self.all
    }
}

impl Campaign {
    /// Puts recordings together and looks for changes; what repeats another recording does not count again.
    pub fn of(
        pipeline: &str,
        results: Vec<(Row, String)>,
        failed: Vec<FailedRecording>,
        repeats: Vec<Repeat>,
    ) -> Campaign {
        let (rows, folders): (Vec<Row>, Vec<String>) = results.into_iter().unzip();
        let series = quantity_series(&rows, |row| is_counted(&repeats, row));
        let changes = find_changes(&series);
        Campaign { pipeline: pipeline.to_owned(), rows, folders, failed, repeats, series, changes }
    }

    /// Rows that are evidence of their own.
    pub fn counted(&self) -> impl Iterator<Item = &Row> {
        let rows = self.rows.iter().enumerate();
        rows.filter(|(row, _)| is_counted(&self.repeats, *row)).map(|(_, row)| row)
    }

    /// The gravest thing about any recording; one that failed counts as data lost.
    pub fn status(&self) -> Status {
        let failed = (!self.failed.is_empty()).then_some(Status::DataLost);
        self.rows.iter().map(|row| row.status).chain(failed).max().unwrap_or(Status::Ok)
    }
}

fn is_counted(repeats: &[Repeat], row: usize) -> bool {
    !repeats.iter().any(|repeat| repeat.row == row && repeat.counts_once())
}
