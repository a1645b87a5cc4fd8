//! In: a scan, a recipe, the rig's calibrations. Out: the insertion pose with its error budget and gates, or a refusal.
//! Frame and unit: base frame; mm, degrees.

pub mod budget;
mod from_drawing;
mod hypothesis;
pub mod locate;
pub mod picture;
mod places;
pub mod recipe;
mod report;
mod rim;
mod scale;
pub mod teach;
pub mod verdict;

pub use from_drawing::{TaskOptions, recipe_of};
pub use rim::CutOff;
pub use scale::{OtherScale, other_scale};
