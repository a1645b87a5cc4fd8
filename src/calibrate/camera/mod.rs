//! In: boards as seen in pictures. Out: the camera's intrinsics and lens with covariance and verdict.
//! Frame and unit: camera frame; px, mm (docs/math.md, Camera calibration).

pub mod board_shape;
mod bundle;
mod choice;
mod fit;
pub mod intrinsics;
pub mod lens;
pub mod parts;
mod pictures;
pub mod procedure;
pub mod quality;
pub mod ray_error;
mod repeat;
pub mod report;
pub mod zhang;

pub use choice::Doubt;
