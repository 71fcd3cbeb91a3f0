//! What a campaign found, shown as terminal text, page, JSON and Parquet.
//!
//! `Run -> campaign_row -> Campaign -> files`. Everything is in the order of the manifest; nothing depends on when or
//! where a recording was worked on.

mod date;
mod describe;
mod files;
mod page;
mod row;
mod story;
mod terminal;

pub use files::{campaign_files, campaign_json, write_campaign};
pub use row::campaign_row;
pub use terminal::campaign_text;
