//! In: grey pictures of the stripe. Out: the stages from picture to skeleton, and from peaks to chosen points. Each has
//! a shader of the same name and a CPU twin. Frame and unit: pixels, grey levels; points in the poses' frame, mm.

pub mod ambient;
pub mod bound;
pub mod choose;
pub mod choose_params;
pub mod hough;
pub mod lines;
pub mod optics;
pub mod point;
pub mod skeleton;
pub(in crate::stages) mod specks;
pub mod stats;
pub mod thin;
pub mod threshold;
pub mod threshold_params;
pub mod tiles;

pub use lines::{lengthen, spacing};
