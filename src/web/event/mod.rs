//! In: what happens in jobs. Out: events for every viewer. A slow viewer misses some and never delays anything.
//! Frame and unit: bytes, rows of a growing height map (mm).

mod growing;
mod hub;
mod socket;

pub use growing::Growing;
pub use hub::Hub;
pub use socket::stream;
