//! In: drawn pictures. Out: judgement on ranges and regions, and on what of a part is found when the rest is hidden.
//! Frame and unit: pixels, degrees, mm.

mod examples;
mod limits;
mod recall;
mod scenes;
mod shadows;
mod witness;
