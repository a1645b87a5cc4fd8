//! In: the skeleton's lines. Out: their ends carried on; what of their pixels is fitted.
//! Frame and unit: pixels.

pub mod lengthen;
pub mod spacing;
