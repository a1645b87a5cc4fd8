//! In: several recordings of one part. Out: each of them scanned and searched, and how far the places that were found
//! lie apart.
//! Frame and unit: the scans' frame; mm, degrees.

mod files;
mod repeats;
mod rows;
mod run;

pub use repeats::{Placed, Repeats, Spread, repeats};
pub use rows::{Batch, BatchRow, FoundAt};
pub use run::{BatchOptions, batch};
