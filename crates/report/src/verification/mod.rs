//! What `armcal verify` found, shown as terminal text, page, JSON and Parquet.

mod files;
mod iso;
mod page;
mod row;
mod terminal;

pub use files::{verification_files, verification_json, verification_paths};
pub use terminal::verification_text;

use armcal_result::{Closing, Verification};

/// What the errors at points are.
fn points_are(v: &Verification) -> &'static str {
    match v.closing {
        Closing::None => "Error at points",
        Closing::Some => "Error at points, and from tip to tip",
        Closing::All => "Closing error of joined tips",
    }
}

/// Why no criterion of ISO 9283 is told.
fn no_criteria(v: &Verification) -> &'static str {
    match v.closing {
        Closing::All => {
            "The criteria compare what was commanded with where a sensor saw the tip; joined tips are led by hand and seen \
             by none, so they have no meaning here."
        }
        Closing::None | Closing::Some => iso::NO_REPEATS,
    }
}
