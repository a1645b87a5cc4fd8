//! In: pictures of circle grids, with or without a mark that shows their origin. Out: the dots' centres with their ids.
//! Frame and unit: pixels; ids as in `BoardSpec::features()`.

mod blobs;
pub mod circles;
mod ellipse;
mod finder_patterns;
mod lattice;
mod origin_mark;
