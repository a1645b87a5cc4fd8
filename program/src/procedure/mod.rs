//! In: nothing. Out: procedures with their inputs, in the one form in which the command line, the screen and other
//! programs order them.
//! Frame and unit: as each input states.

mod at;
pub mod calibrate;
pub(crate) mod scan;
mod suits;
mod touch;
pub(crate) mod word;

pub use at::{At, Remark};
pub use scan::ScanOrder;
pub use suits::suits;
pub use touch::TouchOrder;
