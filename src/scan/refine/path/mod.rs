//! In: a scan's cloud and the reported camera pose at each shot. Out: the same cloud without the report's scatter
//! about the camera's path, if the surface shows that the report scattered and not the camera.
//! Frame and unit: the cloud's frame, mm, rad (docs/math.md, Places that scatter).

mod sides;
mod smooth;
mod straight;
mod witness;

pub use straight::{PathFound, Straight, straight};
