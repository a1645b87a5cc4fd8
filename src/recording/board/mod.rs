//! In: descriptions of calibration boards, also those of other programs. Out: the layout of a board and its markers.
//! Frame and unit: board frame, mm.

mod foreign;
mod load;
mod mark;
mod markers;
mod spec;

pub use mark::{OriginMark, hexagonal_node};
pub use markers::Markers;
pub use spec::{BoardSpec, MarkerLayout};
