//! In: a GigE Vision camera's serial number, address or name. Out: its pictures as a source, of a 3-D camera its
//! profiles; its features; a list of the cameras found.
//! Frame and unit: the camera's clock in ns; features by the standard names (SFNC).

mod camera;
mod coordinates;
mod delivery;
mod features;
mod find;
mod numbers;
mod part_stream;
mod parts;
mod pixels;
mod readout;

pub use camera::GigeCamera;
pub use coordinates::{Coordinates, Scaled, Told};
pub use find::{Found, find, found, interfaces};
pub use pixels::{depth, unpack};
