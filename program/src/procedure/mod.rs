//! In: nothing. Out: procedures with their inputs, in the one form in which the command line, the screen and other
//! programs order them.
//! Frame and unit: as each input states.

mod at;
pub mod calibrate;
pub(crate) mod filter;
mod find;
mod insert;
mod pins;
pub(crate) mod scan;
mod suits;
mod touch;
pub(crate) mod word;

pub use at::{At, Names, Remark};
pub use filter::FilterOrder;
pub use find::{FindOrder, Located};
pub use insert::InsertOrder;
pub use scan::ScanOrder;
pub use suits::suits;
pub use touch::TouchOrder;
