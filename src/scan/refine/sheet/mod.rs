//! In: a scan's cloud, the camera pose at each shot, the laser plane. Out: the same cloud without the shifts that
//! the sheet's thickness causes where the surface's brightness changes, as far as the cloud itself shows them.
//! Frame and unit: the cloud's frame, mm (docs/math.md, Sheets that are thick).

mod lines;
mod thick;

pub use thick::{SheetFound, Thick};
