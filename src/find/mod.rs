//! In: scenes (pictures, height maps, points) and recipes. Out: matches, and insertion poses with their
//! uncertainty or an honest refusal.
//! Frame and unit: scene pixels for matches; base frame, mm, for poses.

pub mod budget;
pub mod coarse;
pub mod construct;
pub mod drawing;
pub mod gradient;
pub mod insertion;
pub mod measure;
pub mod model;
pub mod picture;
pub mod points;
pub mod recipe;
pub mod refine;
pub mod scene;
pub mod search;
pub mod slide;
pub mod teach;
pub mod verdict;

pub use drawing::Drawing;
pub use insertion::{LocateOptions, Report, locate};
pub use model::{ModelOptions, ShapeModel};
pub use recipe::Recipe;
pub use refine::Pose;
pub use scene::{Kind, Layer, Region, Scene};
pub use search::{Match, SearchOptions, find};
