//! Values of a rig that come from elsewhere, or go there, and how well they are taken to be known.

mod assumed;
mod exchange;
mod foreign;

pub use assumed::Sigmas;
pub use exchange::{PlaneValue, Values};
pub use foreign::{Format as ValuesFormat, written as written_camera};
