//! In: scenes (pictures, height maps, points) and recipes. Out: matches, and insertion poses with their uncertainty or
//! a refusal with its reason.
//! Frame and unit: scene pixels for matches; base frame, mm, for poses.

pub mod dxf;
pub mod insert;
pub mod look;
pub mod measure;
mod mend;
pub mod model;
pub mod scene;
pub mod search;

pub use insert::CutOff;
pub use insert::locate::{LocateOptions, Report, agree, beyond_rim, locate};
pub use insert::recipe::Recipe;
pub use insert::{OtherScale, TaskOptions, other_scale, recipe_of};
pub use look::{LookPlan, Shown, plan_look};
pub use model::drawing::Drawing;
pub use model::shape_model::{ModelOptions, ShapeModel};
pub use model::template::Template;
pub use scene::{Kind, Layer, Region, Scene};
pub use search::accelerator::Accelerator;
pub use search::area::Area;
pub use search::examples::{Example, teach_examples};
pub use search::full::{Match, find, find_in, find_on};
pub use search::options::SearchOptions;
pub use search::refine::Pose;
pub use search::taught::{Weak, find_taught};
