//! In: points. Out: height maps, their files and pictures.
//! Frame and unit: the grid's own frame, mm.

pub(super) mod files;
mod filling;
pub(super) mod filter;
pub(super) mod grid;
pub(super) mod heightmap;
pub(super) mod picture;
pub(super) mod spec;
