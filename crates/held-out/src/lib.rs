//! A calibrated model on recordings that were held out of its calibration.
//!
//! [`verify`] compares the result of an earlier run with new recordings, in points, paths and by ISO 9283; [`transfer_between_recordings`] and
//! [`transfer_between_sessions`] ask of every effect whether what it learnt in some recordings, or in another session, lowers the error in others.
//! `past` puts an arm that was calibrated elsewhere among the frames of here. What is told of it all is in `report`.

#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod error;
mod stored;
mod transfer;
mod verify;

pub use error::HeldOutError;
pub use transfer::{
    Asked, LeftOut, SessionTransfer, Transfer, transfer_between_recordings, transfer_between_sessions,
};
pub use verify::verify;
