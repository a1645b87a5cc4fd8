//! In: a whole scan's cloud, where the camera was reported at its shots. Out: the same without what the lines of the
//! cloud show to be wrong with each other: places that scatter, light that brightness pulls.
//! Frame and unit: the cloud's frame, mm.

mod path;
mod refining;
mod sheet;
mod slope;

pub use path::{PathFound, Straight, straight};
pub use refining::Refining;
pub use sheet::{SheetFound, Thick};
