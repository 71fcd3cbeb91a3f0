//! Setup mistakes and faults as labs make them, and a judge of what `armcal run` says to them.
//!
//! `rigs -> session (sound) -> kinds (one mistake made in it) -> run (the program itself) -> judge (its outputs only) -> table`
//!
//! Nothing here knows how the program looks for mistakes. Sessions come from the virtual lab, or of the six-axis arm
//! from [`rigs::six_axis`], and the mistakes are made where labs make them: in the messages of a recording, in its
//! bytes, or in the texts of pipeline, board and arm.

#![cfg_attr(test, allow(clippy::unwrap_used))]

pub mod causes;
mod draw;
mod error;
pub mod judge;
pub mod kinds;
pub mod rigs;
pub mod run;
pub mod session;
pub mod sound;
pub mod table;

pub use draw::Draw;
pub use error::Error;
pub use kinds::{Kind, kinds};
pub use rigs::Rig;
pub use session::Session;
