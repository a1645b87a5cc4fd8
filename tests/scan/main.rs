//! In: pictures of laser stripes, drawn or simulated, with known truth. Out: whether the way from pixels to a cloud
//! is right on GPU and twins, and whether what cannot be scanned is explained.
//! Frame and unit: px of the picture, mm of the base frame.

#[path = "../common/mod.rs"]
mod common;

mod brackets;
mod chain;
mod cramer_rao;
mod cut_stripes;
mod faint_stripes;
mod masks;
mod shift_scan;
mod speckle_grain;
mod wide_stripes;
