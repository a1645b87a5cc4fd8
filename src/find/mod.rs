//! In: scenes (pictures, height maps, points) and recipes. Out: matches, and insertion poses with their
//! uncertainty or an honest refusal.
//! Frame and unit: scene pixels for matches; base frame, mm, for poses.

pub mod coarse;
pub mod drawing;
pub mod gradient;
pub mod model;
pub mod refine;
pub mod scene;
pub mod search;

pub use drawing::Drawing;
pub use model::{ModelOptions, ShapeModel};
pub use refine::Pose;
pub use scene::{Kind, Layer, Region, Scene};
pub use search::{Match, SearchOptions, find};
