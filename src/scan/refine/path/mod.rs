//! In: a scan's cloud and where the camera was reported at each shot. Out: the same without the report's scatter
//! about the path that the camera went, where the surface shows that the report scattered and not the camera.
//! Frame and unit: the cloud's frame, mm, rad (docs/math.md, Places that scatter).

mod sides;
mod smooth;
mod straight;
mod witness;

pub use straight::{PathFound, Straight, straight};
