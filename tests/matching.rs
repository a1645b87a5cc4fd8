//! In: drawn pictures, real photographs and height maps (SHEETLIGHT_REFERENCE). Out: judgement on `match`, `teach --region`,
//! `import-map`, `find --all`, ranges and regions, and on what of a part is found when the rest is hidden.
//! Frame and unit: pixels, degrees, mm.

mod common;

#[path = "matching/command.rs"]
mod command;
#[path = "matching/foreign.rs"]
mod foreign;
#[path = "matching/limits.rs"]
mod limits;
#[path = "matching/recall.rs"]
mod recall;
#[path = "matching/scenes.rs"]
mod scenes;
#[path = "matching/shadows.rs"]
mod shadows;
