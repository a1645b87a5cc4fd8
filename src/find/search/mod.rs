//! In: a scene, a shape model. Out: matches with score, place, turn, scale and their sigmas.
//! Frame and unit: scene pixels, radians (docs/math.md, Shape matching).

pub mod accelerator;
pub mod area;
mod climb;
pub mod coarse;
pub mod examples;
pub mod full;
pub mod level;
pub mod options;
pub mod picture;
pub mod refine;
pub mod taught;
pub mod witness;
