//! In: command-line options for parts. Out: models, recipes, found poses, verification scans.
//! Frame and unit: base frame, mm.

pub mod batch;
pub mod filter;
pub mod ghost;
pub mod import_map;
pub mod locate;
pub mod matching;
pub mod model;
pub mod program;
pub mod second_look;
pub mod teach;
