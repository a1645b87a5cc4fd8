//! In: camera, laser plane, lines across the stripe. Out: the same in f32 for the stage that computes points, and where
//! rays meet the plane. Frame and unit: camera frame, px, mm.

mod frame;
mod ray;

pub use frame::{FLAT, Optics, PointFrame};
pub(in crate::stages) use ray::NEWTON;
pub(super) use ray::meet;
