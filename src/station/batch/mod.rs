//! In: a manifest of recordings, a station, a recipe, settings. Out: a folder of results for each recording, named by
//! the hash of all that it was made from; tables of all of them; how the poses of a part repeat.
//! Frame and unit: the scans' frame; mm, degrees.

mod identity;
mod input;
mod manifest;
#[cfg(feature = "tables")]
mod merge;
mod one;
#[cfg(feature = "tables")]
mod parquet;
mod plan;
mod repeats;
mod rows;
mod run;
mod shard;
mod shots;
#[cfg(feature = "tables")]
mod tables;
#[cfg(feature = "tables")]
mod text;

pub use identity::BatchOptions;
pub use manifest::{Entry, Manifest, written as manifest_of};
#[cfg(feature = "tables")]
pub use merge::{Merged, merge};
pub use plan::Planned;
pub use repeats::{Placed, Repeats, Spread, repeats};
pub use rows::{BatchRow, FoundAt, Line as BatchLine, Problem, State};
pub use run::{Tally, batch, plan};
pub use shard::Shard;
pub use shots::ShotRow;
