//! In: the skeleton's lines. Out: the lines with their ends lengthened; the pixels of them that are fitted. Frame and
//! unit: pixels.

pub mod lengthen;
pub mod spacing;
