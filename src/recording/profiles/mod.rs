//! In: files of a line-profile sensor. Out: its profiles, one list of places each; such files can be written too.
//! Frame and unit: the sensor's own plane (x along the line, z away from the sensor), mm.

mod profile;
mod read;
mod sequences;
mod write;

pub use profile::{Profile, measured};
pub use read::{files_of, from_csv, from_yaml, load};
pub use write::ProfileWriter;
