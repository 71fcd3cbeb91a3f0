//! `armcal view`: the report of a run, served to this machine's browser, where any combination of effects and any
//! hold-out is refitted as it is chosen.
//!
//! * [`Live`]: the page (`texts`), and the run behind it, ready to be refitted (`session`); `requests`: what the page may ask of it;
//! * `guard`: who may ask; `connections`: how many, and how long they may take; `server`: the few routes; `source`: which pipeline made a folder of results;
//! * `turns`: one refit at a time, and not too many that wait.

mod connections;
mod guard;
mod live;
mod requests;
mod server;
mod session;
mod source;
mod texts;
mod turns;

pub use live::Live;
pub use server::serve;
pub(crate) use source::FILE as SOURCE_FILE;
pub use source::{Given, write_source_file};
