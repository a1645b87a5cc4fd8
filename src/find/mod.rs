//! In: scenes (pictures, height maps, points) and recipes. Out: matches, and insertion poses with their
//! uncertainty or an honest refusal.
//! Frame and unit: scene pixels for matches; base frame, mm, for poses.

pub mod accelerator;
pub mod budget;
mod climb;
pub mod coarse;
pub mod construct;
mod datum;
pub mod drawing;
pub mod drawn_edges;
pub mod dxf;
pub mod edge_index;
mod edge_pieces;
pub mod explain;
mod face;
mod from_drawing;
pub mod gradient;
mod in_plane;
pub mod insertion;
pub mod levers;
mod lit_edges;
mod look_plan;
mod look_stack;
pub mod looks;
pub mod measure;
pub mod mirror;
pub mod model;
mod outline;
pub mod part_seen;
pub mod picture;
pub mod points;
pub mod recipe;
pub mod refine;
pub mod register;
mod robust;
pub mod scene;
pub mod search;
pub mod search_options;
pub mod size;
pub mod slide;
pub mod surface_ends;
pub mod teach;
pub mod verdict;

pub use accelerator::Accelerator;
pub use drawing::Drawing;
pub use from_drawing::{TaskOptions, recipe_of};
pub use insertion::{LocateOptions, Report, agree, locate};
pub use look_plan::{LookPlan, Shown, plan_look};
pub use model::{ModelOptions, ShapeModel};
pub use recipe::Recipe;
pub use refine::Pose;
pub use scene::{Kind, Layer, Region, Scene};
pub use search::{Match, find, find_on};
pub use search_options::SearchOptions;
