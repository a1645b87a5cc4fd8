//! In: a scene file, a design, a seed. Out: recordings of a station whose truth is known: pictures, poses,
//! calibration, and the exact surface for measuring errors.
//! Frame and unit: scene, base, flange, camera, part; mm. Independent of the scanner: it never reads a peak.

mod light;
mod options;
mod pattern;
mod picture;
mod plan;
mod ride;
pub mod rig;
pub mod rig_scene;
mod scene;
mod sensor;
mod sets;
mod solid;
pub mod station;
mod truth;
mod write;

pub use light::{Canvas, InScene, LitPoint, View};
pub use options::{DEFAULT_SCENE, Set, SimulateOptions};
pub use pattern::Pattern;
pub use picture::expose;
pub use plan::{Views, above, base_from_scene, board_views, flange, reported, scan};
pub use ride::Ride;
pub use rig::RigSpec;
pub use scene::{CutSpec, Hit, Material, PartSpec, Scene, SceneSpec, ShapeSpec, SolidSpec, part_pose};
pub use sensor::Sensor;
pub use sets::{riding_board, scene_from_board};
pub use station::{LineLaser, Pointer, Station, TRUE_VALUES};
pub use truth::{CloudErrors, PartTruth, PointerTruth, Truth, TruthFile};
pub use write::{Simulated, simulate};
