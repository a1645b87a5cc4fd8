//! In: a rig, and pictures that a program of its own has. Out: scans, profile by profile or whole.
//! Frame and unit: robot's base, mm.

mod given;
mod profiles;
mod scan;

pub use profiles::Profiles;
pub use scan::Scan;
