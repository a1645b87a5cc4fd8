//! In: drawn pictures, real photographs and height maps (SHEETLIGHT_REFERENCE). Out: judgement on `match`,
//! `teach --region`, `import-map`, `find --all`, ranges and regions, and on what of a part is found when the rest is
//! hidden.
//! Frame and unit: pixels, degrees, mm.

mod command;
mod foreign;
mod limits;
mod recall;
mod scenes;
mod shadows;
