//! In: a scene file. Out: its surfaces, for rays and for distances.
//! Frame and unit: scene frame, z up, mm.

mod spec;
mod surfaces;

pub use spec::{CutSpec, Material, PartSpec, SceneSpec, ShapeSpec, SolidSpec};
pub use surfaces::{Hit, Scene, part_pose};
