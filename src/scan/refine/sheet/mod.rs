//! In: a scan's cloud, where the camera was at each shot, the laser plane. Out: the same cloud without what the
//! sheet's thickness does where the brightness of the surface changes, as far as the cloud itself shows it.
//! Frame and unit: the cloud's frame, mm (docs/math.md, Sheets that are thick).

mod lines;
mod thick;

pub use thick::{SheetFound, Thick};
