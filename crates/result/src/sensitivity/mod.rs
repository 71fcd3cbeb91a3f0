//! What each residual says about the places where an error may enter, and the shape of an effect by itself.

mod bands;
mod basis;
mod groups;
mod of_dwells;
mod signature;

pub use bands::{Band, bands, drivers_of};
pub use basis::{Basis, Driver};
pub use groups::{Group, groups};
pub use of_dwells::{Channel, Sensitivities};
pub use signature::{Signature, signatures};
