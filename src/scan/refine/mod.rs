//! In: a whole scan's cloud and the reported camera pose at each shot. Out: the same cloud, corrected for errors
//! that its lines show relative to each other: scatter of the poses, and shifts of the light caused by the surface's
//! brightness.
//! Frame and unit: the cloud's frame, mm.

mod path;
mod refining;
mod sheet;
mod slope;

pub use path::{PathFound, Straight, straight};
pub use refining::Refining;
pub use sheet::{SheetFound, Thick};
