//! In: what happens in jobs. Out: the same to every browser that looks on, newest first; one that is slow misses some
//! and never holds anything up.
//! Frame and unit: bytes, rows of a growing height map (mm).

mod growing;
mod hub;
mod socket;

pub use growing::Growing;
pub use hub::Hub;
pub use socket::stream;
